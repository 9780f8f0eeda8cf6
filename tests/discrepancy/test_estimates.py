"""Intervals and weak directions, on a model whose answer is known in closed form."""

import dataclasses
import zlib

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import t

from discrepancy.dispersion import dispersion_of
from discrepancy.estimates import Estimate, Estimates, FoundEffect, estimates_of
from discrepancy.fit import Fit, fit
from discrepancy.intervals import Told
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis, Model, Parameter
from discrepancy.place import Point
from discrepancy.problem import Problem
from tests.discrepancy.toy import Chord, Stateless


class Line(Stateless):
    """y = a x + b x in 4 windows of 25 samples with noise 1: only a + b is determined, a is known to 0.1."""

    def __init__(self, a: float, rng: np.random.Generator) -> None:
        self.parameters = (
            Parameter("a", "m", 0.0, 0.1, known=True),
            Parameter("b", "m", 0.0, 1.0, low=-0.5, known=True),
        )
        self.counts, self.groups = np.full(4, 25), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 1.0, 100).reshape(4, 25)
        self.y = a * self.x + rng.standard_normal((4, 25))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        slope = np.array(
            [sum(p.value(z) for p, z in zip(self.parameters, point, strict=True)) for point in jobs.points]
        )
        return slope[jobs.point][:, None] * self.x[jobs.window] - self.y[jobs.window]


def fitted(model: Model) -> Estimates:
    return estimates_of(model, fit_of(model))


def fit_of(model: Model) -> Point:
    problem = Problem(model, NONE)
    start = problem.point(np.zeros(len(model.parameters)), np.zeros((len(model.counts), 0)))
    return fit(problem, start, steps=20).place


