"""A standstill that dry friction may hold tells nothing: neither of the noise nor of what is missing. Seed 1."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.windows import split
from discrepancy.explain import explain
from discrepancy.model import Hypothesis
from discrepancy.subjects.base import Subject
from indexer_env.errors import SignalError
from tests.discrepancy.drives.made import FILE, drive, start_of

DRY = f"{FILE}\ncutoff = 12.0\nknown = {{'friction.coulomb': {{'force': 25.0}}}}\neffects = ('friction.quadratic',)\n"


def _moves(pause: float, behind: float = 0.0, drag: float = 0.0, moves: int = 8) -> Record:
    """Moves of 2 s by 0.3 m and back at 200 Hz with a pause before each, and a standstill behind them."""
    rate = 200.0
    x = np.clip((np.arange(round((2.0 + pause) * rate)) / rate - pause) / 2.0, 0.0, 1.0)
    one = 0.3 * np.stack([10 * x**3 - 15 * x**4 + 6 * x**5, (30 * x**2 - 60 * x**3 + 30 * x**4) / 2.0,
                          (60 * x - 180 * x**2 + 120 * x**3) / 4.0])  # fmt: skip
    there_and_back = [one, np.array([[0.3], [0.0], [0.0]]) - one]
    rows = [there_and_back[k % 2] for k in range(moves)]
    rows.append(np.tile([[0.0], [0.0], [0.0]], round(behind * rate)))
    q, v, a = np.concatenate(rows, axis=1)
    noise = np.random.default_rng(1).standard_normal((2, len(q)))
    force = 90.0 * a + 25.0 * np.sign(v) + drag * np.abs(v) * v + noise[0]
    return Record("a.csv", rate, {"q": q + 1e-6 * noise[1], "force": force}, {"q": "m", "force": "N"})


def _made(folder: Path, record: Record, *more: Record, text: str = DRY) -> Subject:
    return subject_of(drive(folder, text), [record, *more])


@pytest.mark.parametrize("known", [True, False])
def test_a_longer_standstill_leaves_the_level_as_it_is(known: bool, tmp_path: Path) -> None:
    """Whether the dry friction is known or found."""

    def level(pause: float) -> float:
        made = _made(tmp_path, _moves(pause), text=DRY if known else f"{FILE}\ncutoff = 12.0\n")
        found: list[Hypothesis] = [] if known else [made.model.hypotheses()["friction.coulomb"][0]]
        problem, place = start_of(made, *found)
        if found:
            z = np.array([0.0, *found[0].coordinates([25.0])])
            place = problem.point(z, place.states)
        return place.level(made.model)

    assert level(18.0) == pytest.approx(level(0.5), rel=0.15)


def test_what_is_held_out_moves_where_a_recording_was_stopped_late(tmp_path: Path) -> None:
    """16 s of moves and 16 s of rest: the drag is found in the third of the moves that is held out."""
    made = _made(tmp_path, _moves(0.0, behind=16.0, drag=150.0))
    answer = explain(made.model, made.held_out)
    assert answer.names == ("friction.quadratic",) and 0.7 < answer.after < 1.3
    assert "Of a.csv it is the last part of the time in which it moves, as it stands long." in made.notes
    assert not any("stands long" in note for note in _made(tmp_path, _moves(0.0)).notes)


def test_records_are_cut_by_their_motion_only_where_it_is_uneven() -> None:
    def parts(moving: np.ndarray) -> tuple[tuple[int, int], tuple[int, int]]:
        found = split([300], [False], 1.0 / 3.0, [20], moving=[moving])[:2]
        ends = [(int(w.first[0]), int(w.first[-1] + w.count[-1])) for w in found]
        return ends[0], ends[1]

    at = np.arange(300)
    assert parts(at % 3 > 0) == parts(np.zeros(300, dtype=bool)) == ((0, 200), (200, 300))
    assert parts(at < 180) == ((0, 120), (120, 180))
    assert parts(at >= 210) == ((0, 270), (270, 300))


def test_records_held_out_that_stand_throughout_are_refused(tmp_path: Path) -> None:
    still = _moves(0.0)
    rows = {"q": np.full(3200, 0.1) + 1e-6 * np.random.default_rng(1).standard_normal(3200),
            "force": np.random.default_rng(2).standard_normal(3200)}  # fmt: skip
    still = dataclasses.replace(still, name="still.csv", rows=rows, held_out=True)
    with pytest.raises(SignalError, match=r"still\.csv: what is held out must move, .* choose other records"):
        _made(tmp_path, _moves(0.0), still)
