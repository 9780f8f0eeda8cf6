"""Stepwise selection and the race for starts: each step is needed by a case that goes wrong without it. Seed 5."""

import time
from collections.abc import Mapping

import numpy as np
import pytest

from discrepancy import race as racing
from discrepancy.criteria import Criteria
from discrepancy.dispersion import autocorrelation_time
from discrepancy.linearised import neighbours
from discrepancy.model import NONE, Hypothesis, Jobs, Parameter
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import race, restarted
from discrepancy.search import Search
from tests.discrepancy.toy import Chord, Stateless
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
    assert set(Search(model, Criteria()).run().best.place.hypothesis.names) == ({"near", "far"} if ahead else set())
    assert Search(model, Criteria(much=1.6)).run().best.name == "none"


def test_an_effect_that_looks_alike_is_not_added_to_a_set_that_has_it(monkeypatch) -> None:
    """`tone` looks like `beat`, which stands beside it: without `tone` the set is not tried with a second `beat`."""
    model = Chord({"tone": 10.0, "beat": 9.0}, 5)
    model.library["tone"] = (effect_like("tone", alike=("beat",)),)
    monkeypatch.setattr(Search, "_rivals", lambda *_: True)
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


class Unforgetting(dict):
    """What races found, and keeps."""

    def pop(self, *_: object) -> None:
        return None


@pytest.mark.parametrize("renewed", [True, False])
def test_starts_race_anew_from_a_machine_that_was_found_out(renewed: bool) -> None:
    """First `near` wins, which the machine's own play is as good as; `b` shows only once that play is fitted."""
    search = Search(Loose(), Criteria(rivals=1))
    if not renewed:
        search._races = Unforgetting()
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
    search._races["none", ""] = search._races["", ""] = [place]
    assert search._compared(search.fits.fit(place))[0].name == "half"


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
        monkeypatch.setattr(Search, step, lambda self, fitted, step=step: steps.append(step) or fitted)
    selected(model, **criteria)
    return steps


@pytest.mark.parametrize(("share", "steps"), [(0.5, []), (-9.0, ["_floated"])])
def test_what_wins_next_to_nothing_is_not_made_better(share: float, steps: list, monkeypatch) -> None:
    monkeypatch.setattr("discrepancy.search._HALF_WAY", share)
    assert improved(Chord({}, 5), monkeypatch) == steps


@pytest.mark.parametrize(("much", "looks_on"), [(0.3, True), (1.0, False)])
def test_no_better_start_is_looked_for_where_little_is_left(much: float, looks_on: bool, monkeypatch) -> None:
    """`rest`, which is not in the library, leaves half the noise in mean square."""
    steps = improved(Chord({"tone": 10.0, "rest": 1.0}, 5), monkeypatch, much=much)
    assert ("_restarted" in steps) == looks_on


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


def effect(name: str, *starts: float) -> Hypothesis:
    return Hypothesis(name, (Parameter(f"{name}.size", "-", 0.0, 1.0, -90.0, 90.0),), {}, tuple((s,) for s in starts))


class Shaken(Stateless):
    """y = 4 sin(5 (1 + rate) x + s) in 8 windows of 60 samples, noise 1, the start state s of each window unknown.

    An effect `shake` changes the rate, so that every window starts elsewhere: linearised around the states of the base
    it promises little. An effect `patch` adds to two windows that are not among the worst.
    """

    def __init__(self, rate: float, patch: float, spoilt: float = 0.0) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.1, known=True),)
        self.counts, self.groups = np.full(8, 60), np.zeros(8, dtype=np.int64)
        self.x = np.linspace(0.0, 24.0, 480).reshape(8, 60)
        self.patch = np.cos(9.0 * self.x) * np.isin(np.arange(8), (6, 7))[:, None]
        self.y = 4.0 * np.sin(5.0 * (1.0 + rate) * self.x + 0.4) + patch * self.patch
        self.y += spoilt * np.sin(13.0 * self.x) * (np.arange(8) < 3)[:, None]
        self.y += np.random.default_rng(5).standard_normal((8, 60))
        self.library = {
            "shake": (effect("shake", 0.02, 0.05, 0.1),),
            "patch": (effect("patch", 3.0, 9.0),),
            "wave": (effect("wave", 2.0, 3.0, 5.0),),
        }

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        return self.library

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points, x = jobs.points[jobs.point], self.x[jobs.window]
        size = dict(zip(hypothesis.names, points[:, 1:].T, strict=True))
        rate = size.get("shake", np.zeros(len(points)))[:, None]
        made = 0.1 * points[:, :1] + 4.0 * np.sin(5.0 * (1.0 + rate) * x + jobs.states)
        if "patch" in size:
            made = made + size["patch"][:, None] * self.patch[jobs.window]
        if "wave" in size:
            made = made + size["wave"][:, None] * np.sin(5.0 * x + 2.0)
        return made - self.y[jobs.window]

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.linspace(-np.pi, np.pi, 13)[:, None]


