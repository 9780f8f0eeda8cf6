"""The race for starts, and what begins anew: each step is needed by a case that goes wrong without it."""

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
import pytest

from discrepancy import race as racing
from discrepancy.criteria import Criteria
from discrepancy.fit import Fit
from discrepancy.fits import Fits
from discrepancy.jobs import Jobs
from discrepancy.linearised import Start, neighbours
from discrepancy.model import NONE, Hypothesis, Parameter
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.race import race, restarted
from discrepancy.search import Search
from tests.discrepancy.toy import Chord, Stateless


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
        monkeypatch.setattr(racing, "_left", lambda around, starts, windows: [s.place.cost for s in starts])
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
    """Both judges of a race prefer the smallest rate, and the largest is right."""
    much = 1.0 if wide else 1e9
    monkeypatch.setattr(racing, "_proposals", lambda around, leader: [])
    monkeypatch.setattr(racing, "_left", lambda around, starts, windows: [start.values[0] for start in starts])
    monkeypatch.setattr(racing, "_promised", lambda start: start.values[0])
    model = Waves(8.0)
    monkeypatch.setattr(model, "hypotheses", lambda residual=None: {"wave": (model.wave,)}, raising=False)
    found = Search(model, Criteria(margin=4.0, fits=1, much=much)).run().best
    assert (found.name == "wave") == wide and (found.place.level(model) < 1.2) == wide


@pytest.mark.parametrize("goes_on", [True, False])
def test_what_closes_little_does_not_end_the_search_for_what_closes_much(goes_on: bool, monkeypatch) -> None:
    """`a`, a quarter of what is hidden, leads the race; beside it little is left. A wide race finds `b`, too."""

    def raced(model: Chord, base: Point, effects, criteria: Criteria, *, wide: bool = False, **more: object) -> list:
        return race(model, base, [one for one in effects if wide or one.name == "a"], criteria)

    monkeypatch.setattr("discrepancy.search.race", raced)
    if not goes_on:
        monkeypatch.setattr(Search, "_closes_half", lambda self, grown, current: grown is not current)
    found = Search(Chord({"a": 0.55, "b": 0.9}, 5, ("a", "b")), Criteria(much=1.0)).run()
    assert set(found.best.place.hypothesis.names) == ({"a", "b"} if goes_on else {"a"})


def sizes_of(starts: list[Start]) -> list[float]:
    return [start.values[0] for start in starts]


def promising(*promised: float) -> list[Start]:
    """Starts of the sizes 1, 2, 4 ... of one effect, with these promises."""
    sizes = [2.0**k for k in range(len(promised))]
    wave = Hypothesis("wave", (Parameter("wave.size", "N", 0.0, 1.0),), {}, tuple((size,) for size in sizes))
    nowhere = Problem(Chord({}, 5), NONE).point(np.zeros(1), np.zeros((8, 0)))
    return [
        Start(wave, (size,), dataclasses.replace(nowhere, cost=cost))
        for size, cost in zip(sizes, promised, strict=True)
    ]


def test_a_wide_race_begins_at_no_size_below_the_most_promising_one() -> None:
    """The smallest promise nearly what the third does, as they are next to none."""
    assert sizes_of(racing._apart(promising(1.2, 1.1, 1.0, 2.0, 3.0, 9.0, 20.0))) == [4.0, 16.0, 64.0]


def test_a_smaller_size_elsewhere_is_a_start_of_its_own() -> None:
    """Sizes 1 and 4 at two phases far apart: the smaller one is nearer to nothing only at the phase of the other."""
    size, phase = Parameter("wave.size", "N", 0.0, 1.0), Parameter("wave.phase", "rad", 0.0, 1.0)
    places = tuple((size, phase) for size in (1.0, 2.0, 4.0) for phase in (0.0, 1.0, 2.0, 3.0))
    wave = Hypothesis("wave", (size, phase), {}, places)
    nowhere = Problem(Chord({}, 5), NONE).point(np.zeros(1), np.zeros((8, 0)))
    large, same, other = (Start(wave, values, nowhere) for values in ((4.0, 0.0), (1.0, 0.0), (1.0, 3.0)))
    assert same.smaller(large) and not other.smaller(large) and not large.smaller(same)


@pytest.mark.parametrize(("fits", "sizes"), [(3, [2.0, 8.0, 4.0]), (8, [2.0, 8.0, 4.0, 1.0])])
def test_an_effect_begins_anew_from_sizes_below_the_most_promising_one_last(fits, sizes, monkeypatch) -> None:
    begun = begun_anew(promising(1.1, 1.0, 3.0, 2.0), Criteria(fits=fits), monkeypatch)
    assert sizes_of(begun) == sizes


def test_an_effect_begins_anew_by_what_its_starts_leave_in_all_windows(monkeypatch) -> None:
    """The size that promises least leaves least."""
    starts = promising(1.1, 1.0, 3.0, 2.0)
    left = {id(start): value for start, value in zip(starts, (4.0, 3.0, 2.0, 1.0), strict=True)}
    judged: list[list[int]] = []
    begun = begun_anew(starts, Criteria(), monkeypatch, lambda start: left[id(start)], judged)
    assert begun[0] is starts[3]
    assert judged == [list(range(8))]


