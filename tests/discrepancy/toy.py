"""Models of the tests: chords of shapes whose answer is known, and what a report needs of one."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import numpy as np

from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis, Model, Parameter
from discrepancy.place import Point
from discrepancy.subjects.base import Axis, Measurement, Subject, Torque, View, binned

WINDOWS, SAMPLES = 8, 100


class Stateless(Model):
    """A model whose windows have no start states of their own, without a library."""

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {}

    def recording(self, readings: np.ndarray) -> Model:
        raise NotImplementedError("what these models read is not measured")

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 0

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.zeros((0, 0))


def effect(name: str, alike: tuple[str, ...] = (), largest: float = 90.0) -> Hypothesis:
    """An effect of one size."""
    size = Parameter(f"{name}.size", "N", 0.0, 1.0, -largest, largest)
    return Hypothesis(name, (size,), {}, ((3.0,), (9.0,)), alike)


class Chord(Stateless):
    """y = offset + Σ size · shape in 8 windows of 100 samples, two records, noise 1.

    Parameters
    ----------
    hidden : mapping
        Sizes of the shapes in the records.
    seed : int
    offered : tuple of str
        Effects of the library.
    """

    def __init__(
        self, hidden: Mapping[str, float], seed: int, offered: tuple[str, ...] = ("tone", "beat"), largest: float = 90.0
    ) -> None:
        self.parameters = (Parameter("offset", "N", 0.0, 0.1, -0.3, 0.3, known=True),)
        self.counts = np.full(WINDOWS, SAMPLES)
        self.groups = np.repeat([0, 1], WINDOWS // 2)
        self.x = x = np.linspace(0.0, 40.0, WINDOWS * SAMPLES).reshape(WINDOWS, SAMPLES)
        tone, beat, rest = np.sin(x), np.cos(7.0 * x), np.cos(3.0 * x)
        self.shapes = {
            "tone": tone, "beat": beat, "rest": rest, "twin": tone,
            "half": tone + rest, "late": tone * (np.arange(WINDOWS) >= WINDOWS // 2)[:, None],
        }  # fmt: skip
        # rough shapes, each sample a sign of its own, so that what one leaves of another has no memory
        a, b, c = np.random.default_rng(0).choice([-1.0, 1.0], (3, *x.shape))
        self.shapes |= {"a": a, "b": b, "a and b": a + b + 0.5 * c}
        clean = np.sum([size * self.shapes[name] for name, size in hidden.items()], axis=0) + np.zeros_like(x)
        self.y = clean + np.random.default_rng(seed).standard_normal(x.shape)
        self.library = {name: (effect(name, largest=largest),) for name in offered}

    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        return self.library

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        made = 0.1 * points[:, :1] - self.y[jobs.window]
        for k, name in enumerate(hypothesis.names, start=1):
            made = made + points[:, k, None] * self.shapes[name][jobs.window]
        return made

    def recording(self, readings: np.ndarray) -> Chord:
        other = copy.copy(self)
        other.y = readings
        return other


class Long(Chord):
    """A chord of which a search takes half."""

    def part(self, windows: int) -> Chord:
        other, some = copy.copy(self), self.among(self)
        other.counts, other.groups, other.y = self.counts[some], self.groups[some], self.y[some]
        other.shapes = {name: shape[some] for name, shape in self.shapes.items()}
        return other

    def among(self, whole: Model) -> np.ndarray:
        return np.array([0, 1, 4, 5])


def late(seed: int) -> Chord:
    """A loud tone, and a lag that an offset stated of the record, nine standard deviations off, takes up but for a
    quarter of a sign in each sample: less than is looked for."""
    model = Chord({"tone": 20.0}, seed, ("tone", "lag"))
    model.parameters = (Parameter("record 0.offset", "N", 0.0, 0.1, known=True, record=0),)
    model.groups = np.zeros(WINDOWS, dtype=int)
    model.shapes["lag"] = 1.0 + 0.25 * model.shapes["b"]
    model.y = model.y + model.shapes["lag"]
    return model


class Loud(Chord):
    """A chord that shows a share of the noise that was taken, and is then heard as much louder."""

    shows = 1.0

    def noise_left(self, residual: np.ndarray) -> tuple[float, float]:
        return self.shows, 0.0

    def with_noise(self, share: float, colour: float) -> Model:
        other = copy.copy(self)
        other.y = self.y / share
        other.shapes = {name: shape / share for name, shape in self.shapes.items()}
        return other

    def tolerating(self, share: float) -> Model:
        other = copy.copy(self)
        other.tolerated = 1.0 + share * float((self.y**2).mean())
        return other


class ChordSubject(Subject):
    """A chord as the chain takes it; its measurements are the same again, and one with the shapes told apart."""

    kind = "chord"
    notes = ("the records are made up",)

    def __init__(self, hidden: Mapping[str, float], offered: tuple[str, ...] = ("tone", "beat"), **more: float) -> None:
        self.model = Chord(hidden, 5, offered, **more)
        self.held_out = Chord(hidden, 6, offered, **more)

    def view(self, model: Model) -> View:
        assert isinstance(model, Chord)
        shape = (WINDOWS, SAMPLES)
        inside = np.ones(shape, dtype=bool)
        time = np.tile(np.arange(WINDOWS * SAMPLES // 2).reshape(-1, SAMPLES), (2, 1)) * 0.01
        phase = np.tile(np.arange(SAMPLES) / SAMPLES, (WINDOWS, 1))
        axes = (
            Axis("phase", tuple(f"{k / 4:g} turn" for k in range(4)), binned(phase, np.linspace(0, 1, 5), inside)),
            Axis("time", ("0 s", "1 s", "2 s", "3 s"), binned(time, np.linspace(0, 4, 5), inside)),
        )
        return View(
            ("a", "b"), "N", model.groups, inside, time, model.y, np.ones(2), (False, False), axes, ("time", "phase"),
            torque=Torque("missing force [N]", 1.0, {"phase [turn]": phase, "time [s]": time}),
        )  # fmt: skip

    def files(self, model: Model, place: Point) -> Mapping[str, str]:
        rows = [f"{p.name}: {p.value(z):.6g}\n" for p, z in zip(self._all(place), place.z, strict=True)]
        return {"machine.yaml": "".join(rows)}

    def _all(self, place: Point) -> tuple[Parameter, ...]:
        return self.model.parameters + place.hypothesis.parameters

    def meaning(self, effect: str) -> str:
        return f"A {effect} is heard."

    def measurements(self, model: Model) -> tuple[Measurement, ...]:
        assert isinstance(model, Chord)
        again = model.recording(np.zeros((WINDOWS, SAMPLES)))
        telling = copy.copy(again)
        telling.shapes = {**again.shapes, "twin": again.shapes["rest"]}
        return Measurement("the same again", again), Measurement("a telling one", telling)


__all__ = ["NONE", "SAMPLES", "WINDOWS", "Chord", "ChordSubject", "Loud", "Stateless", "effect", "late"]