def test_intervals_are_those_of_least_squares_with_priors(monkeypatch) -> None:
    """Seed 8: the covariance is (Jᵀ J + P)⁻¹ in closed form, and up to a third wider, as nobody knows that the model is
    right. No parameter is bent."""
    monkeypatch.setattr("discrepancy.intervals._BENT", 1e-12)
    model = Line(0.05, np.random.default_rng(8))
    by_z = np.stack([0.1 * model.x.ravel(), model.x.ravel()])
    spread = np.sqrt(np.diag(np.linalg.inv(by_z @ by_z.T + np.eye(2)))) * [0.1, 1.0]
    for estimate, expected in zip(fitted(model).estimates, spread, strict=True):
        told = (estimate.high - estimate.low) / (2.0 * t.ppf(0.975, 3) * expected)
        assert 0.95 < told < 1.33


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Seed 9, 200 sets of data, truth drawn from the priors: 95 % or more, within 4 standard deviations of such a
    count; four windows widen the intervals though only the curvature is at work."""
    rng = np.random.default_rng(9)
    held = 0
    for _ in range(200):
        a, b = 0.1 * rng.standard_normal(), rng.standard_normal()
        if b < -0.4:
            a, b = -a, -b
        low, high = (e := fitted(Line(a + b, rng)).estimates[1]).low, e.high
        held += low <= b <= high
    assert held / 200 >= 0.89


def test_windows_that_disagree_widen_what_they_disagree_about(monkeypatch) -> None:
    """Seed 10: the slope of each of 40 windows is drawn anew, 0.5 about 1; the interval is that of their mean. No
    parameter is bent."""
    monkeypatch.setattr("discrepancy.intervals._BENT", 1e-12)
    rng = np.random.default_rng(10)
    model = Line(0.0, rng)
    model.counts, model.groups = np.full(40, 25), np.zeros(40, dtype=np.int64)
    model.x = np.tile(np.linspace(0.5, 1.0, 25), (40, 1))
    slopes = 1.0 + 0.5 * rng.standard_normal((40, 1))
    model.y = slopes * model.x + 0.1 * rng.standard_normal((40, 25))
    estimate = fitted(model).estimates[1]
    told = (estimate.high - estimate.low) / (2.0 * t.ppf(0.975, 39))
    # no less than the spread of the mean tells; what is left is correlated within a window, which counts for less, and
    # might repeat in all windows
    spread = np.hypot(slopes.std(ddof=1) / np.sqrt(40.0), 0.1)
    assert 0.9 * spread < told < 2.6 * spread


def test_windows_that_pull_apart_tell_less_than_their_curvature_says() -> None:
    """White's variance of the mean of four windows at -3, -1, 1 and 3, each of which is known to 0.2 alone:
    Σ u²·(4/3)/I² with u = 25 value and I = 100."""
    model = Apart((-3.0, -1.0, 1.0, 3.0))
    problem = Problem(model, NONE)
    told = Told(problem, problem.point(np.zeros(1), np.zeros((4, 0))))
    _, spread = told._under(1.0, 0)
    assert spread[0] == pytest.approx(np.sqrt(20.0 * 25.0**2 * 4.0 / 3.0) / 100.0, rel=1e-3)


@pytest.mark.parametrize(("missed", "windows"), [(4.0, 8), (1e3, 7)])
def test_a_window_that_was_missed_tells_next_to_nothing(missed: float, windows: int) -> None:
    """Seven of eight windows are 4 off, and tell 25 each; so does one more where it is as bad as they are."""
    model = Started((4.0, -4.0, 4.0, -4.0, 4.0, -4.0, 4.0, missed))
    problem = Problem(model, NONE)
    told = Told(problem, problem.point(np.zeros(1), np.zeros((8, 1))))
    assert told.information[0, 0] == pytest.approx(25.0 * windows, rel=0.01)
    assert told.windows == 8, "a missed window has a derivative nevertheless"


def test_what_a_bound_holds_and_nothing_was_known_of_is_as_uncertain_as_the_records_leave_it() -> None:
    """Each of four windows would have it at -12, below its bound at -9: φ is 9 and what is left is the same in all 25
    samples, so that the records tell 100/(9 τ)."""
    model = Apart((-12.0, -12.0, -12.0, -12.0))
    (estimate,) = fitted(model).estimates
    tau = dispersion_of(model, Problem(model, NONE).point(np.array([-9.0]), np.zeros((4, 0)))) / 9.0
    half = t.ppf(0.975, 3) * np.sqrt(9.0 * tau / 100.0)
    assert (estimate.value, estimate.low) == (-9.0, -9.0)
    assert estimate.high - estimate.low > 0.9 * half


class Apart(Stateless):
    """y = a in 4 windows of 25 samples, of which each has a value of its own; nothing is known of a."""

    def __init__(self, values: tuple[float, ...]) -> None:
        self.parameters = (Parameter("a", "m", 0.0, 1.0, -9.0, 9.0),)
        self.counts, self.groups = np.full(4, 25), np.zeros(4, dtype=np.int64)
        self.values = np.array(values)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        made = jobs.points[jobs.point][:, :1] - self.values[jobs.window, None]
        return np.repeat(made, 25, axis=1)


class Started(Apart):
    """The same with more windows, each with a start state that tells of nothing else."""

    def __init__(self, values: tuple[float, ...]) -> None:
        super().__init__(values)
        self.counts, self.groups = np.full(len(values), 25), np.zeros(len(values), dtype=np.int64)

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        return super().residuals(hypothesis, jobs) + jobs.states * np.linspace(-1.0, 1.0, 25)


def test_an_effect_whose_name_begins_that_of_another_has_its_own_numbers() -> None:
    """Of the standard effects `inertia` and `inertia.position`; an effect of one's own may be called `friction`."""
    told = fitted(Line(0.05, np.random.default_rng(8)))
    for order in (("inertia.position.size", "inertia.size"), ("inertia.size", "inertia.position.size")):
        parameters = tuple(dataclasses.replace(p, name=n) for p, n in zip(told.parameters, order, strict=True))
        estimates = tuple(dataclasses.replace(e, name=n) for e, n in zip(told.estimates, order, strict=True))
        both = dataclasses.replace(told, parameters=parameters, estimates=estimates)
        for name in ("inertia", "inertia.position"):
            (size,) = both.effect(name).parameters
            assert (size.name, size.value) == ("size", told.estimates[order.index(f"{name}.size")].value)


def test_what_the_records_cannot_tell_is_named() -> None:
    told = fitted(Line(0.05, np.random.default_rng(8))).calibration(2)
    assert told.undetermined == ("a +1.00",)
    assert [e.moved is not None for e in told.estimates] == [True, True]


def test_a_bound_that_was_hit_is_told() -> None:
    told = fitted(Line(-3.0, np.random.default_rng(8))).calibration(2)
    assert told.bounds_hit == ("b",)


@pytest.mark.parametrize("at", [0.0, 0.3])
def test_a_bound_that_only_the_place_believed_hits_is_told(at: float, monkeypatch) -> None:
    """The place believed is moved to the bound of b, or 0.3 of its scale off."""
    model = Line(0.0, np.random.default_rng(8))
    place = fit_of(model)
    problem = Problem(model, NONE)

    def moved(problem: Problem, place: Point, *, steps: int) -> Fit:
        z = place.z.copy()
        z[1] = problem.low[1] + at
        return Fit(problem.point(z, place.states), True)

    monkeypatch.setattr("discrepancy.estimates.fit", moved)
    assert place.z[1] > problem.low[1] + 0.1
    assert (estimates_of(model, place).calibration(2).bounds_hit == ("b",)) == (at == 0.0)


