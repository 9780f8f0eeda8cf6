"""Play and a sensor's lag in the forward form, against SciPy's solver."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discrepancy.drives.forces import CONTACT
from discrepancy.drives.forward import ForwardModel
from discrepancy.drives.readings import lagging
from discrepancy.fit import fit
from discrepancy.model import NONE
from discrepancy.problem import Problem
from tests.discrepancy.drives.made import run_plain, start_of, values
from tests.discrepancy.drives.test_forward import PUSH, WINDOWS, T, made

PLAY, SHARE, FRICTION = 0.05, 0.4, 0.02
"""rad, of the pendulum's inertia, N m on the load behind the play."""


def _behind_play(omega: float) -> np.ndarray:
    """Angle of the pendulum with a load behind play whose contact pushes and never pulls; stuck where friction holds
    it, which the solver has as a very steep law."""
    mass, damping = SHARE * 0.05, 2.0 * 0.5 * omega

    def pushed(q: float, v: float, x: float, y: float) -> float:
        d = q - x
        if abs(d) <= 0.5 * PLAY:
            return 0.0
        side = math.copysign(1.0, d)
        return side * max(side * (omega**2 * (d - side * 0.5 * PLAY) + damping * (v - y)), 0.0)

    def rates(t: float, s: np.ndarray) -> list[float]:
        q, v, x, y = s
        force = pushed(q, v, x, y)
        held = min(max(y / 1e-6, -1.0), 1.0) * FRICTION / mass
        push = float(np.interp(t, T, PUSH)) - math.sin(q) - 0.02 * v
        return [v, (push - mass * force) / ((1.0 - SHARE) * 0.05), y, force - held]

    found = solve_ivp(
        rates, (0.0, float(T[-1])), [0.3, 0.0, 0.3, 0.0], "LSODA", t_eval=T, rtol=1e-8, atol=1e-10, max_step=2e-3
    )
    return found.y[0]


@pytest.fixture(scope="module")
def moved(tmp_path_factory) -> tuple[ForwardModel, np.ndarray]:
    model = made(tmp_path_factory.mktemp("a"), 0.4 + 0.2 * np.sin(3.0 * T), WINDOWS).model
    assert isinstance(model, ForwardModel)
    model.substeps = 4
    one = model.hypotheses()["play.contact"][0]
    assert one.fixed == {"law": 0.0}
    told = [p.nominal for p in model.parameters] + [PLAY, SHARE, FRICTION]
    return model, _behind_play(float(model.set_up(one, told)[0][0, CONTACT]))


def test_a_load_behind_play_moves_as_scipy_says(moved, monkeypatch) -> None:
    """The same contact with ever finer steps: 2 mrad off, and then next to nothing."""
    model, truth = moved
    one = model.hypotheses()["play.contact"][0]
    z = np.concatenate([np.zeros(3), one.coordinates([PLAY, SHARE, FRICTION])])
    omega = float(model.set_up(one, [*(p.nominal for p in model.parameters), PLAY, SHARE, FRICTION])[0][0, CONTACT])
    set_up = model.set_up

    def as_stiff(hypothesis, told):
        joints, *others = set_up(hypothesis, told)
        joints[:, CONTACT] = omega
        return joints, *others

    monkeypatch.setattr(model, "set_up", as_stiff)
    plain = run_plain(model, NONE, np.zeros(3), np.array([0.3, 0.0]))[0]
    first = T < 2.0  # beyond that play makes two runs part
    for substeps, error in ((4, 3e-3), (64, 1e-4)):
        monkeypatch.setattr(model, "substeps", substeps)
        got = run_plain(model, one, z, np.array([0.3, 0.0]))[0]
        assert np.abs(got - truth)[first].max() < error < 1e-2 < np.abs(plain - truth)[first].max()


def test_hidden_play_is_found_again(moved, tmp_path) -> None:
    """Seed 6, noise of 1 mrad; the load's place in its play is looked for in every window. A fit has many minima, in
    which one it ends depends on the last bits of a processor; the best of several sizes of play does not."""
    _, truth = moved
    noisy = truth + 1e-3 * np.random.default_rng(6).standard_normal(len(truth))
    subject = made(tmp_path, noisy, WINDOWS)
    model = subject.model
    assert isinstance(model, ForwardModel)
    model.substeps = 4
    one = model.hypotheses()["play.contact"][0]
    problem, found = Problem(model, one), []
    for play in (0.8 * PLAY, PLAY, 1.2 * PLAY):
        z = np.concatenate([np.zeros(3), one.coordinates([play, SHARE, FRICTION])])
        place = problem.point(z, np.zeros((len(model.counts), model.local_count(one))))
        found.append(fit(problem, problem.searched(place), steps=25, thorough=True).place)
    best = min(found, key=lambda place: place.cost)
    assert best.level(model) < 1.3
    assert values(problem, best)["play.contact.play"] == pytest.approx(PLAY, rel=0.1)


def test_a_sensor_that_lags_reads_a_ramp_late_and_a_step_by_its_law() -> None:
    step, time = 0.005, 0.03
    t = step * np.arange(200)
    ramp, late = 2.0 * t + 1.0, np.where(t >= 0.1, 1.0, 0.0)
    got = lagging(np.stack([ramp, late]), time, step)
    np.testing.assert_allclose(got[0], ramp - 2.0 * time, atol=1e-12)
    after = t >= 0.1
    # the step is a ramp over one sample, so that it comes half a sample early
    np.testing.assert_allclose(got[1][after], 1.0 - np.exp(-(t[after] - 0.1 + 0.5 * step) / time), atol=2e-3)


def test_a_hidden_lag_of_the_sensor_is_found(tmp_path) -> None:
    """Seed 7: the pendulum's encoder lags by 25 ms, solved by SciPy."""

    def rates(t: float, s: np.ndarray) -> list[float]:
        return [s[1], (float(np.interp(t, T, PUSH)) - math.sin(s[0]) - 0.02 * s[1]) / 0.05, (s[0] - s[2]) / 0.025]

    found = solve_ivp(rates, (0.0, float(T[-1])), [0.3, 0.0, 0.3], t_eval=T, rtol=1e-9, atol=1e-11, max_step=2e-3)
    noisy = found.y[2] + 1e-3 * np.random.default_rng(7).standard_normal(len(T))
    subject = made(tmp_path, noisy, WINDOWS)
    problem, place = start_of(subject, subject.model.hypotheses()["sensor.lowpass"][0])
    best = fit(problem, place, steps=25).place
    assert best.level(subject.model) < 1.15
    assert values(problem, best)["sensor.lowpass.time_constant"] == pytest.approx(0.025, rel=0.1)
