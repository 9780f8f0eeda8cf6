"""How much a set must win for the search to take a step with it. Of the sets compared all explain the same and each is
told its score, so that every rule is seen alone. Seed 5."""

import dataclasses

import numpy as np
import pytest

from discrepancy.criteria import Criteria
from discrepancy.model import NONE, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import Race
from discrepancy.search import Search
from discrepancy.selection import Fitted, Selection
from tests.discrepancy.toy import WINDOWS, Chord
from tests.discrepancy.toy import effect as effect_like

BEFORE, LARGEST = 100.0, 9.0
"""The score of the set that there is; the size at which a bound holds an effect."""


@pytest.fixture
def search() -> Search:
    """Of a chord whose effects are silent, with a margin of 30; `tone` is known to look like `twin`."""
    model = Chord({}, 5, ("tone", "twin", "beat"), largest=LARGEST)
    model.shapes = {name: np.zeros_like(shape) for name, shape in model.shapes.items()}
    model.library["tone"] = (effect_like("tone", alike=("twin",), largest=LARGEST),)
    return Search(model, Criteria(margin=30.0))


def winning(search: Search, won: float, *names: str, size: float = 0.0) -> Fitted:
    """A set that scores so much better than `BEFORE`."""
    hypothesis = together(*(search.model.hypotheses()[name][0] for name in names)) if names else NONE
    z = np.array([0.0, *(size for _ in names)])
    place = Problem(search.model, hypothesis).point(z, np.zeros((WINDOWS, 0)))
    return Fitted(place, True, BEFORE - won, 1.0)


@pytest.mark.parametrize(("won", "taken"), [(0.0, False), (12.0, False), (18.0, True)])
def test_a_suggested_set_is_taken_from_half_the_margin_on(search: Search, won: float, taken: bool, monkeypatch) -> None:
    own, other = winning(search, 0.0, "tone"), winning(search, won, "beat")
    monkeypatch.setattr(search, "_suggest", lambda fits: [other.place])
    monkeypatch.setattr(search.fits, "fit", lambda place: other)
    assert search._suggested(own) is (other if taken else own)


@pytest.mark.parametrize(
    ("won", "own_at", "other_at", "taken"),
    [
        (12.0, 0.0, 0.0, False),
        (18.0, 0.0, 0.0, True),
        (18.0, 0.0, LARGEST, False),
        (48.0, 0.0, LARGEST, True),
        (-12.0, LARGEST, 0.0, True),
        (-18.0, LARGEST, 0.0, False),
    ],
)
def test_a_set_that_was_compared_is_taken_from_half_the_margin_on_and_what_a_bound_holds_lacks_a_whole_one(
    search: Search, won: float, own_at: float, other_at: float, taken: bool, monkeypatch
) -> None:
    own, other = winning(search, 0.0, "tone", size=own_at), winning(search, won, "beat", size=other_at)
    monkeypatch.setattr(search, "_instead", lambda fitted, k, *, alike: (other,) if fitted is own else (own,))
    assert search._compared(own)[0] is (other if taken else own)


@pytest.mark.parametrize(("own_at", "other_at", "gap"), [(0.0, 0.0, 12.0), (0.0, LARGEST, 42.0), (LARGEST, 0.0, -18.0)])
def test_a_set_that_a_bound_holds_stands_the_margin_behind_in_all_that_is_said(
    search: Search, own_at: float, other_at: float, gap: float
) -> None:
    """As in the comparison that chose the set: a rival that only a bound keeps so near is none."""
    own, other = winning(search, 12.0, "tone", size=own_at), winning(search, 0.0, "beat", size=other_at)
    selection = Selection(own, own, (), (), (), True, search.model, 30.0)
    assert selection.gap(other) == pytest.approx(gap)


@pytest.mark.parametrize(("better", "kept"), [(0.5, True), (2.0, False)])
def test_a_race_is_kept_until_its_set_is_clearly_better_fitted(search: Search, better: float, kept: bool) -> None:
    """By more than one in score; the dispersion is 1."""
    base = winning(search, 0.0).place
    search._races["", ""] = raced = Race(base.cost + better * base.dispersion(search.model), [])
    search._asked["", ""] = {"tone"}
    assert (search._led(("", ""), base) is raced) == kept
    assert (("", "") in search._races, ("", "") in search._asked) == (kept, kept)


@pytest.mark.parametrize(
    ("names", "won", "after", "grows"),
    [
        (("tone",), 12.0, 60.0, False),
        (("tone",), 18.0, 60.0, True),
        (("tone",), 18.0, 27.0, False),
        (("tone", "beat"), 27.0, 60.0, False),
        (("tone", "beat"), 33.0, 60.0, True),
    ],
)
def test_one_effect_floats_from_half_the_margin_on_and_two_from_the_whole_which_all_must_win_in_the_end(
    search: Search, names: tuple, won: float, after: float, grows: bool, monkeypatch
) -> None:
    current, one, floated = winning(search, 0.0), winning(search, won, *names), winning(search, after, *names)
    monkeypatch.setattr(search, "_leaves", lambda fitted, least: True)
    monkeypatch.setattr(search, "_pairs", lambda current, tried: [one] if len(names) == 2 else [])
    monkeypatch.setattr(search, "_floated", lambda fitted: floated)
    assert search._grown(current, [one] if len(names) == 1 else []) is (floated if grows else current)


@pytest.mark.parametrize(("behind", "fitted_again"), [(27.0, False), (33.0, True)])
def test_what_looks_alike_is_fitted_again_only_where_it_raced_to_the_margin_behind(
    search: Search, behind: float, fitted_again: bool, monkeypatch
) -> None:
    asked: list[str] = []
    own, raced = winning(search, 0.0, "tone"), winning(search, -behind, "twin")
    monkeypatch.setattr(search, "_raced", lambda base, instead: Race(0.0, []))
    monkeypatch.setattr(search, "_finished", lambda race, best: [raced])
    monkeypatch.setattr(
        "discrepancy.search.race", lambda model, base, effects, *given: asked.extend(h.name for h in effects) or []
    )
    assert search._instead(own, 0, alike=True) == (raced,)
    assert asked == (["twin"] if fitted_again else [])


@pytest.mark.parametrize(("cost", "fitted"), [(740.0, True), (760.0, False)])
def test_what_wins_less_than_half_of_what_the_known_set_does_is_not_fitted(
    search: Search, cost: float, fitted: bool, monkeypatch
) -> None:
    """A race from 1000 has led to this cost alone; the set that is known costs 500."""
    own, other = winning(search, 0.0, "tone"), winning(search, 0.0, "beat")
    place = dataclasses.replace(other.place, cost=cost)
    asked: list[Point] = []
    monkeypatch.setattr(search.fits, "careful", lambda fitted: dataclasses.replace(fitted.place, cost=500.0))
    monkeypatch.setattr(search.fits, "fit", lambda place: asked.append(place) or other)
    assert search._finished(Race(1000.0, [place]), own) == ([other] if fitted else [])
    assert asked == ([place] if fitted else [])
