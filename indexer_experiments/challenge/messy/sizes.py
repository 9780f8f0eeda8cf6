"""A drawn case with its sizes: each disturbance and effect is scaled until it leaves what was drawn for it."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from indexer_env.effects import Effect, MachineEffect, SensorEffect, make_effect
from indexer_env.errors import ParameterError, SimulationError
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.draw import HIDDEN
from indexer_experiments.challenge.equations import STATES
from indexer_experiments.challenge.messy.disturbances import Scene
from indexer_experiments.challenge.messy.draw import MessyDraw, RecordDraw, Wanted, unit_size
from indexer_experiments.challenge.messy.leftover import Fit
from indexer_experiments.challenge.messy.pieces import RATE, coarse_run
from indexer_experiments.challenge.messy.reading import Reader
from indexer_experiments.challenge.messy.sought import LevelOf, settled
from indexer_experiments.challenge.running import lead_of, read_running
from indexer_experiments.challenge.unlisted import NOTHING, Unlisted

_UNKNOWN = np.empty((1 + STATES, 0))
"""A turn before a run of which nothing is needed."""


@dataclass(frozen=True)
class Sized:
    """A disturbance with its size, and what it leaves alone, over the noise."""

    wanted: Wanted
    size: float
    level: float


@dataclass(frozen=True)
class Hidden:
    """An effect with its size, and what it leaves beside the other ones hidden, over the noise."""

    effect: Effect
    level: float


@dataclass(frozen=True, eq=False)
class MessyCase:
    """A case whose records can be made.

    Attributes
    ----------
    drawn : MessyDraw
    noise : float
        Standard deviation of the sensor's noise [rad/s²].
    disturbances : tuple of Sized
    disturbed : float
        What all of them leave together, over the noise; 0 without any.
    hidden : tuple of Hidden
    """

    drawn: MessyDraw
    noise: float
    disturbances: tuple[Sized, ...]
    disturbed: float
    hidden: tuple[Hidden, ...]

    @property
    def machine(self) -> Machine:
        """The true machine with the effects hidden in it."""
        return with_effects(self.drawn.machines.truth, [hidden.effect for hidden in self.hidden])[0]

    @property
    def sensor(self) -> Sensor:
        """The true chain, without its noise and quantiser."""
        return with_effects(self.drawn.machines.truth, [hidden.effect for hidden in self.hidden])[1]

    def unlisted(self, record: RecordDraw) -> Unlisted:
        """All disturbances and the drift of the speed in one record."""
        duration = record.turns * self.drawn.machines.truth.turn_duration(record.point)
        chosen = [(d.wanted, d.size) for d in self.disturbances]
        return unlisted_of(chosen, self.drawn, record)._replace(drift=record.drift, drift_time=duration)

    def readers(self, record: RecordDraw) -> list[Reader]:
        """What the disturbances do to a reading of one record."""
        return readers_of([(d.wanted, d.size) for d in self.disturbances], self.drawn, record)


def messy_case(drawn: MessyDraw) -> MessyCase:
    """The case with its sizes.

    Raises
    ------
    SimulationError
        A machine that leaves the physical range before anything is hidden in it.
    """
    truth = drawn.machines.truth
    # what is missing must show in the records that a method may fit
    fitted = [record for record in drawn.records if not record.held_out]
    points = [record.point for record in fitted]
    counts = [record.samples(truth, RATE) for record in fitted]

    nothing = [NOTHING for _ in points]

    def runs_of(machine: Machine, unlisted: Sequence[Unlisted], *sensors: Sensor) -> tuple[list[np.ndarray], ...]:
        """Runs, and as much of the turn before each as these sensors need."""
        runs, before = [], []
        for point, n, others in zip(points, counts, unlisted, strict=True):
            lead = max((lead_of(sensor, machine, point, RATE) for sensor in sensors), default=0)
            whole = coarse_run(machine, point, n, others, lead)
            runs.append(whole[:, lead:])
            before.append(whole[:, :lead])
        return runs, before

    motions, _ = runs_of(truth, nothing)
    noise = drawn.noise * float(np.sqrt(np.mean(motions[0][0] ** 2)))

    def beside(present: Sequence[Effect]) -> Level:
        """What effects and disturbances leave on the machine that has some effects already."""
        machine, sensor = with_effects(truth, present)
        fit = Fit(machine, points, runs_of(machine, nothing)[0] if machine is not truth else motions, noise, sensor)

        def level(
            effects: Sequence[Effect], chosen: Sequence[tuple[Wanted, float]], *, straight: bool = False
        ) -> float:
            disturbed, seen_by = with_effects(truth, [*present, *effects])
            unlisted = [unlisted_of(chosen, drawn, record) for record in fitted]
            runs, before = runs_of(disturbed, unlisted, sensor, seen_by)
            readings = [
                read_of(run, readers_of(chosen, drawn, record), seen_by, before=turn)
                for run, turn, record in zip(runs, before, fitted, strict=True)
            ]
            return fit.left(readings, runs, disturbed, unlisted, before=before, straight=straight)

        return level

    alone = beside(())
    disturbances, disturbed = _disturbances(drawn, alone)
    hidden = all_hidden(drawn, max(disturbed, 1.0), alone, beside)
    machine_effects = [one.effect for one in hidden if isinstance(one.effect, MachineEffect)]
    if disturbances and machine_effects:
        # an effect may make a disturbance many times as large: a joint that loses stiffness, under a drag that loads it
        there = beside(machine_effects)
        found = _together(drawn, disturbances, functools.partial(there, ()))
        disturbances, disturbed = found or ((), 0.0)
    return MessyCase(drawn, noise, disturbances, disturbed, hidden)


class Level(Protocol):
    """What effects and disturbances leave; `straight`: in linear theory."""

    def __call__(
        self, effects: Sequence[Effect], chosen: Sequence[tuple[Wanted, float]], *, straight: bool = False
    ) -> float: ...


def _disturbances(drawn: MessyDraw, level: Level) -> tuple[tuple[Sized, ...], float]:
    """Each alone as large as its even share of the energy, then all by one factor until together they are right."""
    if not drawn.disturbances:
        return (), 0.0
    share = drawn.disturbed / math.sqrt(len(drawn.disturbances))
    alone = []
    for wanted in drawn.disturbances:

        def alone_at(size: float, *, straight: bool = False, wanted: Wanted = wanted) -> float:
            return level((), [(wanted, size)], straight=straight)

        found = settled(alone_at, wanted.kind.unit, share, wanted.kind.most)
        if found is not None:
            alone.append(Sized(wanted, *found))
    if len(alone) <= 1:
        return tuple(alone), alone[0].level if alone else 0.0
    return _together(drawn, alone, functools.partial(level, ())) or ((), 0.0)


def _together(drawn: MessyDraw, alone: Sequence[Sized], level: LevelOf) -> tuple[tuple[Sized, ...], float] | None:
    """Disturbances made larger or smaller by one factor until together they leave what was drawn, and what they then
    leave; None where no factor does that."""
    most = min(one.wanted.kind.most / one.size for one in alone)

    def all_by(factor: float, *, straight: bool = False) -> float:
        return level([(one.wanted, factor * one.size) for one in alone], straight=straight)

    found = settled(all_by, 1.0, drawn.disturbed, most)
    if found is None:
        return None
    factor, reached = found
    return tuple(dataclasses.replace(one, size=factor * one.size, level=factor * one.level) for one in alone), reached


def all_hidden(
    drawn: MessyDraw, least: float, alone: Level, beside: Callable[[Sequence[Effect]], Level]
) -> tuple[Hidden, ...]:
    """Effects of the sizes drawn, at most two. Each leaves 3 times the `least`, the larger one of what noise and
    disturbances leave, beside the other: two that do so alone may hide each other, as a viscous friction does much of
    what a loose base leaves."""
    hidden: tuple[Hidden, ...] = ()
    level = alone
    for wanted in drawn.effects:
        if len(hidden) == drawn.hidden:
            break
        try:
            if hidden and level is alone:
                level = beside([one.effect for one in hidden])
            found = _hidden(drawn, wanted, drawn.above * least, level)
            if found is None or found.level < 3.0 * least:
                continue
            before = tuple(Hidden(one.effect, beside([found.effect])([one.effect], ())) for one in hidden)
        except (ParameterError, SimulationError):
            continue
        if all(one.level >= 3.0 * least for one in before):
            hidden = (*before, found)
    return hidden


def _hidden(drawn: MessyDraw, wanted: Wanted, target: float, level: Level) -> Hidden | None:
    field = next(iter(HIDDEN[wanted.name]))

    def effect(size: float) -> Effect:
        return make_effect(wanted.name, {field: size, **_typed(wanted.shape)})

    def left_by(size: float, *, straight: bool = False) -> float:
        return level((effect(size),), (), straight=straight)

    found = settled(left_by, unit_size(wanted.name, drawn.machines.size), target)
    return None if found is None else Hidden(effect(found[0]), found[1])


def with_effects(machine: Machine, effects: Sequence[Effect]) -> tuple[Machine, Sensor]:
    """A machine and an ideal sensor with effects."""
    sensor = Sensor()
    for effect in effects:
        if isinstance(effect, MachineEffect):
            machine = machine.with_effects(effect)
        elif isinstance(effect, SensorEffect):
            sensor = effect.extend_sensor(sensor)
    return machine, sensor


def scene_of(drawn: MessyDraw) -> Scene:
    """The scales of a case."""
    truth = drawn.machines.truth
    slowest = min(record.point.motor_speed for record in drawn.records)
    longest = max(record.turns * truth.turn_duration(record.point) for record in drawn.records)
    return Scene(truth, truth.reduction * slowest, longest)


def seed_of(drawn: MessyDraw) -> float:
    """Seed of what is random in the disturbances' equations."""
    return float(drawn.seeds[0].generate_state(1)[0] % 1000)


