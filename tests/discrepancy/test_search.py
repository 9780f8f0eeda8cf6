"""Stepwise selection: each step is needed by a case that goes wrong without it. Seed 5."""

import time
from dataclasses import replace

import numpy as np
import pytest

from discrepancy import race as racing
from discrepancy.criteria import Criteria
from discrepancy.dispersion import autocorrelation_time
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis, Parameter, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import Race, race
from discrepancy.search import Search
from tests.discrepancy.toy import Chord, late
from tests.discrepancy.toy import effect as effect_like


def selected(model: Chord, **criteria: float) -> set[str]:
    return set(Search(model, Criteria(**criteria)).run().best.place.hypothesis.names)  # type: ignore[arg-type]


LIKE = {"a": 5.0, "b": 4.5}
"""What their sum and half a third shape explains best alone."""

OFFERED = ("a", "b", "a and b")


@pytest.mark.parametrize(("drops", "names"), [(True, {"a", "b"}), (False, set(OFFERED))])
def test_what_came_first_is_dropped_once_it_is_not_needed(drops: bool, names: set, monkeypatch) -> None:
    monkeypatch.setattr(Search, "_exchanged", lambda self, fitted: [])
    if not drops:
        monkeypatch.setattr(Search, "_needless", lambda self, fitted: [])
    assert selected(Chord(LIKE, 5, OFFERED)) == names


@pytest.mark.parametrize("swaps", [True, False])
def test_an_effect_is_exchanged_where_the_set_may_not_grow(swaps: bool, monkeypatch) -> None:
    if not swaps:
        monkeypatch.setattr(Search, "_exchanged", lambda self, fitted: [])
        monkeypatch.setattr(Search, "_compared", lambda self, fitted: (fitted, ((), ())))
    names = selected(Chord(LIKE, 5, OFFERED), most=2)
    assert (names == {"a", "b"}) == swaps and ("a and b" in names) == (not swaps)


@pytest.mark.parametrize("ahead", [True, False])
def test_two_effects_that_hide_each_other_are_found_together(ahead: bool, monkeypatch) -> None:
    """What is hidden is their difference, a fifth of either: neither alone wins the margin. It leaves 1.4 in mean
    square above the noise, so the search goes to such lengths; a lesser one it leaves alone."""
    if not ahead:
        monkeypatch.setattr(Search, "_pairs", lambda self, current, tried: ())
    model = Chord({}, 5, ("near", "far"))
    model.shapes |= {"near": model.shapes["a"] + 0.2 * model.shapes["b"], "far": model.shapes["a"]}
    model.y = model.y + 6.0 * (model.shapes["near"] - model.shapes["far"])
    assert set(Search(model, Criteria(much=1.0)).run().best.place.hypothesis.names) == (
        {"near", "far"} if ahead else set()
    )
    assert Search(model, Criteria(much=1.6)).run().best.name == "none"


@pytest.mark.parametrize(("strain", "names"), [(5.0, {"tone", "lag"}), (50.0, {"tone"})])
def test_one_more_is_looked_for_where_what_was_stated_of_a_record_is_pulled_far(strain: float, names: set) -> None:
    model = late(5)
    assert selected(model, strain=strain) == names
    tone = Search(model, Criteria(most=1)).run().best
    assert tone.place.level(model) ** 2 < 1.2 and 6.0 < tone.place.strain(model) < 10.0


def test_an_effect_that_looks_alike_is_not_added_to_a_set_that_has_it(monkeypatch) -> None:
    """`tone` looks like `beat`, which stands beside it: without `tone` the set is not tried with a second `beat`."""
    model = Chord({"tone": 10.0, "beat": 9.0}, 5)
    model.library["tone"] = (effect_like("tone", alike=("beat",)),)
    monkeypatch.setattr(Race, "rival", lambda *_: True)
    found = Search(model, Criteria()).run()
    assert set(found.best.place.hypothesis.names) == {"tone", "beat"}
    names = [one.place.hypothesis.names for group in found.instead for one in group]
    assert all(len(set(row)) == len(row) for row in names)


