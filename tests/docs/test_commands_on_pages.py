"""Every command that a page shows has a verb and keys that exist."""

from __future__ import annotations

import re
import shlex
from functools import cache
from pathlib import Path

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from indexer_cli.manual import keys_of
from indexer_cli.verbs import VERBS

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "datagen" / "DATA.md", *sorted((ROOT / "docs").rglob("*.md")))
GENERATED = ("_build", "api", "commands", "settings")

_BLOCK = re.compile(r"^```sh\n(.*?)^```", re.DOTALL | re.MULTILINE)


def shown() -> list[tuple[str, str]]:
    """Page and line of each command in a block of shell, comments taken off."""
    found = []
    for page in PAGES:
        if page.parent.name not in GENERATED and page.parent.parent.name not in GENERATED:
            text = page.read_text(encoding="utf-8").replace("\\\n", " ")  # lines that go on
            lines = (line for block in _BLOCK.findall(text) for line in block.splitlines())
            found += [
                (str(page.relative_to(ROOT)), line) for line in lines if re.match(r"(\.venv/bin/)?indexer ", line)
            ]
    return found


@cache
def known(verb: str) -> set[str]:
    """Keys of a verb, and the sections and groups above them."""
    keys = keys_of(verb)
    return {".".join(key.split(".")[:depth]) for key in keys for depth in range(1, key.count(".") + 2)}


@pytest.mark.parametrize(("page", "line"), shown())
def test_a_command_has_a_verb_and_keys_that_exist(page: str, line: str) -> None:
    verb, *words = shlex.split(line, comments=True)[1:]
    assert verb in VERBS or verb.startswith("--"), page
    # Signs that the command line's grammar does not take must be in quotes.
    OverridesParser.create().parse_overrides([word for word in words if "=" in word])
    for word in words:
        key, sign, _ = word.partition("=")
        if sign and not re.match(r"[+~]|hydra", key):
            # A group that is not the default has keys of its own; they are checked where it is composed.
            assert key in known(verb) or key.split(".")[0] in {"campaign", "trainer", "machine"}, f"{page}: {word}"


def test_there_are_commands_on_pages() -> None:
    assert len(shown()) > 60
