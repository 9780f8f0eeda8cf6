"""Drives and records made for the tests, by their equations."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from discrepancy.drives.advance import WORK, run
from discrepancy.drives.channels import Record
from discrepancy.drives.description import Drive, load_drive
from discrepancy.drives.door import subject_of
from discrepancy.drives.forces import INNER
from discrepancy.drives.forward import ForwardModel
from discrepancy.model import Hypothesis, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.subjects.base import Subject

FILE = """
parameters = {"mass": (90.0, "kg", 15.0)}
channels = {"time": "t", "q": "q", "force": "f"}


def force(q, v, a, u, t, p):
    return p.mass * a
"""


def drive(folder: Path, text: str = FILE) -> Drive:
    """The drive that a file of this text describes."""
    path = folder / "my_drive.py"
    path.write_text(text)
    return load_drive(path)


def motion(seconds: float = 12.0, rate: float = 500.0, shift: float = 0.0) -> tuple[np.ndarray, ...]:
    """Time, position, speed and acceleration of three sines, with rests between."""
    t = np.arange(round(seconds * rate)) / rate
    rows = [np.zeros_like(t) for _ in range(3)]
    for size, w in ((0.1, 1.3), (0.03, 4.1), (0.01, 9.7)):
        phase = w * t + shift
        rows[0] += size * np.sin(phase)
        rows[1] += size * w * np.cos(phase)
        rows[2] -= size * w * w * np.sin(phase)
    return (t, *rows)


def record(
    force: Callable[..., np.ndarray],
    *,
    noise: float = 0.05,
    seed: int = 3,
    rate: float = 500.0,
    units: Mapping | None = None,
    scale: tuple[float, float] = (1.0, 1.0),
    name: str = "a.csv",
    shift: float = 0.0,
    **told: object,
) -> Record:
    """A record whose force is `force(t, q, v, a)` with white noise; `scale` multiplies force and position."""
    t, q, v, a = motion(rate=rate, shift=shift)
    given = force(t, q, v, a)
    given = given + noise * np.random.default_rng(seed).standard_normal(len(t))
    rows = {"q": scale[1] * q, "force": scale[0] * given}
    return Record(name, rate, rows, units or {"q": "m", "force": "N"}, **told)  # type: ignore[arg-type]


def subject(folder: Path, force: Callable[..., np.ndarray], text: str = FILE, **more: object) -> Subject:
    """The subject of a drive and one record of it."""
    return subject_of(drive(folder, text), [record(force, **more)])  # type: ignore[arg-type]


def start_of(subject: Subject, *hypotheses: Hypothesis, start: int = 0) -> tuple[Problem, Point]:
    """A set of effects at one of their starts."""
    model = subject.model
    both = together(*hypotheses)
    problem = Problem(model, both)
    z = [np.zeros(len(model.parameters))]
    z += [one.coordinates(one.starts[min(start, len(one.starts) - 1)]) for one in both.effects]
    states = np.zeros((len(model.counts), model.local_count(both)))
    return problem, problem.point(np.concatenate(z), states)


def values(problem: Problem, place: Point) -> dict[str, float]:
    """Values of all parameters at a place."""
    return {p.name: float(p.value(z)) for p, z in zip(problem.parameters, place.z, strict=True)}


def run_plain(
    model: ForwardModel, hypothesis: Hypothesis, point: np.ndarray, start: np.ndarray, k: int = 0
) -> np.ndarray:
    """Measured channels (channels, n) of the k-th record at a global point, simulated from one start state."""
    parameters = model.parameters + hypothesis.parameters
    told = [p.value(z) for p, z in zip(parameters, point, strict=True)]
    joints, command, _ = model.set_up(hypothesis, told)
    course = model.courses[k]
    out = np.zeros((model.channels, len(course.u)))
    work = np.zeros((WORK, max(len(start) + INNER * len(joints), course.u.shape[1])))
    scale = np.maximum(np.abs(course.states).max(axis=0), 1e-12)
    inner = np.zeros((1 + INNER) * len(joints))
    run(
        model.rates, np.asarray(start, dtype=float), inner, model.command(k, command), model.held, 0.0, course.rate,
        model.substeps, np.array(told[: model.own]), model.places, joints, model.measured, scale, work, out,
    )  # fmt: skip
    return out