@pytest.mark.parametrize("low", [-0.5, -9.0])
def test_a_bound_is_no_knowledge(low: float) -> None:
    """Only a + b is determined: a is as uncertain where b is at its bound as where it is not, by what is known of b."""
    model = Line(0.0, np.random.default_rng(8))
    model.parameters = (model.parameters[0], Parameter("b", "m", 0.0, 0.1, low=low * 0.1, known=True))
    model.x = 20.0 * model.x
    model.y = model.y - 0.15 * model.x
    a, b = fitted(model).estimates
    assert (b.value == pytest.approx(-0.05)) == (low == -0.5)
    assert (a.high - a.low) / (2.0 * t.ppf(0.975, 3)) == pytest.approx(0.1 / 2.0**0.5, rel=0.1)


def test_a_size_of_which_nothing_was_known_may_be_bent(monkeypatch) -> None:
    """Seed 11: with odds of 0.05 it has 17 times the variance, whatever the records say. Slopes that are known have
    their say of their own, which is left out here."""
    model = Slopes(1.0, np.random.default_rng(11))
    place, half = fit_of(model), []
    monkeypatch.setattr(Told, "_bent", lambda told, dispersion: np.r_[0.0, np.full(len(told.z), -np.inf)])
    for odds in (1e-12, 0.05):
        monkeypatch.setattr("discrepancy.intervals._SIZE_BENT", odds)
        half.append([(e.high - e.low) / 2.0 for e in estimates_of(model, place).estimates])

    def beyond(x: float) -> float:
        return (t.sf(x, 3) + 0.05 * t.sf(x / 17.0**0.5, 3)) / 1.05 - 0.025

    wider = brentq(beyond, 1.0, 30.0) / t.ppf(0.975, 3)
    assert wider > 1.1
    assert half[1][4] / half[0][4] == pytest.approx(wider, rel=0.03)
    assert half[1][:4] == pytest.approx(half[0][:4], rel=1e-6)


@pytest.mark.parametrize(("bent", "wider"), [(1.0, False), (4.0, True)])
def test_a_machine_that_is_bent_beyond_belief_tells_less_of_an_effect(bent: float, wider: bool) -> None:
    """Seed 11: four of five slopes are known to 0.1 and measured to 0.01. Where they are four standard deviations off,
    the records are not believed about the fifth one either, of which nothing was known."""
    model = Slopes(bent, np.random.default_rng(11))
    told = estimates_of(model, fit_of(model))
    half = (told.estimates[4].high - told.estimates[4].low) / 2.0
    alone = t.ppf(0.975, 3) / np.sqrt((model.x[4] ** 2).sum())
    assert (half > 3.0 * alone) == wider
    assert half > 0.9 * alone


class Chattering(Line):
    """The same, where the last `jumping` windows see another noise at each place."""

    jumping = 0

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        jumps = np.array([np.random.default_rng(zlib.crc32(point.tobytes())) for point in jobs.points])
        noise = 0.1 * np.array([rng.standard_normal(25) for rng in jumps])[jobs.point]
        late = np.arange(4)[jobs.window] >= 4 - self.jumping
        return super().residuals(hypothesis, jobs) + noise * late[:, None]


@pytest.mark.parametrize(("jumping", "windows"), [(0, 4), (1, 3), (4, 0)])
def test_a_window_whose_motion_jumps_tells_nothing(jumping: int, windows: int, monkeypatch) -> None:
    """Seed 8: of b nothing was known. Its interval is that of the windows that have a derivative, and all that is
    possible where none has. No parameter is bent."""
    monkeypatch.setattr("discrepancy.intervals._BENT", 1e-12)
    monkeypatch.setattr("discrepancy.intervals._SIZE_BENT", 1e-12)
    model = Chattering(0.0, np.random.default_rng(8))
    model.parameters = (model.parameters[0], Parameter("b", "m", 0.0, 1.0, low=-0.5, high=7.0))
    model.jumping = jumping
    told = fitted(model)
    b = told.estimates[1]
    assert told.untold == (False, windows == 0)
    if windows:
        x = np.concatenate(model.x[:windows])
        expected = t.ppf(0.975, windows - 1) * np.sqrt(0.1**2 + 1.0 / (x @ x))
        assert 0.9 < (b.high - b.value) / expected < 2.5
    else:
        assert (b.low, b.high) == (-0.5, 7.0)
        a = told.estimates[0]
        assert (a.high - a.low) / (2.0 * t.ppf(0.975, 3)) == pytest.approx(0.1, rel=0.1), "as it was known"


