"""Fits of sets that are known to look alike. Seed 5."""

import dataclasses

import numpy as np
import pytest

from discrepancy.criteria import Criteria
from discrepancy.fit import Fit, fit
from discrepancy.fits import Fits
from discrepancy.jobs import Jobs
from discrepancy.judging import Judge
from discrepancy.model import NONE, Hypothesis, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.search import Search
from discrepancy.selection import fitted_set
from tests.discrepancy.toy import WINDOWS, Chord, Long
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


def two(model: Pitted, state: float) -> Point:
    """The model's tone with another effect beside it that does nothing."""
    hypothesis = together(model.library["tone"][0], model.library["beat"][0])
    problem = Problem(model, hypothesis)
    return problem.point(np.array([0.0, 10.0, 0.0]), np.full((WINDOWS, 1), state))


class Parted(Long, Pitted):
    """The same, of which a search takes half; a grid knows the wrong minimum alone."""

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.zeros((1, 1))


def test_a_set_pays_for_parameters_choices_and_what_it_frees(monkeypatch) -> None:
    """k ln N + 2 ln m + v W: two parameters, one of two choices and one alone, 3 unknowns in each of 8 windows."""
    model = Chord({}, 5, ("tone", "beat"))
    model.library["tone"] = (effect_like("tone"), dataclasses.replace(effect_like("tone"), fixed={"order": 2.0}))
    monkeypatch.setattr(Chord, "freed", lambda self, hypothesis: 3.0, raising=False)
    both = together(*(model.library[name][0] for name in ("tone", "beat")))
    price = 2.0 * np.log(800.0) + 2.0 * np.log(2.0) + 3.0 * WINDOWS
    assert Fits(model, model).price(both) == pytest.approx(price)


def test_all_windows_start_as_those_that_were_searched() -> None:
    whole = Parted({"tone": 10.0}, 5)
    part = whole.part(4)
    problem = Problem(part, whole.library["tone"][0])
    fits = Fits(whole, part)
    fitted = fits.fit(problem.point(np.array([0.0, 10.0]), np.full((4, 1), _WELL)))
    assert fits.on_all(fitted).place.states == pytest.approx(np.full((WINDOWS, 1), _WELL), abs=0.5)


@pytest.mark.parametrize("better", [True, False])
def test_a_set_is_fitted_anew_where_that_leads_to_a_better_place(better: bool, monkeypatch) -> None:
    """An effect is left out of a set that starts in the right well. The set without it is known, from a fit that began
    in the other well, or from there: then it is not followed to its end."""
    model = Pitted({"tone": 10.0}, 5, ("tone", "beat"))
    fits = Fits(model, model)
    assert not fits.begun.effects
    both = fits.fit(two(model, _WELL))
    alone = Problem(model, model.library["tone"][0])
    begun = at(model, "tone", 10.0, 0.0, 0.0) if better else fits.left_out(both, 1)
    known = fits.kept(fit(alone, begun, steps=15).place, True)
    thorough = []

    def counted(*given, **more):
        thorough.append(more.get("thorough", False))
        return fit(*given, **more)

    monkeypatch.setattr("discrepancy.fits.fit", counted)
    without = fits.without(both, 1)
    assert (without is not known) == better == any(thorough)
    assert without.place.cost == pytest.approx(both.place.cost, abs=10.0)
    assert fits.without(both, 1) is without and len(thorough) == 1 + better


def test_a_smaller_set_that_was_fitted_better_since_is_the_one_that_counts() -> None:
    model = Pitted({"tone": 10.0}, 5, ("tone", "beat"))
    fits = Fits(model, model)
    both = fits.fit(two(model, _WELL))
    poor = fits.without(both, 1)
    better = fits.kept(dataclasses.replace(poor.place, cost=poor.place.cost - 1.0), True)
    assert better is not poor and fits.without(both, 1) is better


