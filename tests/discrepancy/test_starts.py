"""All starts of an effect looked at in the worst windows, where nothing else explains the records. Seed 11."""

from collections.abc import Mapping

import numpy as np
import pytest

from discrepancy import candidates
from discrepancy.candidates import finalists
from discrepancy.model import NONE, Hypothesis, Jobs, Parameter
from discrepancy.problem import Problem
from discrepancy.scan import Scanner, Start
from discrepancy.starts import surveyed
from tests.discrepancy.toy import Stateless

RATE, SIZE = 11.8, 5.0
WAVE = Hypothesis(
    "wave",
    (Parameter("wave.size", "-", 0.0, 1.0, 0.0, 50.0), Parameter("wave.rate", "rad/s", 2.0, 1.0, 0.5, 40.0)),
    {},
    tuple((size, rate) for size in (1.0, 6.0) for rate in (2.0, 3.0, 4.5, 11.9, 30.0)),
)


class Tone(Stateless):
    """y = size sin(rate x) + offset in 4 windows of 50 samples, noise 1; the offset is that of the one record."""

    def __init__(self) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.5, known=True, record=0),)
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 10.0, 200).reshape(4, 50)
        self.y = SIZE * np.sin(RATE * self.x) + np.random.default_rng(11).standard_normal((4, 50))

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {"wave": (WAVE,)}

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        made = 0.5 * points[:, :1] - self.y[jobs.window]
        if hypothesis.parameters:
            size, rate = (p.nominal + p.scale * z for p, z in zip(WAVE.parameters, points[:, 1:].T, strict=True))
            made = made + size[:, None] * np.sin(rate[:, None] * self.x[jobs.window])
        return made


@pytest.fixture
def scanner() -> Scanner:
    """Beside a base model whose record is bent by what is missing."""
    model = Tone()
    return Scanner(model, Problem(model, NONE).point(np.array([8.0]), np.zeros((4, 0))), 100.0)


def test_what_leaves_least_comes_first_with_its_record_unbent(scanner: Scanner) -> None:
    first, *others = surveyed(scanner, "wave")
    assert first.values == pytest.approx((6.0, 11.9))
    assert first.place.z[0] == 0.0 and first.promised == first.place.cost
    assert len(others) == 3


def test_fits_that_all_end_far_off_begin_again_where_least_is_left(scanner: Scanner) -> None:
    model, problem = scanner.model, Problem(scanner.model, WAVE)
    place = problem.point(np.concatenate([[0.0], WAVE.coordinates((1.0, 2.0))]), np.zeros((4, 0)))
    found = finalists(scanner, [Start(WAVE, place, place.cost)], {"wave": []}, scanner.base.cost)
    assert [candidate.name for candidate in found] == ["wave"]
    assert found[0].level < 1.1 and found[0].place.values == pytest.approx((SIZE, RATE), rel=0.03)
    assert found[0].level == found[0].place.level(model)


def test_a_finished_fit_is_kept_where_what_was_tried_after_it_ends_higher(scanner: Scanner, monkeypatch) -> None:
    model, problem = scanner.model, Problem(scanner.model, WAVE)
    # beside the wave there is one that nothing explains
    model.y += 1.2 * np.sin(0.9 * model.x)
    good, bad = (
        problem.point(np.concatenate([[0.0], WAVE.coordinates(values)]), np.zeros((4, 0)))
        for values in ((SIZE, RATE), (1.0, 2.0))
    )
    monkeypatch.setattr(candidates, "_explored", lambda *_: [bad])
    monkeypatch.setattr(candidates, "_found_elsewhere", lambda _, found: found)
    (found,) = finalists(scanner, [Start(WAVE, good, good.cost)], {"wave": []}, scanner.base.cost)
    assert 1.1 < found.level < 1.6 and found.place.values == pytest.approx((SIZE, RATE), rel=0.1)