def test_an_effect_that_looks_alike_is_tried_beside_all_else_as_it_is(monkeypatch) -> None:
    """`tone` hidden, its twin of the same shape known to look alike and found nowhere so far: it is raced from the
    set's own offset and not from that of the set without `tone`, and stands once among what was compared."""
    model, begun = Chord({"tone": 10.0}, 5, ("tone", "twin")), []
    model.library["tone"] = (effect_like("tone", alike=("twin",)),)

    def noted(model: Chord, base: Point, effects, criteria: Criteria, **more: bool) -> list[Point]:
        effects = list(effects)
        if [effect.name for effect in effects] == ["twin"]:
            begun.append(base.z)
        else:
            effects = [effect for effect in effects if effect.name == "tone"]
        return race(model, base, effects, criteria, **more)

    monkeypatch.setattr("discrepancy.search.race", noted)
    found = Search(model, Criteria()).run()
    assert found.best.place.hypothesis.names == ("tone",) and [len(group) for group in found.instead] == [1]
    assert begun[-1] == pytest.approx(found.best.place.z[:1]) and found.gap(found.instead[0][0]) < 1.0


class Loose(Chord):
    """A chord whose machine has a play of the shape `a`, which is held while starts race."""

    def __init__(self) -> None:
        super().__init__({"a": 9.0, "b": 0.8}, 5, ("near", "b"))
        self.shapes["near"] = self.shapes["a"]
        play = Parameter("play", "rad", 0.0, 9.0, -27.0, 27.0, known=True, rough=True)
        self.parameters = (*self.parameters, play)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        plain = Jobs(np.delete(jobs.points, 1, axis=1), jobs.point, jobs.window, jobs.states)
        return super().residuals(hypothesis, plain) + 9.0 * points[:, 1, None] * self.shapes["a"][jobs.window]


class Yielding(Chord):
    """A chord whose machine has the shape `a` itself, ten standard deviations off."""

    def __init__(self) -> None:
        super().__init__({"a": 3.0}, 5)
        self.parameters = (*self.parameters, Parameter("own", "N", 0.0, 0.3, known=True))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        plain = Jobs(np.delete(jobs.points, 1, axis=1), jobs.point, jobs.window, jobs.states)
        return super().residuals(hypothesis, plain) + 0.3 * points[:, 1, None] * self.shapes["a"][jobs.window]


def test_what_the_machine_takes_up_is_not_what_an_effect_closes() -> None:
    """Fitted with its own priors the machine leaves little of what it leaves in a race, whatever is beside it."""
    model = Yielding()
    search = Search(model, Criteria())
    begun = search.fits.begun
    beside = Problem(model, model.library["beat"][0]).point(np.append(begun.place.z, 0.0), np.zeros((8, 0)))
    grown = search.fits.fit(beside)
    assert grown.place.level(model) < 1.1 < 1.8 < begun.place.level(model)
    assert not search._closes_half(grown, begun)


def test_a_set_is_tried_once() -> None:
    """The better one of two fits of a set."""
    search = Search(Chord({"tone": 10.0}, 5), Criteria())
    places = [Problem(search.model, search.model.library["tone"][0]).point(z, np.zeros((8, 0))) for z in (
        np.array([0.0, 8.0]), np.array([0.0, 10.0])
    )]  # fmt: skip
    poor, good = (search.fits.kept(place, True) for place in places)
    assert search._of_each([poor, good]) == [good]


@pytest.mark.parametrize("renewed", [True, False])
def test_starts_race_anew_from_a_machine_that_was_found_out(renewed: bool, monkeypatch) -> None:
    """First `near` wins, which the machine's own play is as good as; `b` shows only once that play is fitted."""
    search = Search(Loose(), Criteria(rivals=1))
    if not renewed:
        monkeypatch.setattr(Search, "_led", lambda search, key, careful: search._races.get(key))
    assert search.run().best.place.hypothesis.names == (("b",) if renewed else ())


