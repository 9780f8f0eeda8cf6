"""A first effect that only resembles what is hidden is taken back once the right one is found, and what could not be
told apart before is tried again. Seeds 5 to 10."""

import copy
from collections.abc import Mapping

import numpy as np
import pytest

from discrepancy import explain, name_effect
from discrepancy.model import Hypothesis, Jobs, Parameter
from tests.discrepancy.toy import Stateless


def effect(name: str) -> Hypothesis:
    return Hypothesis(name, (Parameter(f"{name}.size", "-", 0.0, 1.0, -90.0, 90.0),), {}, ((3.0,), (9.0,)))


class Chord(Stateless):
    """y = Σ size · shape in 4 windows of 200 samples, noise 1. The library offers its effects one after the other, as a
    search does that does not see the second one at first."""

    def __init__(self, sizes: Mapping[str, float], seed: int) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.1, known=True),)
        self.counts, self.groups = np.full(4, 200), np.zeros(4, dtype=np.int64)
        x = np.linspace(0.0, 40.0, 800).reshape(4, 200)
        self.shapes = {"like": np.sin(x) + 0.8 * np.cos(3.0 * x), "tone": np.sin(x), "beat": np.cos(7.0 * x)}
        clean = np.sum([size * self.shapes[name] for name, size in sizes.items()], axis=0)
        self.y = clean + np.random.default_rng(seed).standard_normal((4, 200))
        self.order, self.known = ("like", "tone", "beat"), ()

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        first = self.order.index(self.known[-1]) + 1 if self.known else 0
        return {name: (effect(name),) for name in self.order[first : first + 1]}

    def extended(self, hypothesis: Hypothesis) -> "Chord":
        other = copy.copy(self)
        other.known, other.parameters = (*self.known, hypothesis.name), self.parameters + hypothesis.parameters
        return other

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        names = [*self.known, *([hypothesis.name] if hypothesis.parameters else [])]
        made = [points[:, k, None] * self.shapes[name][jobs.window] for k, name in enumerate(names, start=1)]
        return 0.1 * points[:, :1] + np.sum(made, axis=0) - self.y[jobs.window]


@pytest.mark.parametrize(
    ("hidden", "names"),
    [
        ({"tone": 10.0}, ("tone",)),
        ({"like": 6.0, "tone": 10.0}, ("like", "tone")),
        ({"like": 0.7, "tone": 10.0}, ("like", "tone")),  # doubted, but needed
        ({"tone": 10.0, "beat": 8.0}, ("tone", "beat")),
    ],
)
def test_only_what_is_needed_stays(hidden: dict, names: tuple) -> None:
    answer = explain(Chord(hidden, 5), Chord(hidden, 6))
    assert (answer.verdict, answer.names) == ("named", names), answer.reason
    assert answer.after < 1.1 and answer.closed_share > 0.99
    assert len(answer.model.parameters) == 1 + len(names)
    for known, naming in enumerate(answer.rounds):
        for candidate in naming.candidates:
            assert len(candidate.place.z) == 1 + known + len(candidate.place.hypothesis.parameters)
    for found, name in zip(answer.found, names, strict=True):
        assert found.name == name and found.parameters[0].low < hidden[name] < found.parameters[0].high


def test_what_was_taken_back_is_ranked_behind() -> None:
    answer = explain(Chord({"tone": 10.0}, 7), Chord({"tone": 10.0}, 8))
    assert [row.name for row in answer.ranking] == ["tone", "like", "none"]
    assert answer.ranking[0].probability > 0.99
    # the base model stays what the gap is measured from
    assert answer.base.held_out == answer.before > 5.0


class Twins(Chord):
    """Two effects that are offered together, `apart` by so much of a third shape; then the beat, which outshouts what
    tells them apart."""

    def __init__(self, apart: float, seed: int, size: float = 10.0) -> None:
        super().__init__({"tone": size, "beat": 8.0}, seed)
        self.shapes["twin"] = self.shapes["tone"] + apart * np.cos(11.0 * np.linspace(0.0, 40.0, 800)).reshape(4, 200)

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        left = {"tone", "twin"} - set(self.known)
        return {name: (effect(name),) for name in (sorted(left) if len(left) == 2 else ["beat"])}


