"""Writes llms.txt beside the site (llmstxt.org): every page with its title and first sentence, under its kind."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

KINDS = {
    "tutorials": "Tutorials",
    "how-to": "How-to guides",
    "reference": "Reference",
    "explanation": "Explanation",
    "design-log": "Optional",
}
"""First folder of a page -> heading of its list; what is optional may be skipped where there is little room."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("build-finished", _write)
    return {"parallel_read_safe": True}


def _write(app: Sphinx, exception: Exception | None) -> None:
    if exception is None and app.builder.name == "html":
        (Path(app.outdir) / "llms.txt").write_text("\n".join(_lines(app)), encoding="utf-8")


def _lines(app: Sphinx) -> Iterator[str]:
    yield from (f"# {app.config.project}", "", f"> {app.config.html_short_title}")
    for folder, heading in KINDS.items():
        yield from ("", f"## {heading}", "")
        for page in sorted(app.env.all_docs):
            # Pages of the API are directives alone; their text is in the HTML, which its index leads to.
            if page.startswith(f"{folder}/") and (not page.startswith("reference/api/") or page.endswith("index")):
                sentence = first_sentence(Path(app.env.doc2path(page)).read_text(encoding="utf-8"))
                yield f"- [{app.env.titles[page].astext()}](_sources/{page}.md.txt){sentence and ': '}{sentence}"
    yield ""


def first_sentence(source: str) -> str:
    """Of the first paragraph below the title of a page in Markdown, without its marks; "" where it begins otherwise."""
    paragraphs = re.split(r"\n{2,}", source)
    found = next((text for text in paragraphs if re.match(r"[A-Za-z`\[]", text) and not text.startswith("```")), "")
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(found.split()))
    return re.split(r"(?<=[.:]) (?=[A-Z])", plain)[0]