def base(model: Shaken) -> Point:
    problem = Problem(model, NONE)
    return problem.searched(problem.point(np.zeros(1), np.zeros((8, 1))))


@pytest.mark.parametrize("judged", [True, False])
def test_the_worst_windows_see_what_the_linearisation_overlooks(judged: bool, monkeypatch) -> None:
    if not judged:
        monkeypatch.setattr(racing, "_left", lambda around, starts, windows: [s.promised for s in starts])
    model = Shaken(0.1, 0.0)
    found = race(model, base(model), [h for of in model.library.values() for h in of], Criteria(fits=1))
    assert (found[0].hypothesis.name == "shake") == judged


@pytest.mark.parametrize("judged", [True, False])
def test_the_linearisation_sees_what_spares_the_worst_windows(judged: bool, monkeypatch) -> None:
    if not judged:
        monkeypatch.setattr(racing, "_promised", lambda start: 0.0)
        monkeypatch.setattr(racing, "_in_turns", lambda a, b: list(a)[:1])
    model = Shaken(0.0, 5.0, spoilt=20.0)
    found = race(model, base(model), [h for of in model.library.values() for h in of], Criteria(fits=2))
    assert (found[0].hypothesis.name == "patch") == judged


@pytest.mark.parametrize(
    ("value", "ladder", "expected"),
    [
        (2.0, [1.0, 2.0, 8.0], [2.0**0.5, 4.0]),
        (0.0, [-1.0, 0.0, 1.0], [-0.5, 0.5]),
        (8.0, [1.0, 2.0, 8.0], [4.0]),
        (3.0, [3.0], [3.0 * 0.5**0.5, 3.0 * 2.0**0.5]),
        (8.0 * (1.0 - 1e-15), [1.0, 2.0, 8.0], [4.0]),
    ],
)
def test_proposals_lie_halfway_to_the_neighbours(value: float, ladder: list, expected: list) -> None:
    assert neighbours(value, ladder) == pytest.approx(expected)


class Waves(Stateless):
    """y = 5 sin(rate x) in 4 windows of 50 samples, noise 1; the library's list of rates has a gap at the true one."""

    def __init__(self, rate: float) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.1, known=True),)
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 10.0, 200).reshape(4, 50)
        self.y = 5.0 * np.sin(rate * self.x) + np.random.default_rng(4).standard_normal((4, 50))
        rates = Parameter("wave.rate", "rad/s", 2.0, 1.0, 0.5, 20.0)
        self.wave = Hypothesis("wave", (rates,), {}, ((2.0,), (4.2,), (8.0,)))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        made = 0.1 * points[:, :1] - self.y[jobs.window]
        if hypothesis.parameters:
            rate = np.array([self.wave.parameters[0].value(z) for z in points[:, 1]])
            made = made + 5.0 * np.sin(rate[:, None] * self.x[jobs.window])
        return made


@pytest.mark.parametrize("proposes", [True, False])
def test_a_place_in_a_gap_of_the_list_is_found_by_proposals(proposes: bool, monkeypatch) -> None:
    if not proposes:
        monkeypatch.setattr(racing, "_proposals", lambda around, leader: [])
    model = Waves(2.9)
    start = Problem(model, NONE).point(np.zeros(1), np.zeros((4, 0)))
    (place,) = race(model, start, [model.wave], Criteria())
    assert (place.level(model) < 1.2) == proposes


def test_a_race_whose_time_is_over_fits_one_start() -> None:
    model = Chord({"tone": 10.0}, 5)
    base = Problem(model, NONE).point(np.zeros(1), np.zeros((8, 0)))
    effects = [h for hypotheses in model.hypotheses().values() for h in hypotheses]
    for in_time, count in ((lambda: True, len(effects)), (lambda: False, 1)):
        assert len(race(model, base, effects, Criteria(), in_time=in_time)) == count


