"""docs/reference/datasets.md: its commands are orders and checks of them; its tables say what the code says."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import yaml
from hydra import compose, initialize_config_dir
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import OmegaConf

from datagen.campaigns import CAMPAIGNS
from datagen.order import order_from
from indexer_env.laws import LAWS
from indexer_env.presets import config_dir

PAGE = (Path(__file__).parents[1] / "docs" / "reference" / "datasets.md").read_text(encoding="utf-8")
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL) for line in block.splitlines()]
CHECKS = [command for command in COMMANDS if command.startswith("indexer check ")]
ORDERS = [command for command in COMMANDS if command not in CHECKS]


def first_job(arguments: list[str]) -> list[str]:
    """The overrides of the first job of a sweep; launchers are no part of an order."""
    plain = []
    for each in OverridesParser.create().parse_overrides([text for text in arguments if "hydra" not in text]):
        value = next(each.sweep_string_iterator()) if each.is_sweep_override() else None
        plain.append(each.input_line or "" if value is None else f"{each.get_key_element()}={value}")
    return plain


@pytest.mark.parametrize("command", CHECKS)
def test_what_is_checked_is_made_on_the_page(command):
    *_, folder = shlex.split(command)
    assert any(f"out={folder}" in shlex.split(order) for order in ORDERS)


@pytest.mark.parametrize("command", ORDERS)
def test_a_command_of_the_page_is_an_order(command):
    program, verb, *arguments = shlex.split(command)
    assert (program, verb) == ("indexer", "generate")
    if swept := arguments[0] == "-m":
        arguments = arguments[1:]
    assert swept == any(re.match(r"[\w.]+=[\w.]+,", each) for each in arguments)
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("generate", first_job(arguments)))
    assert isinstance(config, dict)
    assert order_from({str(key): value for key, value in config.items()}).count >= 1


def test_every_campaign_is_shown_with_its_size():
    assert all(f"campaign={name} " in PAGE or name == "grid" for name in CAMPAIGNS)
    for name in CAMPAIGNS:
        assert f"| `{name}` |" in PAGE and (config_dir() / "campaign" / f"{name}.yaml").is_file()
    sizes = yaml.safe_load((config_dir() / "campaign" / "wear.yaml").read_text(encoding="utf-8"))
    assert f"| {sizes['lives']} × {sizes['records_per_life']} |" in PAGE


def test_every_law_stands_in_the_table_as_it_is_written():
    assert all(f"| `{law.form}` |" in PAGE for law in LAWS.values())
