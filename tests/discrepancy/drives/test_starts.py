"""What a record begins with is unknown; loads behind springs and play, by solvers that the models do not share."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.inverse import InverseModel
from discrepancy.fit import fit
from indexer_experiments.challenge.drives.motions import reference
from indexer_experiments.challenge.drives.plant import simulate_plant
from tests.discrepancy.drives.made import drive, motion, record, start_of, subject, values

OMEGA, DAMPING, LOAD = 20.0, 0.03, 40.0
"""Of a load on a spring [rad/s, -, kg]; the drive has 55 kg besides."""


def _felt(t: np.ndarray) -> np.ndarray:
    """Acceleration of the load, which swings at 0.4 m/s beside the joint when the record begins, by SciPy."""

    def rates(s: float, x: np.ndarray) -> list[float]:
        q = sum(size * math.sin(w * s) for size, w in ((0.1, 1.3), (0.03, 4.1), (0.01, 9.7)))
        v = sum(size * w * math.cos(w * s) for size, w in ((0.1, 1.3), (0.03, 4.1), (0.01, 9.7)))
        return [x[1], -2.0 * DAMPING * OMEGA * (x[1] - v) - OMEGA**2 * (x[0] - q)]

    _, q, v, _ = motion()
    found = solve_ivp(rates, (0.0, float(t[-1])), [q[0], v[0] + 0.4], t_eval=t, rtol=1e-8, atol=1e-10, max_step=0.02)
    return np.array([rates(s, x)[1] for s, x in zip(t, found.y.T, strict=True)])


@pytest.mark.parametrize(("begins", "level"), [(True, (0.0, 1.5)), (False, (5.0, np.inf))])
def test_a_load_that_swings_when_the_record_begins(begins: bool, level: tuple[float, float], tmp_path, monkeypatch):
    """Seed 3."""
    made = subject(tmp_path, lambda t, q, v, a: 55.0 * a + LOAD * _felt(t))
    if not begins:
        monkeypatch.setattr(InverseModel, "_starts", lambda self, track, hypothesis, point: np.zeros((0, 1)))
    one = made.model.hypotheses()["compliance"][0]
    problem, place = start_of(made, one)
    z = np.concatenate([[made.model.parameters[0].coordinate(95.0)], one.coordinates([0.4, OMEGA**-2, DAMPING])])
    found = fit(problem, problem.point(z, place.states), steps=25).place
    assert level[0] < found.level(made.model) < level[1]
    if begins:
        got = values(problem, found)
        assert got["compliance.share"] == pytest.approx(LOAD / 95.0, rel=0.03)
        assert got["compliance.inverse_square"] == pytest.approx(OMEGA**-2, rel=0.01)


def test_the_friction_of_a_load_behind_play_need_not_be_known(tmp_path) -> None:
    """A drive that is believed to be without friction, 40 of its 95 kg with 25 N behind 4 mm of play. Seed 2."""
    rng = np.random.default_rng(2)
    path = 0.2 * reference("point_to_point", 12000, 5.0, rng)
    truth = {"mass": 55.0, "load": 40.0, "stiffness": 40e6, "damping": 2e4, "play": 0.004, "load_coulomb": 25.0}
    run = simulate_plant(truth, path, 1000.0, (95.0 * 3600.0, 95.0 * 96.0), steps=25)
    rows = {"q": run.q[::4], "force": (run.force + 0.5 * rng.standard_normal(len(run.force)))[::4]}
    made = subject_of(drive(tmp_path), [Record("a.csv", 250.0, rows, {"q": "m", "force": "N"})])
    one = made.model.hypotheses()["play.contact"][0]
    problem, place = start_of(made, one)
    z = np.concatenate([[0.0], one.coordinates([0.003, 0.5, 15.0])])
    found = fit(problem, problem.point(z, place.states), steps=40).place
    got = values(problem, found)
    assert got["play.contact.play"] == pytest.approx(0.004, rel=0.05)
    assert got["play.contact.friction"] == pytest.approx(25.0, rel=0.2)


def test_a_line_above_the_cut_off_is_looked_for(tmp_path) -> None:
    """At 50 Hz motion and force are compared below 3.75 Hz, where a line at 6 Hz still shows. Seed 3."""
    given = record(lambda t, q, v, a: 95.0 * a + 3.0 * np.sin(2.0 * math.pi * 6.0 * t + 0.4), rate=50.0)
    made = subject_of(drive(tmp_path), [given])
    assert made.model.tracks[0].cutoff < 4.0
    starts = made.model.hypotheses()["sensor.mains_hum"][0].starts
    assert starts[0][1] == pytest.approx(6.0, rel=0.01)
