"""A file of conf/ as a reader of it sees it: the text above its keys, and each key with its default and the comment
beside it. A YAML library would drop the comments, and its import alone takes as long as all of a help page."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_KEY = re.compile(r"(?P<indent> *)(?P<dash>- )?(?P<key>[\w./@ -]+?):(?: +(?P<value>.*))?$")


@dataclass(frozen=True)
class Key:
    """A key of a configuration.

    Attributes
    ----------
    name : str
        Dotted, as typed on the command line.
    default : str or None
        Its value as written; None for a section, which holds keys of its own.
    meaning : str
        The comment beside it: unit and meaning.
    """

    name: str
    default: str | None
    meaning: str


@dataclass(frozen=True)
class Page:
    """A file of conf/.

    Attributes
    ----------
    header : tuple of str
        Lines of the comment above the first key; the first is the summary.
    choices : tuple of Key
        Entries of its list of defaults that choose a file of a group: name of the group, the choice, its comment.
    includes : tuple of str
        Other files of conf/ whose keys it takes over.
    keys : tuple of Key
        Sections and keys in their order.
    """

    header: tuple[str, ...]
    choices: tuple[Key, ...]
    includes: tuple[str, ...]
    keys: tuple[Key, ...]

    @property
    def summary(self) -> str:
        """First line of the header, in which a comment for Hydra does not count."""
        return next((line for line in self.header if line and not line.startswith("@package")), "")


def read_page(path: Path) -> Page:
    """Read a file of conf/."""
    header: list[str] = []
    choices: list[Key] = []
    includes: list[str] = []
    keys: list[Key] = []
    sections: list[tuple[int, str]] = []
    comment_column, current = -1, keys
    for line in path.read_text(encoding="utf-8").splitlines():
        content, comment, column = _split(line)
        if not content.strip():
            if not keys and not choices and not includes and comment is not None:
                header.append(comment)
            elif comment is not None and column == comment_column and current:
                last = current[-1]
                current[-1] = Key(last.name, last.default, f"{last.meaning} {comment.strip()}".strip())
            continue
        comment_column = column
        if content.lstrip().startswith("- ") and ":" not in content:
            includes.append(content.strip().removeprefix("- "))
            continue
        found = _KEY.match(content.rstrip())
        if found is None:
            raise ValueError(f"{path} must hold one key a line, got {line!r}.")
        value, meaning = (found["value"] or "").strip() or None, (comment or "").strip()
        if found["dash"]:
            current = choices
            choices.append(Key(found["key"], value, meaning))
            continue
        current, indent = keys, len(found["indent"])
        sections = [(depth, name) for depth, name in sections if depth < indent]
        name = ".".join([*(name for _, name in sections), found["key"]])
        if value is None:
            sections.append((indent, found["key"]))
        keys.append(Key(name, value, meaning))
    shown = (key for key in keys if key.name != "defaults")
    return Page(tuple(header), tuple(choices), tuple(includes), tuple(shown))


def _split(line: str) -> tuple[str, str | None, int]:
    """What stands before a comment, the comment without its sign or None, and the column of the sign."""
    quote = ""
    for column, sign in enumerate(line):
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'":
            quote = sign
        elif sign == "#" and (column == 0 or line[column - 1] == " "):
            return line[:column], line[column + 1 :].removeprefix(" ").rstrip(), column
    return line, None, -1