def unlisted_of(chosen: Sequence[tuple[Wanted, float]], drawn: MessyDraw, record: RecordDraw) -> Unlisted:
    """The numbers of disturbances with their sizes in one record."""
    fields: dict[str, Any] = {"seed": seed_of(drawn), "record": float(record.number)}
    scene = scene_of(drawn)
    for wanted, size in chosen:
        if wanted.kind.fields is not None:
            fields |= wanted.kind.fields(size, wanted.shape, scene)
    return NOTHING._replace(**fields)


def readers_of(chosen: Sequence[tuple[Wanted, float]], drawn: MessyDraw, record: RecordDraw) -> list[Reader]:
    """What disturbances do to a reading of one record; its shocks are the same ones whatever their size."""
    found = []
    seed = (int(drawn.seeds[0].generate_state(1)[0]), record.number)
    for wanted, size in chosen:
        if wanted.kind.reader is not None:
            found.append(wanted.kind.reader(size, wanted.shape, scene_of(drawn), np.random.default_rng(seed)))
    return found


def read_of(
    motion: np.ndarray, readers: Sequence[Reader], sensor: Sensor, rate: float = RATE, *, before: np.ndarray = _UNKNOWN
) -> np.ndarray:
    """The reading (n,) of a run (1 + STATES, n), without noise; `before`: the turn (1 + STATES, m) before it, which a
    sensor with a high-pass needs."""
    return read_running(sensor, _disturbed(motion, readers, rate), _disturbed(before, readers, rate), rate)


def _disturbed(motion: np.ndarray, readers: Sequence[Reader], rate: float) -> np.ndarray:
    y = motion[0]
    for reader in readers:
        y = reader(y, motion[3], rate)
    return y


def _typed(shape: Mapping[str, float]) -> dict[str, float]:
    return {name: int(value) if name == "station" else value for name, value in shape.items()}
