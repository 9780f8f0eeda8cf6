"""The reference of the commands and their settings, from what stands in conf/ beside the keys themselves.

`commands()` has a page a verb, `settings()` a page a folder of conf/, with each of its files. A range is that of the
check which refuses a value outside of it (`ranges`), so it cannot differ from the code.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import ranges

from indexer_cli.manual import MUST_BE_GIVEN
from indexer_cli.verbs import VERBS, config_folder
from indexer_cli.yaml_keys import Key, Page, read_page

_HEADINGS = ("Reads:", "Writes:", "Examples:")
_SHARED = ("_self_", "command")

GROUPS = {
    "machine": "The machine",
    "operating_point": "What the machine is asked to do",
    "sensor": "The measuring chain",
    "campaign": "Campaigns: which records a data set has",
    "features": "What the network sees of a record",
    "net": "The network",
    "trainer": "Training rules",
    "faults_law": "Faults of an episode of the environment",
    "diagnosis": "The task of the environment of active diagnosis",
    "size": "How much the study of the paper's claims does",
}
"""Folders of conf/ in reading order, with their titles."""


def commands() -> dict[str, str]:
    """File name -> page: one a verb, and the list of all."""
    found = {f"{name}.md": _verb(name) for name in VERBS}
    lines = [
        "# Commands",
        "",
        "`indexer VERB KEY=VALUE ...`; `indexer VERB --help` prints the same as these pages.",
        "",
    ]
    for group, verbs in itertools.groupby(VERBS.values(), key=lambda verb: verb.group):
        lines += [f"## {group}", "", "| verb | what it does |", "| --- | --- |"]
        lines += [f"| [`{verb.name}`]({verb.name}.md) | {_cell(_page(verb.name).summary)} |" for verb in verbs]
        lines += [""]
    lines += [
        "## Every verb",
        "",
        "| | |",
        "| --- | --- |",
        "| `-m` | where there is an `out`: once for each combination, `KEY=A,B,C`; `OUT/sweep.csv` lists jobs |",
        "| `--help` | the verb's page |",
        "| `--version` | the version |",
        "| `--completion` | how the shell completes verbs, keys and names |",
        "| exit code 0 | done |",
        "| exit code 1 | done, and what was looked at is not as it should be |",
        "| exit code 2 | an input is wrong; one line says which |",
        "| exit code 130 | stopped from the keyboard |",
        "",
        _toctree(VERBS),
    ]
    return found | {"index.md": "\n".join(lines)}


def settings() -> dict[str, str]:
    """File name -> page: one a folder of conf/, and the list of all."""
    folder = config_folder()
    found = {f"{group}.md": _group(folder / group, title) for group, title in GROUPS.items()}
    lines = [
        "# Settings",
        "",
        "Every key of every YAML file in `conf/`, with its default, unit, range and reason. The keys of a verb itself",
        "stand on [its page](../commands/index.md). `KEY=VALUE` on the command line changes any of them, `GROUP=NAME`",
        "takes another file of the folder, `GROUP=FILE.yaml` one of your own.",
        "",
        "| folder | what | files |",
        "| --- | --- | --- |",
    ]
    for group, title in GROUPS.items():
        names = ", ".join(f"`{path.stem}`" for path in sorted((folder / group).glob("*.yaml")))
        lines.append(f"| [`{group}`]({group}.md) | {title} | {names} |")
    return found | {"index.md": "\n".join([*lines, "", _toctree(GROUPS)])}


def _toctree(names: Iterable[str]) -> str:
    return "\n".join(["```{toctree}", ":hidden:", "", *names, "```", ""])


def _page(name: str) -> Page:
    return read_page(config_folder() / f"{name}.yaml")


def _verb(name: str) -> str:
    page = _page(name)
    needed = [f"{key.name}=..." for key in page.keys if key.default == MUST_BE_GIVEN]
    lines = [f"# indexer {name}", "", *_prose(page.header), "## Keys", ""]
    lines += ["```sh", " ".join(["indexer", name, *needed, "[KEY=VALUE ...]"]), "```", ""]
    lines += _table(page.keys, name)
    for include in page.includes:
        if include not in _SHARED:
            taken = _page(include)
            lines += [*_prose([line for line in taken.header if not line.startswith("@")]), *_table(taken.keys, name)]
    groups = [choice for choice in page.choices if not choice.name.startswith("override ")]
    if groups:
        lines += ["## Groups", "", "| group | default | meaning |", "| --- | --- | --- |"]
        for choice in groups:
            link = f"[`{choice.name}`](../settings/{choice.name}.md)" if choice.name in GROUPS else f"`{choice.name}`"
            lines.append(f"| {link} | {_code(choice.default)} | {_cell(choice.meaning)} |")
    return "\n".join([*lines, ""])


def _group(folder: Path, title: str) -> str:
    lines = [f"# {title}", "", f"Files of `conf/{folder.name}/`; `{folder.name}=NAME` takes one of them.", ""]
    for path in sorted(folder.glob("*.yaml")):
        page = read_page(path)
        lines += [f"## {folder.name}={path.stem}", "", *_prose(page.header), *_table(page.keys, folder.name)]
    return "\n".join(lines)


def _prose(header: Iterable[str]) -> Iterator[str]:
    """The comment above the keys as paragraphs, what is read and written as a list, examples as a block."""
    for filled, block in itertools.groupby(header, key=bool):
        if not filled:
            yield ""
            continue
        code = False
        for line in block:
            if line.startswith("    "):
                if not code:
                    yield from ("", "```sh")
                code = True
                yield line.strip()
                continue
            if code:
                yield "```"
                code = False
            heading = next((heading for heading in _HEADINGS if line.startswith(heading)), "")
            yield f"\n**{heading[:-1]}**{_text(line.removeprefix(heading))}" if heading else _text(line)
        if code:
            yield "```"
    yield ""


def _table(keys: Iterable[Key], owner: str) -> Iterator[str]:
    yield from ("| key | default | range | unit and meaning |", "| --- | --- | --- | --- |")
    for key in keys:
        if key.default is None:
            yield f"| **`{key.name}.`** | | | {_cell(key.meaning)} |"
            continue
        default = "must be given" if key.default == MUST_BE_GIVEN else _code(key.default)
        yield f"| `{key.name}` | {default} | {_cell(ranges.of(owner, key.name))} | {_cell(key.meaning)} |"
    yield ""


def _code(text: str | None) -> str:
    return f"`{text.replace('|', chr(92) + '|')}`" if text else ""


def _cell(text: str) -> str:
    return _text(text).replace("|", "\\|")


def _text(text: str) -> str:
    """Plain text: signs that Markdown would take for marks are escaped outside code; pages become links."""
    parts = text.split("`")
    parts[::2] = [part.translate({ord(sign): f"\\{sign}" for sign in "*_<[~$"}) for part in parts[::2]]
    return re.sub(r"docs/([\w\\/-]+)\.md", _link, "`".join(parts))


def _link(page: re.Match[str]) -> str:
    path = page[1].replace("\\", "")
    return f"[{path.rpartition('/')[2]}](../../{path}.md)"