def test_an_effect_begins_anew_from_the_best_starts_of_all_too(monkeypatch) -> None:
    """Size 1 at the phase of the most promising start is smaller than that, so that another phase stands for it."""
    size, phase = Parameter("wave.size", "N", 0.0, 1.0), Parameter("wave.phase", "rad", 0.0, 1.0)
    places = tuple((size, phase) for size in (1.0, 2.0, 4.0, 8.0) for phase in (0.0, 1.0, 2.0, 3.0))
    wave = Hypothesis("wave", (size, phase), {}, places)
    nowhere = Problem(Chord({}, 5), NONE).point(np.zeros(1), np.zeros((8, 0)))
    at = {(8.0, 0.0): 1.0, (1.0, 1.0): 2.0, (1.0, 3.0): 3.0}
    starts = [Start(wave, values, dataclasses.replace(nowhere, cost=at.get(values, 9.0))) for values in places]
    begun = [start.values for start in begun_anew(starts, Criteria(), monkeypatch)]
    assert begun[:3] == [(8.0, 0.0), (1.0, 3.0), (1.0, 1.0)]


def begun_anew(starts, criteria, monkeypatch, leaves=lambda start: start.place.cost, judged=None) -> list[Start]:
    """The starts of the last effect that are fitted, given what each leaves; windows in which they are judged are added
    to `judged`."""
    begun: list[Start] = []

    def left(around, given, windows) -> list[float]:
        if judged is not None:
            judged.append(windows.tolist())
        return [leaves(start) for start in given]

    monkeypatch.setattr(racing.Linearised, "starts", lambda self, effect, values: starts)
    monkeypatch.setattr(racing, "_left", left)
    monkeypatch.setattr(racing, "_unmoved", lambda start, rest: start)
    monkeypatch.setattr(racing, "_fitted", lambda model, given, finished, in_time: begun.extend(given) or [None])
    model = Chord({}, 5)
    restarted(model, Problem(model, model.library["tone"][0]).point(np.zeros(2), np.zeros((8, 0))), 0, criteria)
    return begun


def test_the_leaders_of_a_wide_race_begin_anew(monkeypatch) -> None:
    """What leads is no better than none, and stuck; from the right size the fit finds it."""
    model = Bent(9.0)
    monkeypatch.setattr("discrepancy.search.race", lambda model, *given, **more: [model.stuck()])
    search = Search(model, Criteria(margin=4.0))
    monkeypatch.setattr(search, "wins", lambda *given: False)
    (narrow,), (wide,) = (search._added(search.fits.begun, wide=wide) for wide in (False, True))
    assert narrow.place.level(model) > 3.3 > wide.place.level(model)


@pytest.mark.parametrize("restarts", [True, False])
def test_the_last_effect_begins_anew_from_each_size(restarts: bool, monkeypatch) -> None:
    if not restarts:
        monkeypatch.setattr(Search, "_restarted", lambda self, fitted, base: fitted)
    model = Bent(9.0)
    monkeypatch.setattr(
        "discrepancy.search.race",
        lambda model, place, *given, **more: [] if place.hypothesis.effects else [model.stuck()],
    )
    found = Search(model, Criteria(margin=4.0)).run().best.place
    assert (found.level(model) < 3.3) == restarts


def test_nothing_begins_anew_once_the_time_is_over(monkeypatch) -> None:
    model = Bent(9.0)
    search = Search(model, Criteria(margin=4.0))
    stuck = search.fits.fit(model.stuck())
    monkeypatch.setattr(search, "in_time", lambda: False)
    monkeypatch.setattr("discrepancy.search.restarted", lambda *given: pytest.fail("an effect begins anew"))
    assert search._restarted(stuck, search.fits.begun) is stuck


def test_all_rivals_begin_anew(monkeypatch) -> None:
    """The best of a race stands before the right one, which is stuck."""
    model = Bent(9.0)
    beat = Problem(model, model.beat).point(np.array([0.0, 0.0, 3.0]), np.zeros((4, 0)))
    monkeypatch.setattr("discrepancy.search.race", lambda *given, **more: [beat, model.stuck()])
    search = Search(model, Criteria(margin=4.0))
    first, second = search._added(search.fits.begun)
    assert (first.name, second.name) == ("wave", "beat") and first.place.level(model) < 3.3


@pytest.mark.parametrize("wide", [True, False])
def test_each_of_some_rivals_begins_anew_that_has_bent_the_machine(wide: bool, monkeypatch) -> None:
    """Neither leaves `much`; the second alone is said to have bent the machine."""
    model = Bent(9.0)
    beat = Problem(model, model.beat).point(np.array([0.0, 0.0, 3.0]), np.zeros((4, 0)))
    monkeypatch.setattr("discrepancy.search.race", lambda *given, **more: [beat, model.stuck()])
    monkeypatch.setattr(Point, "bent", lambda place, model: 2.1 if place.hypothesis.name == "wave" else 1.9)
    begun = []
    monkeypatch.setattr(Search, "_restarted", lambda self, fitted, base: begun.append(fitted.name) or fitted)
    search = Search(model, Criteria(margin=4.0, much=1e9))
    search._added(search.fits.begun, wide=wide)
    assert begun == ["wave"]


