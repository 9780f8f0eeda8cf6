"""The first use of docs/discrepancy.md runs as written, on shorter records."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "discrepancy.md").read_text(encoding="utf-8")
TURNS = "1.0"


def commands() -> list[str]:
    section = PAGE.partition("## First use")[2]
    return re.findall(r"```sh\n(.*?)```", section, flags=re.DOTALL)[0].splitlines()


def test_the_page_shows_the_keys_of_the_report() -> None:
    from discrepancy.report.content import content

    source = Path(content.__code__.co_filename).read_text(encoding="utf-8")
    shown = re.findall(r"^ {8}\"(\w+)\": ", source.partition("whole = {")[2].partition("return")[0], flags=re.MULTILINE)
    table = PAGE.partition("## Report")[2].partition("## ")[0]
    assert len(shown) > 12
    assert [key for key in shown if f"`{key}`" not in table] == []


@pytest.mark.slow
def test_a_newcomer_gets_from_csv_files_to_the_extended_machine(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    lines = commands()
    assert len(lines) == 4 and "hidden_effect.py" in lines[0]
    lines[0] += f" {TURNS}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for line in lines:
        command = [sys.executable if part == ".venv/bin/python" else part for part in shlex.split(line)]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stderr}"
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    (effect,) = report["effects"]
    assert (report["verdict"], effect["name"], effect["choices"]) == ("named", "cam.station_spacing", {"station": 3})
    assert report["gap"]["closed_share"] > 0.8
    assert {"2", "3"} <= {one["cell"] for one in report["where"] if one["axis"] == "station"}
    again = json.loads((tmp_path / "again" / "report.json").read_text())
    assert (again["verdict"], again["effects"]) == ("none", [])
    assert (tmp_path / "data" / "extended" / "manifest.json").is_file()
