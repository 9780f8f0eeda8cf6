"""What README shows runs as it stands, and the pages of the front door agree with the project."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
(SNIPPET,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
PAGES = sorted(
    path
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "benchmarks" / "README.md")
    if "_build" not in path.parts and path.parent.name not in ("api", "commands", "settings")
)


def test_the_snippet_runs():
    names: dict = {}
    exec(compile(SNIPPET, str(README), "exec"), names)  # the text of our own README
    assert names["record"].shape == (8200,) and names["record"].std() > 9.0


def test_it_is_short():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_that_a_page_links_to_exists(page):
    linked = re.findall(r"\]\((?!https?:|mailto:|#)([^)#\s]+)", page.read_text(encoding="utf-8"))
    generated = ("docs/reference/api", "docs/reference/commands", "docs/reference/settings")
    targets = [(page.parent / name).resolve() for name in linked]
    missing = [path for path in targets if not path.exists() and not any(part in str(path) for part in generated)]
    assert missing == []


def test_every_file_that_it_names_exists():
    named = re.findall(r"`((?:docs|datagen|conf|benchmarks|examples)/[\w./]+)`", README.read_text(encoding="utf-8"))
    assert [name for name in named if not (ROOT / name).exists() and name != "docs/_build"] == []


def test_the_version_stands_in_one_place_and_its_citation():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == version
    assert citation["license"] == "MIT" and citation["cff-version"] == "1.2.0"
    others = [
        path
        for path in ROOT.rglob("*.py")
        if ".venv" not in path.parts and re.search(rf"[\"']{re.escape(version)}[\"']", path.read_text(encoding="utf-8"))
    ]
    assert others == []
