"""Fits of sets that are known to look alike. Seed 5."""

import numpy as np
import pytest

from discrepancy.criteria import Criteria
from discrepancy.fits import Fits
from discrepancy.model import Hypothesis, Jobs
from discrepancy.problem import Problem
from discrepancy.search import Search
from tests.discrepancy.toy import WINDOWS, Chord
from tests.discrepancy.toy import effect as effect_like

_WELL = 2.0 * np.pi


class Pitted(Chord):
    """A chord with a start state s of each window that adds h(s) of the shape `rest`: h is 0 at s = 2π and has another
    minimum next to s = 0, from which no small step leads to the first."""

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        s = jobs.states[:, :1]
        height = 1.5 - 0.5 * np.cos(s) - np.exp(-((s - _WELL) ** 2) / 8.0)
        return super().residuals(hypothesis, jobs) + height * self.shapes["rest"][jobs.window]


@pytest.fixture
def model() -> Pitted:
    model = Pitted({"tone": 10.0}, 5, ("tone", "twin"))
    model.library["tone"] = (effect_like("tone", alike=("twin",)),)
    return model


def at(model: Pitted, name: str, size: float, offset: float, state: float):
    problem = Problem(model, model.library[name][0])
    return problem.point(np.array([offset, size]), np.full((WINDOWS, 1), state))


def test_what_looks_alike_is_compared_from_the_same_start_states(model) -> None:
    """`twin` is raced to a wrong size beside another offset, from start states in the other well."""
    fits = Fits(model, model)
    fitted = fits.fit(at(model, "tone", 10.0, 0.0, _WELL))
    raced = at(model, "twin", 6.0, 1.0, 0.0)
    beside = fits.left_out(fitted, 0)
    begun = fits.alike(raced, beside, fitted)
    assert begun.z == pytest.approx(fitted.place.z, abs=0.05) and begun.z[0] == beside.z[0]
    assert fits.fit(begun).place.cost == pytest.approx(fitted.place.cost, abs=0.1)
    assert Fits(model, model).fit(raced).place.cost > fitted.place.cost + 100.0


@pytest.mark.parametrize("asked", [True, False])
def test_a_search_tells_a_family_whose_start_states_are_hard_to_find(model, asked: bool, monkeypatch) -> None:
    if not asked:
        monkeypatch.setattr(Fits, "alike", lambda self, place, beside, fitted: place)
    search = Search(model, Criteria())
    fitted = search.fits.fit(at(model, "tone", 10.0, 0.0, _WELL))
    (other,) = search._instead(fitted, 0, alike=True)
    assert search.wins(fitted, other) != asked
