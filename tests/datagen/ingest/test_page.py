"""Every command line of docs/how-to/measured_data.md is one that the command takes."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from datagen.ingest.settings import settings_from
from indexer_env.presets import config_dir
from indexer_records.formats import FORMATS

PAGE = (Path(__file__).parents[3] / "docs" / "how-to" / "measured_data.md").read_text(encoding="utf-8")
LINES = re.findall(r"^indexer ingest (.+)$", PAGE, flags=re.MULTILINE)


@pytest.mark.parametrize("line", LINES)
def test_a_command_of_the_page_is_taken(line):
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("ingest", shlex.split(line)))
    assert isinstance(config, dict)
    settings = settings_from({str(key): value for key, value in config.items()})
    assert settings.period in (8.2, None)


def test_every_format_has_an_example():
    assert len(LINES) > len(FORMATS)
    for name in FORMATS:
        assert f"# {name}" in PAGE and re.search(rf"^\| [^|]*{name}", PAGE, flags=re.MULTILINE), name
