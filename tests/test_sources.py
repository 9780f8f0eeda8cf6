"""What the project cites, its readers have."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

from indexer_env.motion_law import MOTION_LAWS

ROOT = Path(__file__).parents[1]
PACKAGES = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["root_packages"]
PARTS = (*PACKAGES, "conf", "docs", "benchmarks", "examples", "tests")
TEXTS = sorted(
    path
    for path in (*ROOT.glob("*"), *(path for part in PARTS for path in (ROOT / part).rglob("*")))
    if path.suffix in (".py", ".md", ".yaml", ".toml", ".txt", ".j2", ".html") and path.is_file()
)


@pytest.mark.parametrize("name", ["design" + ".md", "paper" + ".txt"])
def test_no_file_names_what_readers_do_not_have(name):
    assert len(TEXTS) > 500
    assert [str(path) for path in TEXTS if name in path.read_text(encoding="utf-8")] == []


def test_every_section_of_the_physics_page_that_is_cited_is_there():
    page = (ROOT / "docs" / "explanation" / "physics.md").read_text(encoding="utf-8")
    sections = set(re.findall(r"^##+ (.+)$", page, re.MULTILINE))
    cited: set[str] = set()
    for path in TEXTS:
        text = path.read_text(encoding="utf-8")
        for words in re.findall(r"docs/explanation/physics\.md, sections? ([A-Z][A-Za-z ]*)", text):
            cited |= {name.strip() for name in words.split(" and ")}
    assert {"Joints", "The machine", "Motion laws"} <= cited <= sections


def test_the_peaks_on_the_physics_page_are_those_of_the_laws():
    page = (ROOT / "docs" / "explanation" / "physics.md").read_text(encoding="utf-8")
    row = r"^\| `(\w+)`(?: \(default\))? \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| −([\d.]+) \|$"
    rows = re.findall(row, page, re.MULTILINE)
    assert {name for name, *_ in rows} == set(MOTION_LAWS) - {"table"}
    for name, *numbers in rows:
        peaks = MOTION_LAWS[name]().peaks()
        found = (peaks.velocity, peaks.acceleration, peaks.jerk, -peaks.jerk_at_midpoint)
        assert numbers == [f"{value:.{digits}f}" for value, digits in zip(found, (4, 4, 2, 2), strict=True)]


def test_the_map_of_every_package_shows_all_its_modules():
    maps = sorted(init for name in PACKAGES for init in (ROOT / name).rglob("__init__.py"))
    assert len(maps) > 30
    missing = {}
    for init in maps:
        shown = set(re.findall(r"\w+", ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or ""))
        modules = {path.stem for path in init.parent.glob("*.py") if not path.stem.startswith("__")}
        packages = {path.parent.name for path in init.parent.glob("*/__init__.py")}
        if unseen := (modules | packages) - shown:
            missing[str(init.parent.relative_to(ROOT))] = sorted(unseen)
    assert missing == {}