def test_a_set_that_was_fitted_better_since_is_held_anew(monkeypatch) -> None:
    monkeypatch.setattr("discrepancy.judging.held_places", lambda places, held_out, known: list(places))
    model = Pitted({"tone": 10.0}, 5, ("tone", "beat"))
    fits = Search(model, Criteria()).fits
    best = fits.fit(at(model, "tone", 10.0, 0.0, _WELL))
    poor, worse = (dataclasses.replace(best.place, cost=best.place.cost + more) for more in (5.0, 9.0))
    judge = object.__new__(Judge)
    judge.held_out, judge.held, judge._adapted, judge._costs = model, {}, {}, {}
    for place, kept in ((poor, poor), (worse, poor), (best.place, best.place)):
        judge._adapted[best.name] = best.place
        judge._hold([dataclasses.replace(best, place=place)])
        assert judge.held[best.name] is kept
        assert (best.name in judge._adapted) == (place is worse), "what was adapted from another place is so anew"


def test_a_race_begins_where_the_machine_bears_its_extra_weight_also_without_effects() -> None:
    """The offset takes up what it can of a level that is missing; a race may not begin so far from what was known."""
    model = Pitted({}, 5, ("tone", "beat"))
    model.y = model.y + 0.2
    fits = Search(model, Criteria()).fits
    bare = fits.fit(fits.begun.place)
    assert fits.careful(fits.begun) is not fits.careful(bare)
    assert abs(fits.careful(bare).z[0]) < 0.5 * abs(bare.place.z[0])
    assert fits.careful(bare).cost < 1.001 * fits.careful(fits.begun).cost


def test_sets_held_before_learn_start_states_of_later_ones(monkeypatch) -> None:
    """The tone is held from the wrong well, a set with another effect beside it from the right one."""

    def as_they_are(places: list[Point], held_out: Pitted, known: list[Point]) -> list[Point]:
        return [Problem(held_out, one.hypothesis, frozen=True).point(one.z, one.states) for one in places]

    monkeypatch.setattr("discrepancy.judging.held_places", as_they_are)
    model, held_out = (Pitted({"tone": 10.0}, seed, ("tone", "beat")) for seed in (5, 6))
    search = Search(model, Criteria())
    one, other = search.fits.fit(at(model, "tone", 10.0, 0.0, _WELL)), search.fits.fit(two(model, _WELL))
    judge = object.__new__(Judge)
    judge.held_out, judge.held, judge._adapted, judge._costs = held_out, {}, {}, {}
    for fitted, state in ((one, 0.0), (other, _WELL)):
        began = np.full((WINDOWS, 1), state)
        place = dataclasses.replace(fitted.place, states=began)
        judge._hold([dataclasses.replace(fitted, place=place)])
        judge._adapted[fitted.name] = fitted.place
    assert judge.held[one.name].states == pytest.approx(np.full((WINDOWS, 1), _WELL), abs=0.5)
    assert list(judge._adapted) == [other.name], "what was adapted from the wrong states is so anew"


@pytest.mark.parametrize(("with_effect", "as_it_came", "kept"), [(2.9, 0.2, 0.2), (0.2, 2.9, 0.2)])
def test_the_set_without_effects_is_fitted_from_the_better_of_two_machines(
    with_effect: float, as_it_came: float, kept: float, monkeypatch
) -> None:
    """Offsets, of which 0 is right, of the set that had the effect and of the model as it came; no fit moves them."""
    monkeypatch.setattr("discrepancy.fits.fit", lambda problem, place, **steps: Fit(problem.adopted(place), True))
    model = Chord({}, 5)
    fits = Fits(model, model)
    begun = Problem(model, NONE).point(np.array([as_it_came]), np.zeros((WINDOWS, 0)))
    fits.begun = fitted_set(model, begun, True, 0.0, optimum=False)
    place = Problem(model, model.library["tone"][0]).point(np.array([with_effect, 1.0]), np.zeros((WINDOWS, 0)))
    assert fits.without(fitted_set(model, place, True, 0.0), 0).place.z.tolist() == [kept]