@pytest.mark.parametrize("wide", [True, False])
def test_before_it_gives_up_the_search_fits_effects_from_sizes_apart(wide: bool, monkeypatch) -> None:
    """Both judges of a race prefer the largest rate, and the smallest is right."""
    much = 1.0 if wide else 1e9
    monkeypatch.setattr(racing, "_proposals", lambda around, leader: [])
    monkeypatch.setattr(racing, "_left", lambda around, starts, windows: [-start.values[0] for start in starts])
    monkeypatch.setattr(racing, "_promised", lambda start: -start.values[0])
    model = Waves(2.0)
    monkeypatch.setattr(model, "hypotheses", lambda residual=None: {"wave": (model.wave,)}, raising=False)
    found = Search(model, Criteria(margin=4.0, fits=1, much=much)).run().best
    assert (found.name == "wave") == wide and (found.place.level(model) < 1.2) == wide


@pytest.mark.parametrize("restarts", [True, False])
def test_the_last_effect_begins_anew_from_each_size(restarts: bool, monkeypatch) -> None:
    if not restarts:
        monkeypatch.setattr(Search, "_restarted", lambda self, fitted: fitted)
    model = Bent(9.0)
    monkeypatch.setattr("discrepancy.search.race", lambda model, *given, **more: [model.stuck()])
    found = Search(model, Criteria(margin=4.0)).run().best.place
    assert (found.level(model) < 3.3) == restarts


def test_all_rivals_begin_anew(monkeypatch) -> None:
    """The best of a race stands before the right one, which is stuck."""
    model = Bent(9.0)
    beat = Problem(model, model.beat).point(np.array([0.0, 0.0, 3.0]), np.zeros((4, 0)))
    monkeypatch.setattr("discrepancy.search.race", lambda *given, **more: [beat, model.stuck()])
    search = Search(model, Criteria(margin=4.0))
    first, second = search._added(search.fits.begun)
    assert (first.name, second.name) == ("wave", "beat") and first.place.level(model) < 3.3


def test_an_effect_begins_anew_from_the_nominal_machine() -> None:
    """The machine is bent by three standard deviations, from where its own motion, too, does not find back."""
    model = Bent(9.0, slips=True)
    place = Problem(model, model.wave).point(np.array([0.0, 3.0, 2.0]), np.zeros((4, 0)))
    assert restarted(model, place, Criteria()).level(model) < 1.2


class Bent(Stateless):
    """y = 5 sin(rate x) + 4 sin(2 x), noise 1, in 4 windows of 50 samples: fits of the rate stop at the next hill. A
    machine that `slips` moves by 4 sin((2 + 0.7 slip) x) of its own."""

    def __init__(self, rate: float, slips: bool = False) -> None:
        self.slips = slips
        self.parameters = (
            Parameter("offset", "-", 0.0, 0.1, known=True), Parameter("slip", "-", 0.0, 1.0, known=True),
        )  # fmt: skip
        self.counts, self.groups = np.full(4, 50), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 10.0, 200).reshape(4, 50)
        self.y = 5.0 * np.sin(rate * self.x) + 4.0 * np.sin(2.0 * self.x)
        self.y += np.random.default_rng(4).standard_normal((4, 50))
        self.wave = Hypothesis("wave", (Parameter("wave.rate", "rad/s", 0.0, 1.0, 0.0, 20.0),), {}, ((2.0,), (9.1,)))
        self.beat = Hypothesis("beat", (Parameter("beat.size", "-", 0.0, 1.0),), {}, ((3.0,),))

    def stuck(self) -> Point:
        problem = Problem(self, self.wave)
        return problem.point(np.array([0.0, 0.0, 2.0]), np.zeros((4, 0)))

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {"wave": (self.wave,), "beat": (self.beat,)}

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        made = 0.1 * points[:, :1] - self.y[jobs.window]
        if self.slips:
            made = made + 4.0 * np.sin((2.0 + 0.7 * points[:, 1:2]) * self.x[jobs.window])
        if hypothesis.name == "wave":
            made = made + 5.0 * np.sin(points[:, 2:] * self.x[jobs.window])
        if hypothesis.name == "beat":
            made = made + points[:, 2:] * np.sin(2.0 * self.x[jobs.window])
        return made
