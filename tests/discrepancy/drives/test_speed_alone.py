"""A drive of which the speed alone is measured: its position is added up, and means another place in every record."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.effects import EFFECTS
from discrepancy.subjects.base import Subject
from tests.discrepancy.drives.made import FILE, drive, motion
from tests.discrepancy.drives.test_forward import FILE as PENDULUM

PLACED = {name for name, effect in EFFECTS.items() if effect.placed}


def _made(folder: Path, text: str, count: int) -> Subject:
    records = []
    for k in range(count):
        _, _, v, a = motion(shift=0.7 * k)
        rows = {"v": v, "force": 95.0 * a} if "def force" in text else {"v": v, "u": 0.05 * a}
        units = {"v": "rad/s", "force": "N m", "u": "N m"}
        records.append(Record(f"{k}.csv", 500.0, rows, {role: units[role] for role in rows}))
    return subject_of(drive(folder, text.replace('"q": "q"', '"v": "v"')), records)


@pytest.mark.parametrize("text", [FILE, PENDULUM], ids=["inverse", "forward"])
def test_the_position_is_said_to_be_added_up(text: str, tmp_path: Path) -> None:
    one, two = (_made(tmp_path, text, count) for count in (1, 2))
    said = "The position q is added up from the speed and is 0 at {} record's first sample{}."
    assert said.format("the", "") in one.notes
    assert said.format("each", ", so that effects over it are not looked for") in two.notes
    assert PLACED & set(one.model.hypotheses()) and not PLACED & set(two.model.hypotheses())
    assert {form.over for form in two.forms()} == {"speed [rad/s]"}


def test_effects_over_the_position_are_those_that_a_shift_of_it_changes(tmp_path: Path) -> None:
    model = subject_of(drive(tmp_path), [Record("a.csv", 500.0, _rows(), {"q": "rad", "force": "N m"})]).model
    (track,) = model.tracks
    shifted = dataclasses.replace(track, q=track.q + 0.37, name="shifted")
    for name, hypotheses in model.hypotheses().items():
        effect = EFFECTS[name]
        if effect.acts == "reading":
            continue
        start = hypotheses[0].starts[-1]
        rows = [np.asarray(model._term(m, effect, hypotheses[0], start, (90.0,))) for m in (track, shifted)]
        changed = float(np.abs(rows[1] - rows[0]).max()) > 1e-6 * max(float(np.abs(rows[0]).max()), 1e-12)
        assert changed == effect.placed, name


def _rows() -> dict[str, np.ndarray]:
    _, q, _, a = motion()
    return {"q": q, "force": 95.0 * a}