def test_an_effect_enters_only_by_the_margin() -> None:
    """A tone of 0.3 wins some 20: enough at a margin of 10, too little at 30."""
    model = Chord({"tone": 0.3}, 5)
    assert selected(model, margin=8.0) == {"tone"}
    assert selected(model, margin=60.0) == set()


@pytest.mark.parametrize(("unknowns", "names"), [(0, {"tone"}), (3, set())])
def test_an_effect_pays_for_what_it_sets_free_in_every_window(unknowns: int, names: set, monkeypatch) -> None:
    """The same tone; 3 unknowns in each of 8 windows explain as much of noise alone."""
    monkeypatch.setattr(Chord, "freed", lambda self, hypothesis: unknowns * len(hypothesis.effects))
    assert selected(Chord({"tone": 0.3}, 5), margin=8.0) == names


def off(model: Chord) -> Chord:
    """The chord with 0.2 N more, 2 standard deviations of its offset."""
    model.y = model.y + 0.2
    return model


@pytest.mark.parametrize(("wins", "first"), [(25.0, "a"), (15.0, "b")])
def test_rivals_are_compared_as_a_race_leaves_them(wins: float, first: str, monkeypatch) -> None:
    """`b` leads by 40 after a few steps. Its fit to the end wins more, as the machine's offset moves then, whatever is
    beside it; `a`, which is right, has come only to a hundredth of its size."""
    model = off(Chord({"a": 0.5}, 5, ("a", "b")))

    def raced(model: Chord, base: Point, *given: object, **more: object) -> list[Point]:
        found = []
        for name, size, won in (("b", 0.0, 40.0), ("a", 0.005, wins)):
            place = Problem(model, model.library[name][0]).point(np.append(base.z, size), np.zeros((8, 0)))
            found.append(replace(place, cost=base.cost - won))
        return found

    monkeypatch.setattr("discrepancy.search.race", raced)
    search = Search(model, Criteria())
    assert search._added(search.fits.begun)[0].name == first


def test_where_nothing_is_found_the_machine_is_fitted_with_its_own_priors() -> None:
    assert Search(off(Chord({}, 5)), Criteria()).run().best.place.z[0] == pytest.approx(1.6, abs=0.3)


def test_a_place_of_a_race_is_compared_by_what_it_costs_outside() -> None:
    """The known fit is poor; the race's place is at the right offset, for which a race charges a hundred times."""
    search = Search(off(Chord({}, 5)), Criteria())
    states = np.zeros((8, 0))
    search.fits.kept(Problem(search.model, NONE).point(np.zeros(1), states), True)
    raced = Problem(search.model, NONE, caution=racing.CAUTION).point(np.array([1.8]), states)
    assert search.fits.fit(raced).place.z[0] > 1.0


def test_an_alike_effect_that_is_clearly_better_takes_the_place() -> None:
    """What was selected is `tone`, which is known to look like `half`, which no race has led."""
    model = Chord({"tone": 9.0, "rest": 9.0}, 5, ("tone", "half"))
    model.library["tone"] = (effect_like("tone", alike=("half",)),)
    search = Search(model, Criteria(most=1))
    place = Problem(model, model.library["tone"][0]).point(np.array([0.0, 9.0]), np.zeros((8, 0)))
    search._races["none", ""] = search._races["", ""] = Race(search.fits.begun.place.cost, [place])
    assert search._compared(search.fits.fit(place))[0].name == "half"


