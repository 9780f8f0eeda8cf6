"""A wave fitted with the wrong frequency is stuck; moving its frequency with the library's ladder leads out."""

from collections.abc import Mapping

import numpy as np
import pytest

from discrepancy.escape import escaped
from discrepancy.fit import fit
from discrepancy.model import NONE, Hypothesis, Jobs, Parameter
from discrepancy.problem import Problem
from discrepancy.scan import neighbours
from tests.discrepancy.toy import Stateless

WAVE = Hypothesis("wave", (Parameter("wave.rate", "rad/s", 2.0, 1.0, 0.0, 20.0),), {}, ((2.0,), (4.0,), (8.0,)))


class Waves(Stateless):
    """y = 5 sin(rate x) in 4 windows of 50 samples, noise 1; no parameters of its own."""

    def __init__(self, rate: float) -> None:
        self.parameters = ()
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 10.0, 200).reshape(4, 50)
        self.y = 5.0 * np.sin(rate * self.x) + np.random.default_rng(4).standard_normal((4, 50))

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {"wave": (WAVE,)}

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        rate = np.array([WAVE.parameters[0].value(z[0]) for z in jobs.points])[jobs.point]
        return 5.0 * np.sin(rate[:, None] * self.x[jobs.window]) - self.y[jobs.window]


def test_a_stuck_fit_gets_out() -> None:
    model = Waves(2.9)
    problem = Problem(model, WAVE)
    stuck = fit(problem, problem.point(WAVE.coordinates((2.0,)), np.zeros((4, 0))), steps=20).place
    assert stuck.level(model) > 2.0
    free = escaped(problem, stuck, rounds=3, enough=1.2)
    assert free.level(model) < 1.2
    assert WAVE.parameters[0].value(free.z[0]) == pytest.approx(2.9, abs=0.02)


def test_a_fit_that_is_good_enough_is_left_alone() -> None:
    model = Waves(2.9)
    problem = Problem(model, WAVE)
    place = problem.point(WAVE.coordinates((2.9,)), np.zeros((4, 0)))
    assert escaped(problem, place, rounds=3, enough=1.5).z == pytest.approx(place.z, abs=0.0)


@pytest.mark.parametrize(
    ("value", "ladder", "share", "expected"),
    [
        (2.0, [1.0, 2.0, 8.0], 0.5, [2.0**0.5, 4.0]),
        (0.0, [-1.0, 0.0, 1.0], 0.25, [-0.25, 0.25]),
        (8.0, [1.0, 2.0, 8.0], 0.5, [4.0, 16.0]),
        (3.0, [3.0], 1.0, [1.5, 6.0]),
        (27.0, [3.0, 9.0, 27.0, 81.0, 243.0], 1.0, [9.0, 81.0]),
        (8.0 * (1.0 - 1e-15), [1.0, 2.0, 8.0], 1.0, [2.0, 32.0]),
        (0.22, [0.19, 0.225, 0.26], 1.0, [0.19, 0.26]),
    ],
)
def test_neighbours_go_on_beyond_the_ends(value: float, ladder: list, share: float, expected: list) -> None:
    assert neighbours(value, ladder, share) == pytest.approx(expected)


class Valley(Stateless):
    """Residuals 10 (b - a²) and 1 - a of each of 2 windows: a narrow valley, bent, to a = b = 1 (Rosenbrock 1960).

    Single steps need more than 20 for it.
    """

    def __init__(self) -> None:
        self.parameters = (Parameter("a", "-", -1.2, 0.3), Parameter("b", "-", 1.0, 0.3))
        self.counts, self.groups = np.full(2, 2), np.zeros(2, dtype=np.int64)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        a, b = (p.nominal + p.scale * z for p, z in zip(self.parameters, jobs.points[jobs.point].T, strict=True))
        return 300.0 * np.stack([10.0 * (b - a**2), 1.0 - a], axis=1)


def test_a_bent_valley_is_followed_to_its_end() -> None:
    model = Valley()
    problem = Problem(model, NONE)
    found = fit(problem, problem.point(np.zeros(2), np.zeros((2, 0))), steps=16)
    values = [p.value(z) for p, z in zip(model.parameters, found.place.z, strict=True)]
    assert values == pytest.approx([1.0, 1.0], abs=1e-3)


def test_the_wider_the_gap_the_heavier_what_is_known() -> None:
    known = Parameter("a", "-", 1.0, 0.3, known=True)
    model = Valley()
    model.parameters = (known, known)
    cautious, exact = Problem(model, NONE, caution=10.0), Problem(model, NONE)
    place = cautious.point(np.ones(2), np.zeros((2, 0)))
    gap = float(np.median(place.squares / model.counts))
    assert cautious.eased(place).precision == pytest.approx(cautious.precision * gap)
    assert exact.eased(place).precision == pytest.approx(exact.precision)


class Flat(Valley):
    """Records that say nothing about the two parameters."""

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        return np.zeros((len(jobs.window), 2))


@pytest.mark.parametrize("frozen", [True, False])
def test_frozen_physics_is_not_doubted(frozen: bool) -> None:
    model = Flat()
    known = Parameter("a", "-", 1.0, 0.3, known=True)
    model.parameters = (known, known)
    problem = Problem(model, NONE, frozen=frozen)
    place = fit(problem, problem.point(np.full(2, 2.5), np.zeros((2, 0))), steps=3, thorough=True).place
    assert (place.z == 2.5).all() == frozen
