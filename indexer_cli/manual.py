"""The list of verbs and the help page of each, made from what stands in conf/."""

from __future__ import annotations

import itertools
import shutil
import textwrap
from collections.abc import Iterable, Iterator
from pathlib import Path

from indexer_cli.verbs import VERBS, can_sweep, config_folder
from indexer_cli.yaml_keys import Key, Page, read_page

MUST_BE_GIVEN = "???"
"""A default that is none, as Hydra writes it."""

_HEADINGS = ("Reads:", "Writes:", "Examples:")


def overview(version: str) -> str:
    """All verbs, one line each."""
    lines = [f"indexer {version}: simulate, measure and diagnose cam indexing machines."]
    lines += ["", "indexer VERB KEY=VALUE ..."]
    widest = max(map(len, VERBS))
    for group, verbs in itertools.groupby(VERBS.values(), key=lambda verb: verb.group):
        lines += ["", group]
        lines += [f"  {verb.name:<{widest}}  {read_page(_path(verb.name)).summary}" for verb in verbs]
    lines += [
        "",
        "indexer VERB --help   what it does, what it reads and writes, every key, examples",
        "indexer --version     the version",
        "indexer --completion  how the shell completes verbs, keys and names",
    ]
    return "\n".join(lines)


def manual(name: str) -> str:
    """The help page of a verb."""
    folder, page, width = config_folder(), read_page(_path(name)), _width()
    needed = [f"{key.name}=..." for key in page.keys if key.default == MUST_BE_GIVEN]
    synopsis = " ".join([f"indexer {name}", *needed, "[KEY=VALUE ...]"])
    lines = ["NAME", f"    indexer {name}: {page.summary}", "", "SYNOPSIS", f"    {synopsis}", "", "DESCRIPTION"]
    lines += _text(page, width)
    lines += ["KEYS"]
    keys = (*page.keys, *_taken_over(folder, page))
    lines += _keys(keys, width)
    for choice in _groups(page):
        lines += _group(folder, choice, width)
    sweep = "    -m      run once for each combination of values, KEY=A,B,C; OUT/sweep.csv lists jobs and results"
    lines += [
        "EVERY VERB",
        *([sweep] if can_sweep(name, [key.name for key in keys]) else []),
        "    --help  this page",
        "    HYDRA_FULL_ERROR=1 in the environment shows the traceback of an error",
        "",
        f"    `python -m {VERBS[name].module}` runs the verb, too.",
        "",
        "EXIT CODES",
        "    0    done",
        "    1    done, and what was looked at is not as it should be",
        "    2    an input is wrong; one line says which",
        "    130  stopped from the keyboard",
    ]
    return "\n".join(lines)


def choices_of(folder: Path, group: str) -> list[str]:
    """Names that a group offers."""
    return sorted(path.stem for path in (folder / group).glob("*.yaml"))


def keys_of(name: str) -> dict[str, list[str]]:
    """Every key of a verb as typed, with the names it can be given where it is a group."""
    folder, page = config_folder(), read_page(_path(name))
    keys = (*page.keys, *_taken_over(folder, page))
    found: dict[str, list[str]] = {key.name: [] for key in keys if key.default is not None}
    for choice in _groups(page):
        found[choice.name] = choices_of(folder, choice.name)
        chosen = read_page(folder / choice.name / f"{choice.default}.yaml")
        found |= {f"{choice.name}.{key.name}": [] for key in chosen.keys if key.default is not None}
    return found


def _path(name: str) -> Path:
    return config_folder() / f"{name}.yaml"


def _width() -> int:
    return max(60, min(120, shutil.get_terminal_size((100, 24)).columns))


def _groups(page: Page) -> Iterator[Key]:
    return (choice for choice in page.choices if not choice.name.startswith("override "))


def _taken_over(folder: Path, page: Page) -> Iterator[Key]:
    """Keys of the files that a page takes over, apart from Hydra's own settings."""
    for name in page.includes:
        if name not in ("_self_", "command"):
            yield from read_page(folder / f"{name}.yaml").keys


def _text(page: Page, width: int) -> Iterator[str]:
    """The header below its summary: paragraphs, what is read and written, examples."""
    body = itertools.dropwhile(lambda line: line != page.summary, page.header)
    for _, block in itertools.groupby(list(body)[1:], key=bool):
        lines = list(block)
        if not lines[0]:
            continue
        while lines:
            count = next((n for n, line in enumerate(lines[1:], 1) if line.startswith(_HEADINGS)), len(lines))
            yield from _paragraph(lines[:count], width)
            lines = lines[count:]
        yield ""


def _paragraph(lines: list[str], width: int) -> Iterator[str]:
    heading = next((heading for heading in _HEADINGS if lines[0].startswith(heading)), "")
    first = lines[0].removeprefix(heading).strip()
    if heading:
        yield f"  {heading[:-1]}"
    kept = [line for line in lines[1:] if line.startswith("    ")]
    prose = [first, *(line for line in lines[1:] if not line.startswith("    "))]
    if any(prose):
        yield from textwrap.wrap(" ".join(prose), width, initial_indent="    ", subsequent_indent="    ")
    yield from kept


def _keys(keys: Iterable[Key], width: int, owner: str = "") -> Iterator[str]:
    """Keys, each with its default on one line and what it means below it."""
    shown = [Key(f"{owner}{key.name}", key.default, key.meaning) for key in keys]
    for key in shown:
        if key.default is None:
            yield ""
            yield from _meaning(f"  {key.name}.: {key.meaning}" if key.meaning else f"  {key.name}.", width)
            continue
        default = " (must be given)" if key.default == MUST_BE_GIVEN else f"={key.default}"
        yield f"    {key.name}{default}"
        if key.meaning:
            yield from textwrap.wrap(key.meaning, width, initial_indent=" " * 8, subsequent_indent=" " * 8)
    yield ""


def _meaning(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, subsequent_indent="    ")


def _group(folder: Path, choice: Key, width: int) -> Iterator[str]:
    """A group: the names it offers, and the keys of the one that is the default."""
    yield f"  {choice.name}={choice.default}"
    if choice.meaning:
        yield from textwrap.wrap(choice.meaning, width, initial_indent="    ", subsequent_indent="    ")
    names = ", ".join([*choices_of(folder, choice.name), "or FILE.yaml"])
    yield from textwrap.wrap(f"One of {names}.", width, initial_indent="    ", subsequent_indent="    ")
    if choice.default != MUST_BE_GIVEN:
        yield from _keys(read_page(folder / choice.name / f"{choice.default}.yaml").keys, width, f"{choice.name}.")
    else:
        yield ""