@pytest.mark.parametrize(
    ("apart", "verdict", "names", "alike"),
    [(0.15, "named", ("beat", "tone"), ("tone",)), (0.0, "ambiguous", ("beat", "tone"), ("tone", "twin"))],
)
def test_what_could_not_be_told_apart_before_is_tried_again(apart: float, verdict: str, names: tuple, alike: tuple):
    first = name_effect(Twins(apart, 9), Twins(apart, 10))
    assert first.verdict == "ambiguous" and set(first.names) == {"tone", "twin"}
    answer = explain(Twins(apart, 9), Twins(apart, 10))
    assert answer.verdict == verdict, answer.reason
    assert set(answer.rounds[-1].names) == set(alike)
    assert verdict == "ambiguous" or answer.names == names
    assert answer.effects[0].name == "beat" and answer.after < 1.1
    # the base model stays what came, also where the round judged first now stands last
    assert answer.base.name == "none" and len(answer.base.place.z) == 1
    assert answer.base.held_out == answer.before and len(answer.calibration.estimates) == 1


def test_a_machine_is_told_also_where_what_was_judged_again_is_not_named() -> None:
    answer = explain(Twins(0.0, 9, size=95.0), Twins(0.0, 10, size=95.0))
    assert answer.verdict == "unexplained" and "bound" in answer.reason
    assert len(answer.rounds) == 2 and answer.effects[0].name == "beat"
    assert answer.believed is answer.base and len(answer.calibration.estimates) == 1


class Pairs(Chord):
    """Two pairs of effects, one offered after the other; a pair may be told apart by `apart` of a shape of its own."""

    def __init__(self, apart: tuple[float, float], seed: int) -> None:
        super().__init__({"tone": 10.0, "beat": 8.0}, seed)
        x = np.linspace(0.0, 40.0, 800).reshape(4, 200)
        self.shapes["twin"] = self.shapes["tone"] + apart[0] * np.cos(11.0 * x)
        self.shapes["echo"] = self.shapes["beat"] + apart[1] * np.cos(13.0 * x)

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        pairs = [pair for pair in (("tone", "twin"), ("beat", "echo")) if not {*pair} & {*self.known}]
        return {name: (effect(name),) for name in (pairs[0] if pairs else ())}


@pytest.mark.parametrize(
    ("apart", "verdict", "said"),
    [
        ((0.15, 0.0), "ambiguous", "explain the records alike"),
        ((0.0, 0.0), "unexplained", "cannot be told apart, nor can"),
    ],
)
def test_two_rounds_that_are_ambiguous(apart: tuple[float, float], verdict: str, said: str) -> None:
    answer = explain(Pairs(apart, 9), Pairs(apart, 10))
    assert answer.verdict == verdict and said in answer.reason
    assert answer.rounds[-1].verdict == "ambiguous" and answer.after < 1.1
    if verdict == "ambiguous":
        assert answer.names[0] == "tone" and {*answer.rounds[-1].names} == {"beat", "echo"}


class LostTwin(Twins):
    """The first effect offered resembles the twins, which are equal and come after it."""

    def __init__(self, seed: int) -> None:
        super().__init__(0.0, seed)
        self.y -= 8.0 * self.shapes["beat"]

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        names = ("tone", "twin") if self.known == ("like",) else () if self.known else ("like",)
        return {name: (effect(name),) for name in names}


def test_rivals_compete_where_what_was_found_before_them_is_taken_back() -> None:
    answer = explain(LostTwin(5), LostTwin(6))
    assert answer.verdict == "ambiguous" and len(answer.rounds) == 1
    assert {*answer.rounds[-1].names} == {"tone", "twin"}


class Both(Twins):
    """Both twins are hidden, and like each other at first."""

    def __init__(self, seed: int) -> None:
        super().__init__(0.6, seed)
        self.y += 6.0 * self.shapes["twin"] - 4.0 * self.shapes["tone"] - 8.0 * self.shapes["beat"]

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {name: (effect(name),) for name in ("tone", "twin") if name not in self.known}


def test_a_rival_that_was_found_itself_is_none_any_more() -> None:
    answer = explain(Both(9), Both(10))
    assert answer.verdict == "named" and {*answer.names} == {"tone", "twin"}, answer.reason
    assert {row.name for row in answer.ranking} == {answer.names[-1], "none"}