@pytest.mark.parametrize(("barred", "found"), [((), "wave"), (("wave",), "none")])
def test_a_set_that_is_suggested_is_taken_where_it_is_clearly_better(barred, found: str, monkeypatch) -> None:
    """The search itself finds nothing; of two that are suggested the first one explains all."""
    model = Bent(9.0)
    monkeypatch.setattr(Search, "_added", lambda self, current, *, wide=False: [])

    def suggest(fits: Fits) -> list[Point]:
        right, wrong = (np.array([0.0, 0.0, rate]) for rate in (9.1, 15.0))
        return [Problem(fits.model, model.wave).point(z, np.zeros((4, 0))) for z in (right, wrong)]

    assert Search(model, Criteria(margin=4.0, much=1e9), suggest).run(barred).best.name == found


def test_an_effect_begins_anew_from_the_nominal_machine() -> None:
    """The machine is bent by three standard deviations, from where its own motion, too, does not find back."""
    model = Bent(9.0, slips=True)
    place = Problem(model, model.wave).point(np.array([0.0, 3.0, 2.0]), np.zeros((4, 0)))
    assert restarted(model, place, len(place.hypothesis.effects) - 1, Criteria()).level(model) < 1.2


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


def test_a_start_that_leads_twice_proposes_once(monkeypatch) -> None:
    proposed = []
    of = racing._proposals
    monkeypatch.setattr(racing, "_proposals", lambda around, leader: proposed.append(leader) or of(around, leader))
    model = Chord({"tone": 10.0}, 5)
    base = Problem(model, NONE).point(np.zeros(1), np.zeros((8, 0)))
    race(model, base, [h for hs in model.library.values() for h in hs], Criteria())
    assert len(proposed) == len(set(proposed)) > 1


@pytest.mark.parametrize(
    ("sizes", "proposed"),
    [
        ((2.0, 8.0), [(4.0, 1.0), (2.0, 0.5), (2.0, 1.5)]),
        ((-2.0, 2.0), [(2.0, 0.5), (-2.0, 0.5), (2.0, 1.5), (-2.0, 1.5)]),
    ],
)
def test_beside_a_leader_the_other_sign_is_proposed_where_the_library_has_both(sizes: tuple, proposed: list) -> None:
    """Size 2 at the place 1: halfway to its neighbours, and there with the other sign."""

    class Around:
        def starts(self, effect: Hypothesis, values: list) -> list:
            return values

    size, place = Parameter("wave.size", "N", 0.0, 1.0), Parameter("wave.place", "m", 0.0, 1.0)
    places = tuple((size, place) for size in sizes for place in (0.0, 1.0, 2.25))
    wave = Hypothesis("wave", (size, place), {}, places)
    nowhere = Problem(Chord({}, 5), NONE).point(np.zeros(1), np.zeros((8, 0)))
    found = racing._proposals(Around(), Start(wave, (2.0, 1.0), nowhere))
    assert [*found] == [pytest.approx(one) for one in proposed]


@pytest.mark.parametrize(("count", "sizes"), [(2, [1.0, 4.0]), (9, [1.0, 4.0, 16.0])])
def test_of_starts_side_by_side_in_the_library_s_list_the_better_one_races(count: int, sizes: list[float]) -> None:
    starts = promising(1.0, 1.1, 1.2, 1.3, 1.4)
    assert sizes_of(racing._best_of_each(starts, count)) == sizes
    other = dataclasses.replace(starts[1], effect=dataclasses.replace(starts[1].effect, fixed={"order": 2.0}))
    assert racing._best_of_each([starts[0], other], 2) == [starts[0], other], "another choice is no neighbour"


@pytest.mark.parametrize(
    ("begun", "finished"), [(-math.inf, ["tone", "beat"]), (None, ["tone"]), (0.0, ["tone", "beat"])]
)
def test_after_a_few_steps_only_rivals_of_the_first_go_on(
    begun: float | None, finished: list[str], monkeypatch
) -> None:
    """A tone is hidden, and a beat wins next to nothing; where the first one wins nothing either, both go on."""
    model, more = Chord({"tone": 5.0}, 5), []
    problem = Problem(model, NONE, caution=racing.CAUTION)
    base = problem.point(np.zeros(1), np.zeros((8, 0)))
    around = racing.Linearised(model, base, racing.CAUTION)
    starts = [start for name in ("tone", "beat") for start in around.starts(effect(name, 3.0), [(3.0,)])]
    fit = racing.fit

    def counted(problem: Problem, place: Point, *, steps: int) -> Fit:
        if steps == racing._MORE:
            more.append(place.hypothesis.names[-1])
        return fit(problem, place, steps=steps)

    monkeypatch.setattr(racing, "fit", counted)
    racing._fitted(model, starts, 2, begun=base.cost if begun is None else begun)
    assert more == finished
