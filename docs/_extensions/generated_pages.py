"""Writes the generated pages of the reference before Sphinx reads any: commands, settings and the API."""

from __future__ import annotations

from pathlib import Path

import api
import command_pages
from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("builder-inited", _write)
    return {"parallel_read_safe": True}


def _write(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "reference"
    for pages, name in (
        (command_pages.commands(), "commands"),
        (command_pages.settings(), "settings"),
        (api.pages(), "api"),
    ):
        refresh(folder / name, pages)


def refresh(folder: Path, pages: dict[str, str]) -> None:
    """Make `folder` hold these pages and no others; those that did not change are not written, nor read again."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.glob("*.md"):
        if path.name not in pages:
            path.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
