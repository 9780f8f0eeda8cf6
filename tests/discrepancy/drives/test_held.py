"""Commands that keep a sample's value until the next, and what they look like where that is not said."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.inverse import InverseModel
from discrepancy.model import NONE
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import FILE as MASS
from tests.discrepancy.drives.made import drive, run_plain, start_of
from tests.discrepancy.drives.test_forward import FILE, PUSH, RATE, made


@pytest.fixture(scope="module")
def held_truth() -> np.ndarray:
    """Angle of the pendulum, from sample to sample under what its command was at the first of the two."""
    states = [np.array([0.3, 0.0])]
    for push in PUSH[:-1]:

        def rates(t: float, y: np.ndarray, push: float = push) -> list[float]:
            return [y[1], (push - math.sin(y[0]) - 0.02 * y[1]) / 0.05]

        found = solve_ivp(rates, (0.0, 1.0 / RATE), states[-1], rtol=1e-10, atol=1e-12)
        states.append(found.y[:, -1])
    return np.array(states)[:, 0]


def test_a_command_that_is_held_acts_until_the_next_one(held_truth: np.ndarray, tmp_path: Path) -> None:
    off = {}
    for told in ("", "held = ('u',)\n"):
        model = made(tmp_path, held_truth, FILE + told).model
        off[told] = float(np.abs(run_plain(model, NONE, np.zeros(3), np.array([0.3, 0.0]))[0] - held_truth).max())
    assert off["held = ('u',)\n"] < 2e-6 < 1e-3 < off[""]


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("effect", ["delay", "loop_lag", "sensor.lowpass"])
def test_half_a_sample_is_said_to_look_like_a_command_that_is_held(
    effect: str, told: bool, held_truth: np.ndarray, tmp_path: Path
) -> None:
    subject = made(tmp_path, held_truth, FILE + "held = ('u',)\n" * told)
    one = subject.model.hypotheses()[effect][0]
    problem, _ = start_of(subject, one)
    places = [
        problem.point(
            np.concatenate([np.zeros(3), one.coordinates([samples / RATE])]), start_of(subject, one)[1].states
        )
        for samples in (0.52, 2.0)
    ]
    said = (
        f"{effect} 0.0026 s is half a sample: a command that is held between samples looks like this; if u is held, "
        "write held = ('u',) into my_drive.py."
    )
    assert subject.of_records(subject.model, places[0]) == (() if told else (said,))
    assert subject.of_records(subject.model, places[1]) == ()
    # a second input has no part in a delay
    subject.commands = ("u", "load")
    assert subject.of_records(subject.model, places[0]) == (() if told else (said,))


def test_a_force_that_is_held_acts_until_the_next_one(tmp_path: Path) -> None:
    """A mass of 90 kg under such a force, its motion exact: in the inverse form a right model is a delay off."""
    t = np.arange(4000) / RATE
    force = 90.0 * sum(w * w * size * np.sin(w * t) for size, w in ((0.1, 1.3), (0.03, 4.1), (0.01, 19.7)))
    # v(t) is exact at the samples, q of a constant force between them
    v = np.concatenate([[0.0], np.cumsum(force[:-1])]) / (90.0 * RATE)
    v = v - v.mean()
    q = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]))]) / RATE
    record = Record("a.csv", RATE, {"q": q, "force": force}, {"q": "m", "force": "N"})
    off = {}
    for told in ("", "held = ('force',)\n"):
        model = subject_of(drive(tmp_path, MASS + "cutoff = 8.0\n" + told), [record]).model
        assert isinstance(model, InverseModel)
        (track,) = model.tracks
        off[told] = float(np.abs(90.0 * track.a - track.force).max()) / float(np.std(force))
    assert off["held = ('force',)\n"] < 2e-3 < 5e-2 < off[""]


def test_only_commands_are_held(tmp_path: Path) -> None:
    t = np.arange(2000) / RATE
    rows = {"q": np.sin(t), "force": -90.0 * np.sin(t)}
    with pytest.raises(IndexerError, match=r"my_drive\.py\.held must be one of force, got 'q'"):
        subject_of(drive(tmp_path, MASS + "held = ('q',)\n"), [Record("a.csv", RATE, rows, {"q": "m", "force": "N"})])


def test_half_a_sample_is_said_in_the_inverse_form_too(tmp_path: Path) -> None:
    t = np.arange(4000) / RATE
    rows = {"q": np.sin(t), "force": -90.0 * np.sin(t)}
    for told in (False, True):
        text = MASS + "held = ('force',)\n" * told
        subject = subject_of(drive(tmp_path, text), [Record("a.csv", RATE, rows, {"q": "m", "force": "N"})])
        one = subject.model.hypotheses()["delay"][0]
        problem, place = start_of(subject, one)
        late = problem.point(np.concatenate([[0.0], one.coordinates([0.52 / RATE])]), place.states)
        assert len([said for said in subject.of_records(subject.model, late) if "half a sample" in said]) == (not told)
