"""Records of a machine for the twin's table, solved once and kept: all methods are asked of the same ones."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.twin.truth import RATE, Truth, fault, taken
from discrepancy.records.conditions import Conditions
from indexer_env import Signal
from indexer_env.effects import Effect
from indexer_env.motion_law.choose import motion_law
from twin.faults import FAULTS

OTHER_LAWS = ("modified_trapezoid", "cycloidal", "polynomial_345")
"""Of tables of another make."""

NAMES = ("crack", "loose_base", "reducer_play")
SPEEDS, LOADS = (1200.0, 1500.0), (2.0, 20.0)
_STRANGERS = 0.1
"""Share of the records that have a fault of no table."""

_TURNS = 1.1


@dataclass(frozen=True, eq=False)
class Recorded:
    """A record with what is stated of it, and what is true: sizes of its faults, and whether it is a stranger."""

    signal: Signal
    stated: Conditions
    sizes: dict[str, float]
    stranger: bool = False


def drawn(truth: Truth, rng: np.random.Generator) -> tuple[Truth, dict[str, float], tuple[Effect, ...], bool]:
    """The machine, sizes of its faults, their effects, and whether it is a stranger: a fault of no table, or a table of
    another make."""
    if rng.random() < _STRANGERS:
        if rng.random() < 0.5:
            law = motion_law(OTHER_LAWS[int(rng.integers(len(OTHER_LAWS)))])
            return dataclasses.replace(truth, machine=dataclasses.replace(truth.machine, motion_law=law)), {}, (), True
        height, centre = rng.uniform(4e-4, 1.2e-3), rng.uniform(0.1, 0.4)
        return truth, {}, (fault("cam.profile_error", height=height, centre=centre, half_width=0.06),), True
    there = [name for name in NAMES if rng.random() < 0.5]
    sizes = {name: float(rng.uniform(0.0, 1.0)) for name in there}
    return truth, sizes, effects_of(truth, sizes), False


def effects_of(truth: Truth, sizes: dict[str, float]) -> tuple[Effect, ...]:
    """Faults of these sizes."""
    return tuple(
        fault(FAULTS[name].effect, **{FAULTS[name].parameter: FAULTS[name].value(size, truth.machine)})
        for name, size in sizes.items()
    )


def recorded(
    truth: Truth, rpm: float, load: float, sizes: dict[str, float], rng: np.random.Generator,
    effects: tuple[Effect, ...] | None = None, stranger: bool = False,
) -> Recorded:  # fmt: skip
    """A record of the machine with faults of these sizes, or with `effects` where a stranger has others."""
    values, point = taken(truth, rpm, load, _TURNS, rng, effects_of(truth, sizes) if effects is None else effects)
    return _as_recorded(values, point.motor_speed, load, point.start_angle, truth.noise, sizes, stranger)


def _as_recorded(
    values: np.ndarray, speed: float, load: float, start: float, noise: float, sizes: dict[str, float], stranger: bool
) -> Recorded:
    signal = Signal(values, RATE, unit="rad/s^2", source="record")
    return Recorded(signal, Conditions(speed, load, start_angle=start, noise=noise), sizes, stranger)


def records_of(truth: Truth, count: int, rng: np.random.Generator, file: Path) -> list[Recorded]:
    """`count` records of a machine: no fault, or faults of any size in all combinations, and some strangers. `file`
    keeps them; more of them, by random numbers that begin as before, begin with the same ones."""
    kept = _read(file, truth.noise) if file.exists() else []
    if len(kept) < count:
        kept = []
        for _ in range(count):
            real, sizes, effects, stranger = drawn(truth, rng)
            kept.append(recorded(real, rng.uniform(*SPEEDS), rng.uniform(*LOADS), sizes, rng, effects, stranger))
        _write(file, kept)
    return kept[:count]


def _write(file: Path, records: list[Recorded]) -> None:
    values = [r.signal.values for r in records]
    stated = [(r.stated.motor_speed, r.stated.load_torque, r.stated.start_angle) for r in records]
    sizes = [[r.sizes.get(name, np.nan) for name in NAMES] for r in records]
    file.parent.mkdir(parents=True, exist_ok=True)
    fresh = file.with_suffix(".part.npz")
    np.savez(
        fresh, values=np.concatenate(values), lengths=[len(v) for v in values], stated=np.array(stated),
        sizes=np.array(sizes), stranger=[r.stranger for r in records],
    )  # fmt: skip
    fresh.rename(file)


def _read(file: Path, noise: float) -> list[Recorded]:
    with np.load(file) as held:
        ends = np.cumsum(held["lengths"])
        values, stated, sizes, stranger = (held[name] for name in ("values", "stated", "sizes", "stranger"))
    found = []
    for k, (part, (speed, load, start)) in enumerate(zip(np.split(values, ends[:-1]), stated.tolist(), strict=True)):
        there = {name: float(size) for name, size in zip(NAMES, sizes[k], strict=True) if not np.isnan(size)}
        found.append(_as_recorded(part, speed, load, start, noise, there, bool(stranger[k])))
    return found
