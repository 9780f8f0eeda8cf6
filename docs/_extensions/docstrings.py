"""Docstrings as reStructuredText: what is laid out in columns, or means something else there, keeps its look."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_COLUMNS = re.compile(r"\S {2,}\S")
_PAGE = re.compile(r"docs/([\w-]+/(?:[\w-]+/)*)([\w-]+)\.md")
_SECTIONS = ("Attributes", "Parameters", "Returns", "Yields", "Raises", "Notes", "Examples", "See Also", "Warns")
"""Headings that napoleon knows; any other would be a heading of the whole page."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx; before napoleon, which reads sections."""
    app.connect("autodoc-process-docstring", _process, priority=100)
    return {"parallel_read_safe": True}


def _process(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    lines[:] = as_rst(lines)


def as_rst(lines: list[str]) -> list[str]:
    """Paragraphs with columns become literal blocks, headings of one's own become rubrics; signs of mathematics that
    are marks in reStructuredText are escaped."""
    lines = _without_headings(lines)
    found: list[str] = []
    paragraph: list[str] = []
    literal = False
    for line in [*lines, ""]:
        if line.strip():
            paragraph.append(line)
            continue
        if paragraph:
            inside = literal and paragraph[0].startswith(" ")
            literal = inside or (literal and not paragraph[0].strip())
            found += paragraph if inside else _paragraph(paragraph)
            literal = literal or paragraph[-1].rstrip().endswith("::")
            paragraph = []
        found.append("")
    return found


def _without_headings(lines: list[str]) -> list[str]:
    found: list[str] = []
    for line in lines:
        if re.fullmatch(r"-{3,}", line) and found and found[-1] not in _SECTIONS:
            found[-1:] = [f".. rubric:: {found[-1]}", ""]
        else:
            found.append(line)
    return found


def _paragraph(lines: list[str]) -> list[str]:
    if any(_COLUMNS.search(line) for line in lines) and not _underlined(lines):
        return ["::", "", *(f"    {line}" for line in lines)]
    return [_escaped(line) for line in lines]


def _underlined(lines: list[str]) -> bool:
    return any(re.fullmatch(r"\s*-{3,}", line) for line in lines)


def _escaped(line: str) -> str:
    """|φ̇| and *args outside code; pages become links."""
    parts = re.split(r"(`+[^`]*`+)", line)
    parts = [part if part.startswith("`") else re.sub(r"([|*])", r"\\\1", part) for part in parts]
    return "".join(part if part.startswith("`") else _PAGE.sub(r":doc:`\2 </\1\2>`", part) for part in parts)