@pytest.mark.parametrize(("largest", "taken"), [(9.0, "twin"), (90.0, "tone")])
def test_what_a_bound_holds_gives_way_to_what_is_as_good(largest: float, taken: str) -> None:
    """`tone` may be 9 N at most where 9.2 N act, which leaves 16 in score more than its twin, and has not lost by half
    the margin where no bound holds it."""
    model = Chord({"tone": 9.2}, 5, ("tone", "twin"))
    model.library["tone"] = (effect_like("tone", alike=("twin",), largest=largest),)
    search = Search(model, Criteria(most=1, margin=60.0))
    place = Problem(model, model.library["tone"][0]).point(np.array([0.0, 9.0]), np.zeros((8, 0)))
    search._races["none", ""] = search._races["", ""] = Race(search.fits.begun.place.cost, [place])
    assert search._compared(search.fits.fit(place))[0].name == taken


def test_at_most_so_many_effects_are_selected() -> None:
    hidden = {"tone": 10.0, "beat": 9.0, "rest": 8.0}
    model = Chord(hidden, 5, ("tone", "beat", "rest"))
    assert selected(model) == set(hidden)
    assert selected(model, most=1) == {"tone"}


def test_no_further_effect_is_looked_for_at_the_noise(monkeypatch) -> None:
    added, rounds = Search._added, []
    monkeypatch.setattr(Search, "_added", lambda self, current: rounds.append(current.name) or added(self, current))
    assert selected(Chord({"tone": 10.0}, 5)) == {"tone"} and rounds == ["none"]


def improved(model: Chord, monkeypatch, **criteria: float) -> list[str]:
    """Steps that were taken to make a set better that was fitted to the end."""
    steps = []
    for step in ("_restarted", "_floated"):
        monkeypatch.setattr(Search, step, lambda self, fitted, *base, step=step: steps.append(step) or fitted)
    selected(model, **criteria)
    return steps


@pytest.mark.parametrize(("share", "steps"), [(0.5, []), (-9.0, ["_floated"])])
def test_what_wins_next_to_nothing_is_not_made_better(share: float, steps: list, monkeypatch) -> None:
    monkeypatch.setattr("discrepancy.search._HALF_WAY", share)
    assert improved(Chord({}, 5), monkeypatch) == steps


@pytest.mark.parametrize(
    ("at_noise", "much", "bent", "looks_on"),
    [(0.2, 1.0, 2.9, True), (0.2, 1.0, 3.1, False), (1.0, 1.0, 2.9, False), (0.2, 0.3, 3.1, True)],
)
def test_a_better_start_is_looked_for_where_a_fit_stopped_short(
    at_noise: float, much: float, bent: float, looks_on: bool, monkeypatch
) -> None:
    """`rest`, which is not in the library, leaves half the noise in mean square; the machine's one parameter is said to
    be bent by 3."""
    monkeypatch.setattr(Point, "bent", lambda place, model: 3.0)
    chord = Chord({"tone": 10.0, "rest": 1.0}, 5)
    steps = improved(chord, monkeypatch, at_noise=at_noise, much=much, bent=bent)
    assert ("_restarted" in steps) == looks_on


def test_a_machine_is_bent_by_what_was_known_of_it() -> None:
    """The mean square of two changes, without those of a record and of what nothing was known of."""
    model = Chord({}, 5)
    model.parameters = (
        Parameter("a", "-", 0.0, 0.1, known=True), Parameter("b", "-", 0.0, 0.1, known=True),
        Parameter("free", "-", 0.0, 0.1), Parameter("load", "-", 0.0, 0.1, known=True, record=0),
    )  # fmt: skip
    z = np.array([1.0, 3.0, 9.0, 9.0])
    place = Point(NONE, z, np.zeros((1, 0)), np.ones(1), 0.0)
    assert place.bent(model) == 5.0
    model.parameters = model.parameters[2:]
    assert Point(NONE, z[2:], np.zeros((1, 0)), np.ones(1), 0.0).bent(model) == 0.0


