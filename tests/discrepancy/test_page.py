"""docs/how-to/explain.md, docs/explanation/discrepancy.md say what the code does; the first use, on shorter records."""

import dataclasses
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from discrepancy import Criteria
from discrepancy.explain import VERDICTS
from discrepancy.grades import RULES

ROOT = Path(__file__).parents[2]
PAGES = ("how-to/explain.md", "explanation/discrepancy.md")
PAGE = "\n".join((ROOT / "docs" / name).read_text(encoding="utf-8") for name in PAGES)
TURNS = "1.0"


def section(title: str) -> str:
    return PAGE.partition(f"## {title}")[2].partition("\n## ")[0]


def test_the_page_shows_the_keys_of_the_report() -> None:
    from discrepancy.report.content import content

    source = Path(content.__code__.co_filename).read_text(encoding="utf-8")
    shown = re.findall(r"^ {8}\"(\w+)\": ", source.partition("whole = {")[2].partition("return")[0], flags=re.MULTILINE)
    assert len(shown) > 18
    assert [key for key in shown if f"`{key}`" not in section("What comes out")] == []


def test_the_page_shows_every_number_that_decides() -> None:
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]+?) \|", section("The search"), flags=re.MULTILINE))
    expected = {
        name: "none" if value is None else f"{value:g}" for name, value in dataclasses.asdict(Criteria()).items()
    }
    assert rows == expected


def test_the_page_shows_the_rules_in_their_order_and_the_verdicts() -> None:
    rows = re.findall(
        r"^\| ([^|`]+?) \| (established|family|stands in|dismissed) \|", section("What comes out"), flags=re.M
    )
    assert rows == [(rule.name, rule.grade) for rule in RULES]
    assert re.findall(
        r"^\| `([a-z ]+)` \| [a-z]", section("What comes out").partition("Each finding")[0], flags=re.M
    ) == [*VERDICTS]


@pytest.mark.slow
def test_a_newcomer_gets_from_csv_files_to_the_machine_with_what_was_found(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    lines = re.findall(r"```sh\n(.*?)```", section("First use"), flags=re.DOTALL)[0].splitlines()
    assert len(lines) == 4 and "hidden_effect.py" in lines[0]
    lines[0] += f" {TURNS}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for line in lines:
        program, *arguments = shlex.split(line)
        command = [Path(sys.executable).with_name(program), *arguments]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stderr}"
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    (finding,) = report["findings"]
    (effect,) = report["effects"]
    assert (report["verdict"], finding["grade"]) == ("found", "established")
    assert (effect["name"], effect["choices"]) == ("cam.station_spacing", {"station": 3})
    assert report["gap"]["closed_share"] > 0.8
    assert {"2", "3"} <= {one["cell"] for one in report["where"] if one["axis"] == "station"}
    assert sorted(file.name for file in (tmp_path / "report").iterdir()) == [
        "machine.yaml", "report.html", "report.json", "sensor.yaml",
    ]  # fmt: skip
    again = json.loads((tmp_path / "again" / "report.json").read_text())
    assert (again["verdict"], again["effects"]) == ("nothing missing", [])
    assert (tmp_path / "data" / "extended" / "manifest.json").is_file()
