"""`python -m benchmarks peers --only SOLVER`: what is measured anew, what stays, and what is refused."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import __main__ as command
from benchmarks import picture, report, session, work_precision
from benchmarks.work_precision import Point

THEN, NOW = ({"processor": "p", "cores": "2", "versions": "v", "date": day, "load": "1"} for day in ("then", "now"))
STORED = [Point("quick", "a", 1e-6, 0.5), Point("slow", "b", 1e-7, 4.0)]


def sweep(judged: int, batch: int) -> Iterator[work_precision.Setting]:
    yield "c", lambda truth: np.array([1e-8]), lambda: 0.25


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Results of then in a folder of their own, and solvers that need no time."""
    monkeypatch.setattr(work_precision, "SWEEPS", tuple((name, None, sweep) for name in ("quick", "slow")))
    monkeypatch.setattr(work_precision, "reference_records", lambda *given, **more: np.zeros((1, 1)))
    monkeypatch.setattr(session, "keep_to_cores", lambda: None)
    monkeypatch.setattr(session, "description", lambda: NOW)
    monkeypatch.setattr(picture, "draw", lambda points: None)
    monkeypatch.setattr(report, "RESULTS", tmp_path / "results.json")
    monkeypatch.setattr(report, "README", tmp_path / "README.md")
    monkeypatch.setattr(command, "POINTS", tmp_path / "work_precision.json")
    report.README.write_text(f"{report.BEGIN}\n{report.END}\n")
    command.POINTS.write_text(json.dumps([vars(point) for point in STORED]))
    rows = [report.Row(f"turns/s at an error ≤ 1e-05: {name}", "", "1") for name in ("quick", "slow")]
    report.store("peers", rows, THEN)
    return tmp_path


def run(monkeypatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["benchmarks", *arguments])
    command.main()


def held(folder) -> dict[str, Any]:
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_a_part_is_measured_anew_and_the_rest_keeps_its_session(folder, monkeypatch):
    run(monkeypatch, "peers", "--only", "quick")
    section = json.loads(report.RESULTS.read_text())["peers"]
    quick, slow = section["rows"]
    assert section["session"] == THEN and "session" not in slow and slow["measured"] == "1"
    assert quick["session"] == NOW and quick["measured"].startswith("4 (c")
    points = [Point(**point) for point in json.loads(command.POINTS.read_text())]
    assert points == [Point("quick", "c", 1e-8, 0.25), STORED[1]]
    told = report.README.read_text().splitlines()
    assert told[1].startswith("- peers: then, p") and told[2].startswith(f"- of peers, {quick['what']}: now, p")


def test_a_whole_run_is_of_one_session_again(folder, monkeypatch):
    run(monkeypatch, "peers", "--only", "quick")
    run(monkeypatch, "peers")
    section = json.loads(report.RESULTS.read_text())["peers"]
    assert section["session"] == NOW and all("session" not in row for row in section["rows"])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("peers", "--only", "quik"), "benchmarks.only must be some of 'quick', 'slow', got 'quik'."),
        (("peers", "--only", "slow", "nowhere"), "must be solvers that are installed, got 'nowhere'; pip install nix."),
        (("speed", "--only", "quick"), "--only is for the section peers, not for speed."),
        (("--only", "quick"), "--only is for the section peers, not for all."),
    ],
)
def test_only_is_refused_where_it_would_measure_nothing(folder, monkeypatch, capsys, arguments, sentence):
    if "nowhere" in arguments:
        monkeypatch.setattr(work_precision, "SWEEPS", (*work_precision.SWEEPS, ("nowhere", "nix", sweep)))
        monkeypatch.setattr(work_precision, "peers", SimpleNamespace(DISTRIBUTIONS={"nix": "nix"}))
    before = held(folder)
    monkeypatch.setattr(command, "_measure", lambda *given, **more: [])
    with pytest.raises(SystemExit) as stopped:
        run(monkeypatch, *arguments)
    assert stopped.value.code == 2 and sentence in capsys.readouterr().err and held(folder) == before
