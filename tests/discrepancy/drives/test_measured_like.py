"""Drives as they are measured: slow sampling, closed loop, a screw with play that runs dry, sensors that drift."""

from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.explain import Explanation, explain
from tests.discrepancy.drives.by_scipy import driven, path
from tests.discrepancy.drives.made import drive

pytestmark = pytest.mark.slow

FILE = """
parameters = {{"mass": ({mass}, "kg", {mass_off}), "drag": (50.0, "N s/m", 25.0)}}
channels = {{"time": "t", "q": "q", "force": "f"}}
known = {known}


def force(q, v, a, u, t, p):
    return p.mass * a + p.drag * v
"""


def _answer(folder: Path, records: list[Record], mass: float, known: str = "{}") -> Explanation:
    made = subject_of(drive(folder, FILE.format(mass=mass, mass_off=0.12 * mass, known=known)), records)
    return explain(made.model, made.held_out, forms=made.forms())


def _named(answer: Explanation) -> dict[str, dict[str, float]]:
    return {
        f.name: {p.name: p.value for p in f.effects[0].parameters}
        for f in answer.findings
        if f.grade in ("established", "family")
    }


def test_stribeck_friction_at_25_hz(tmp_path: Path) -> None:
    """30 N, and 25 N more that halve at 20 mm/s; noise of 0.3 N. Seeds 1, 10 and 11."""

    def level(t: float, v: float) -> float:
        return 30.0 + 25.0 / (1.0 + (v / 0.02) ** 2)

    records = [
        driven(path(60.0, 0.3, (0.03, 0.08, 0.2), 10 + k), 25.0, 60.0, level, drag=80.0, noise=0.3, seed=k,
               held_out=k == 1)
        for k in range(2)
    ]  # fmt: skip
    answer = _answer(tmp_path, records, 55.0)
    named = _named(answer)
    assert set(named) == {"friction.stribeck", "friction.coulomb"} and answer.remains.times_noise < 4.0
    assert named["friction.stribeck"]["force"] == pytest.approx(25.0, rel=0.1)
    assert named["friction.stribeck"]["speed"] == pytest.approx(0.02, rel=0.15)
    assert named["friction.coulomb"]["force"] == pytest.approx(30.0, rel=0.1)


def test_a_ball_screw_with_play_that_runs_dry(tmp_path: Path) -> None:
    """0.4 mm of play with 40 of 80 kg behind it; its friction of 20 N grows by 1 N/s. Seeds 4, 30 and 31."""
    records = [
        driven(path(12.0, 0.06, (0.13, 0.31, 0.7, 1.1), 30 + k), 1000.0, 40.0, lambda t, v: 20.0 + t, drag=60.0,
               load=(40.0, 4e-4, 25.0), noise=1.0, seed=4 + k, held_out=k == 1)
        for k in range(2)
    ]  # fmt: skip
    named = _named(_answer(tmp_path, records, 75.0, '{"friction.coulomb": {"force": 40.0}}'))
    assert set(named) == {"play.contact", "friction.time"}
    assert named["play.contact"]["play"] == pytest.approx(4e-4, rel=0.05)
    assert named["friction.time"]["rate"] == pytest.approx(1.0, rel=0.15)


def test_a_reading_that_drifts_by_no_law_takes_no_name_away(tmp_path: Path) -> None:
    """20 N of hidden dry friction; the amplifier wanders by 2 N within some ten seconds. Seeds 8, 40 and 41."""

    def wandering(t: np.ndarray) -> np.ndarray:
        return 2.0 * np.sin(0.31 * t + 0.5) * np.cos(0.13 * t)

    records = [
        driven(path(24.0, 0.2, (0.13, 0.31, 0.7), 40 + k), 250.0, 60.0, lambda t, v: 20.0, drag=60.0, read=wandering,
               noise=0.5, seed=8 + k, held_out=k == 1)
        for k in range(2)
    ]  # fmt: skip
    answer = _answer(tmp_path, records, 55.0)
    assert set(_named(answer)) <= {"friction.coulomb", "friction.coulomb or friction.presliding"} and answer.names
    assert _named(answer)[answer.findings[0].name]["force"] == pytest.approx(20.0, rel=0.05)
    assert answer.remains.times_noise > 2.0, "and what wanders is said to remain"