class Slopes(Stateless):
    """Five slopes over variables of their own in 4 windows of 500 samples with noise 1."""

    def __init__(self, bent: float, rng: np.random.Generator) -> None:
        known = tuple(Parameter(name, "m", 0.0, 0.1, known=True) for name in "abcd")
        self.parameters = (*known, Parameter("size", "m", 0.0, 1.0))
        self.counts, self.groups = np.full(4, 500), np.zeros(4, dtype=np.int64)
        self.x = 2.2 * rng.standard_normal((5, 4, 500))
        true = [*(0.1 * bent * np.array([1.0, -1.0, 1.0, -1.0])), 1.0]
        self.y = np.tensordot(true, self.x, 1) + rng.standard_normal((4, 500))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        values = [[p.value(z) for p, z in zip(self.parameters, point, strict=True)] for point in jobs.points]
        return np.einsum("jk,kjn->jn", np.array(values)[jobs.point], self.x[:, jobs.window]) - self.y[jobs.window]


class Ring(Stateless):
    """Six numbers known to 0.1, of which each of 60 windows of 25 samples tells the difference of two neighbours: what
    all have in common follows from what was known alone. All are 0, but the last one seems to be 0.6."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.parameters = tuple(Parameter(name, "m", 0.0, 0.1, known=True) for name in "abcdef")
        self.counts, self.groups = np.full(60, 25), np.zeros(60, dtype=np.int64)
        self.y = rng.standard_normal((60, 25)) + 30.0 * np.array([0.0, 0.0, 0.0, 0.0, -0.6, 0.6] * 10)[:, None]

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        values = np.array([[p.value(z) for p, z in zip(self.parameters, point, strict=True)] for point in jobs.points])
        differences = (values - np.roll(values, -1, axis=1))[jobs.point, jobs.window % 6]
        return 30.0 * differences[:, None] - self.y[jobs.window]


@pytest.mark.parametrize(("odds", "held"), [(0.05, True), (1e-12, False)])
def test_a_parameter_that_alone_contradicts_what_was_known_does_not_drag_the_others(odds, held, monkeypatch) -> None:
    """Seed 12: one parameter has taken up what the model lacks. Its own interval holds what was known, too."""
    monkeypatch.setattr("discrepancy.intervals._BENT", odds)
    told = fitted(Ring(np.random.default_rng(12))).estimates
    assert [e.value for e in told] == pytest.approx([*[-0.1] * 5, 0.5], abs=0.01)
    assert all(e.low <= 0.0 <= e.high for e in told) == held


@pytest.mark.parametrize(("low", "high", "shown"), [(0.1, 0.4, True), (-0.1, 0.4, False), (-0.4, -0.1, True)])
def test_a_size_is_shown_where_the_interval_that_is_told_leaves_out_none(low, high, shown):
    size, place = Estimate("size", "-", 0.2, low, high, 0.0, None), Estimate("place", "-", 0.0, -1.0, 1.0, 0.0, None)
    assert FoundEffect("an effect", (size, place), (), "").shown is shown


@pytest.mark.parametrize(
    ("low", "high", "nominal", "span"),
    [(1, 3, 0, 3), (-3, -1, 0, 3), (11, 12, 10, 2), (0, 1, 0, np.inf), (-1, 3, 0, np.inf)],
)
def test_how_well_a_size_is_known_is_a_factor_taken_from_no_effect(
    low: float, high: float, nominal: float, span: float
) -> None:
    size = Estimate("torque", "N m", 0.5 * (low + high), low, high, nominal, None)
    assert FoundEffect("friction", (size,), (), "").span == span


def test_what_an_effect_may_as_well_do_is_not_told_of_the_machine() -> None:
    """An effect of the very shape of the machine's own parameter: each for itself the records would tell."""
    model = Chord({}, 3, ("ones",))
    model.shapes["ones"] = np.ones_like(model.y)
    problem = Problem(model, model.library["ones"][0])
    place = fit(problem, problem.point(np.zeros(2), np.zeros((len(model.counts), 0))), steps=10).place
    assert estimates_of(model, place).calibration(1).undetermined == ("offset +1.00",)
