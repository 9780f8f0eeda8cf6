"""The generated pages hold every verb, key and package, with the ranges that the code checks."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from indexer_cli.verbs import VERBS
from indexer_cli.yaml_keys import read_page
from indexer_env.presets import config_dir

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "_extensions"))

import api  # noqa: E402
import command_pages  # noqa: E402
import docstrings  # noqa: E402
import llms_txt  # noqa: E402
import ranges  # noqa: E402

CONF = config_dir()
FILES = sorted(CONF.rglob("*.yaml"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(CONF)))
def test_every_key_of_conf_says_its_meaning(path: Path) -> None:
    page = read_page(path)
    assert page.summary
    if path.name != "command.yaml":  # Hydra's own settings
        assert [key.name for key in page.keys if key.default is not None and not key.meaning] == []


@pytest.fixture(scope="module")
def settings() -> dict[str, str]:
    return command_pages.settings()


@pytest.fixture(scope="module")
def commands() -> dict[str, str]:
    return command_pages.commands()


def test_every_key_of_every_group_stands_on_its_page(settings: dict[str, str]) -> None:
    groups = {path.parent.name for path in FILES if path.parent != CONF}
    assert groups == set(command_pages.GROUPS) == {name.removesuffix(".md") for name in settings} - {"index"}
    for path in FILES:
        if path.parent != CONF:
            section = settings[f"{path.parent.name}.md"].partition(f"## {path.parent.name}={path.stem}\n")[2]
            section = section.partition("\n## ")[0]
            keys = [key.name for key in read_page(path).keys if key.default is not None]
            assert [key for key in keys if f"| `{key}` |" not in section] == [], path


def test_every_verb_has_a_page_with_all_its_keys(commands: dict[str, str]) -> None:
    assert {name.removesuffix(".md") for name in commands} == {*VERBS, "index"}
    for verb in VERBS:
        for key in read_page(CONF / f"{verb}.yaml").keys:
            if key.default is not None:
                assert f"| `{key.name}` |" in commands[f"{verb}.md"]
    assert all(f"`{verb}`" in commands["index.md"] for verb in VERBS)
    assert "| `run.step` |" in commands["generate.md"]  # of a file that it takes over


@pytest.mark.parametrize(
    ("owner", "key", "told"),
    [
        ("machine", "table_inertia", "> 0"),  # a loop over names put together
        ("machine", "input_joint.backlash", "≥ 0, ≤ 0.5"),
        ("machine", "stations", "whole, ≥ 2, ≤ 1000"),
        ("sensor", "bits", "whole, ≥ 2, ≤ 32"),
        ("trainer", "patience", "whole, ≥ 1"),  # its owner is known only while it runs
        ("generate", "faults.backlash_deg", "≥ 0, ≤ 114.592"),  # checked in rad, typed in degrees
        ("generate", "run.sample_rate", "> 0, ≤ 1e+06"),
        ("monitor", "port", "whole, ≥ 0, ≤ 65535"),  # a loop over names with their bounds
        ("campaign", "draws.faults.backlash_deg", ""),  # a law, not a number
        ("train", "out", ""),
    ],
)
def test_a_range_is_that_of_the_check(owner: str, key: str, told: str) -> None:
    assert ranges.of(owner, key) == told


def test_the_api_has_every_package_and_public_module() -> None:
    pages = api.pages()
    assert {"indexer_env.md", "indexer_env.effects.md", "discrepancy.md", "monitor.web.md", "index.md"} <= set(pages)
    assert ".. automodule:: indexer_env.simulate\n   :members:" in pages["indexer_env.md"]
    assert "indexer_env.effects" in pages["indexer_env.md"].partition("toctree")[2]
    assert "\nindexer_env\n" in pages["index.md"] and "__main__" not in "".join(pages.values())


def test_a_docstring_keeps_its_columns_and_its_signs() -> None:
    lines = [
        "Map.",
        "",
        "Reading order",
        "-------------",
        "base      what all share",
        "rise      the rest",
        "",
        "|φ̇| of `a*b`",
    ]
    assert docstrings.as_rst(lines)[:-1] == [
        "Map.", "", ".. rubric:: Reading order", "", "::", "",
        "    base      what all share", "    rise      the rest", "", "\\|φ̇\\| of `a*b`",
    ]  # fmt: skip


def test_pages_that_docstrings_and_settings_name_are_linked(settings: dict[str, str]) -> None:
    (line,) = docstrings.as_rst(["(docs/explanation/physics.md, section Joints)"])[:-1]
    assert line == "(:doc:`physics </explanation/physics>`, section Joints)"
    assert "The reference machine ([physics](../../explanation/physics.md))" in settings["machine.md"]


def test_the_first_sentence_of_a_page() -> None:
    assert llms_txt.first_sentence("# Title\n\nYou get [a\nlist](b.md). And more.") == "You get a list."
    assert llms_txt.first_sentence("```{include} a.md\n```\n") == ""
