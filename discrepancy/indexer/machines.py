"""Machines and sensors that global points of a model stand for."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from discrepancy.indexer.library import HOUSING, effect_of
from discrepancy.indexer.parameters import changed
from discrepancy.indexer.together import GAIN, LOAD, Together
from discrepancy.model import NONE, Hypothesis, Parameter
from indexer_env.coefficients import NUMBER_OF, Coefficients, coefficients_with, numbers_of
from indexer_env.effects import MachineEffect, SensorEffect
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor

_KEPT = 64
"""Points whose coefficients are kept from call to call: those of a few steps of a fit."""


class Machines:
    """What the points of a model stand for.

    Parameters
    ----------
    machine : Machine
        Nominal.
    sensor : Sensor
    parameters : tuple of Parameter
        Of a point, before those of a hypothesis.
    known : tuple of Hypothesis
        Effects that the machine has, their parameters among these.
    together : Together, optional
        By which the first parameters stand for the machine's numbers, where they are not these themselves.
    """

    def __init__(
        self, machine: Machine, sensor: Sensor, parameters: tuple[Parameter, ...], known: tuple[Hypothesis, ...],
        together: Together | None = None,
    ) -> None:  # fmt: skip
        self.machine, self.sensor, self.parameters, self.known = machine, sensor, parameters, known
        self.together = together
        self._nominal = np.zeros(0) if together is None else together.nominal(machine, sensor)
        self._numbers = numbers_of(machine)
        names = (*(p.name for p in parameters), *(together.names if together else ()), HOUSING)
        self._own = {name: NUMBER_OF[name] for name in names if name in NUMBER_OF}
        self._of = NONE
        self._physics = {k: p for k, p in enumerate(parameters) if not p.of_record}
        self._made: dict[tuple[float, ...], tuple[Coefficients, Sensor]] = {}

    def coefficients(self, hypothesis: Hypothesis, points: np.ndarray) -> list[tuple[Coefficients, Sensor]]:
        """Coefficients under a load of 1, and the sensor, at each of some points (p, g); points that differ in single
        records alone share them, and so do those of one call and the next."""
        if self._of is not hypothesis:
            every = enumerate(self.parameters + hypothesis.parameters)
            self._physics = {k: p for k, p in every if not p.of_record}
        if self._of is not hypothesis or len(self._made) > _KEPT:
            self._of, self._made = hypothesis, {}
        found = []
        for z in points[:, list(self._physics)].tolist():
            key = tuple(z)
            if key not in self._made:
                values = self._values(self._physics.values(), z)
                numbers = self._numbers | {number: values[name] for name, number in self._own.items() if name in values}
                numbers["load_torque"] = 1.0 + values.get(LOAD, 0.0)
                effects, sensor = self._extended(hypothesis, values)
                item = coefficients_with(self.machine, numbers, self.machine.effects_with(*effects))
                self._made[key] = item, sensor
            found.append(self._made[key])
        return found

    def at(self, hypothesis: Hypothesis, point: np.ndarray) -> tuple[Machine, Sensor]:
        """Machine and sensor at a point (g,)."""
        values = self.values(hypothesis, point)
        effects, sensor = self._extended(hypothesis, values)
        return changed(self.machine, {name: values[name] for name in self._own if name in values}, effects), sensor

    def values(self, hypothesis: Hypothesis, point: np.ndarray) -> dict[str, float]:
        """Values of all global parameters by name, and of the numbers that they stand for."""
        return self._values(self.parameters + hypothesis.parameters, point.tolist())

    def _values(self, parameters: Iterable[Parameter], z: Sequence[float]) -> dict[str, float]:
        values = {p.name: p.value(v) for p, v in zip(parameters, z, strict=True)}
        if self.together is not None:
            values |= self.together.values(z[: self.together.axes.shape[1]], self._nominal)
        return values

    def _extended(self, hypothesis: Hypothesis, values: Mapping[str, float]) -> tuple[list[MachineEffect], Sensor]:
        """Effects on the machine, and the sensor, that values stand for."""
        effects, sensor = [], self.sensor
        if self.together is not None:
            effects += [_moved(effect, values) for effect in self.machine.effects]
            sensor = dataclasses.replace(sensor, gain=values[GAIN]) if GAIN in values else sensor
        for one in (*self.known, *hypothesis.effects):
            effect = effect_of(one, values)
            if isinstance(effect, MachineEffect):
                effects.append(effect)
            elif isinstance(effect, SensorEffect):
                sensor = effect.extend_sensor(sensor)
        return effects, sensor


def _moved(effect: MachineEffect, values: Mapping[str, float]) -> MachineEffect:
    """An effect with those of its numbers that are among some values."""
    names = (field.name for field in dataclasses.fields(effect))
    own = {name: values[f"{effect.name}.{name}"] for name in names if f"{effect.name}.{name}" in values}
    return dataclasses.replace(effect, **own) if own else effect