@pytest.mark.parametrize(("spent", "goes_on"), [(19.0, True), (21.0, False)])
def test_half_of_the_time_given_is_kept_for_the_judgement(spent: float, goes_on: bool, monkeypatch) -> None:
    search = Search(Chord({}, 5), Criteria(seconds=40.0))
    now = time.process_time()
    monkeypatch.setattr("discrepancy.search.time.process_time", lambda: now + spent)
    assert search.in_time() == goes_on


@pytest.mark.parametrize(("memory", "expected"), [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)])
def test_noise_with_a_memory_tells_less(memory: float, expected: float) -> None:
    """Seed 1: (1 + ρ)/(1 - ρ) samples of an AR(1) noise tell as much as one of white noise."""
    rows = np.random.default_rng(1).standard_normal((12, 1500))
    for k in range(1, rows.shape[1]):
        rows[:, k] += memory * rows[:, k - 1]
    assert autocorrelation_time(rows, np.full(12, 1500)) == pytest.approx(expected, rel=0.15)


def test_an_effect_begins_anew_that_a_set_has_more_than_the_one_before(monkeypatch) -> None:
    """Whatever the order in which a set was first fitted."""
    search = Search(Chord({"tone": 10.0, "beat": 6.0}, 5), Criteria())
    library, begun = search.model.hypotheses(), []
    (tone,), (beat,) = library["tone"], library["beat"]
    problem = Problem(search.model, together(tone, beat))
    both = search.fits.fit(problem.point(np.array([0.0, 10.0, 6.0]), np.zeros((8, 0))))
    monkeypatch.setattr(
        "discrepancy.search.restarted", lambda model, place, k, *given: begun.append(place.hypothesis.names[k]) or place
    )
    for name in ("tone", "beat"):
        base = Problem(search.model, library[name][0]).point(np.array([0.0, 8.0]), np.zeros((8, 0)))
        search._restarted(both, search.fits.kept(base, True))
    assert begun == ["beat", "tone"]


def test_what_leads_a_later_race_is_tried_in_the_place_of_an_effect_too(monkeypatch) -> None:
    asked = []

    def raced(model: Chord, place: Point, others: list[Hypothesis], *given: object, **more: object) -> list[Point]:
        asked.append([one.name for one in others])
        return []

    monkeypatch.setattr("discrepancy.search.race", raced)
    search = Search(Chord({"tone": 10.0}, 5, ("tone", "a", "b")), Criteria())
    library = search.model.hypotheses()

    def led(name: str) -> Race:
        place = Problem(search.model, library[name][0]).point(np.array([0.0, 5.0]), np.zeros((8, 0)))
        return Race(9.0, [place])

    base = search.fits.begun
    for name in ("a", "b"):
        search._races[f"a set before {name}", ""] = led(name)
        search._raced(base, "tone")
    search._raced(base, "tone")
    assert asked == [["a"], ["b"]]


@pytest.mark.parametrize(("much", "begun"), [(0.3, ["tone", "beat"]), (1.0, [])])
def test_what_came_first_begins_anew_once_the_others_are_there(much: float, begun: list, monkeypatch) -> None:
    """`rest`, which is not in the library, leaves half the noise in mean square."""
    search = Search(Chord({"tone": 10.0, "beat": 6.0, "rest": 1.0}, 5), Criteria(much=much))
    library, asked = search.model.hypotheses(), []
    problem = Problem(search.model, together(library["tone"][0], library["beat"][0]))
    place = problem.point(np.array([0.0, 10.0, 6.0]), np.zeros((8, 0)))
    poor = search.fits.kept(problem.point(np.array([0.0, 9.0, 6.0]), np.zeros((8, 0))), True)

    def restarted(model: Chord, at: Point, k: int, *given: object) -> Point:
        asked.append(at.hypothesis.names[k])
        return place if asked[-1] == "beat" else at

    monkeypatch.setattr("discrepancy.search.restarted", restarted)
    floated = search._floated(poor)
    assert asked[: len(begun)] == begun and bool(asked) == bool(begun)
    assert (floated.place.cost < poor.place.cost) == bool(begun)
