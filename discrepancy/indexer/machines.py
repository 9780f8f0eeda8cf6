"""Machines and sensors that global points of a model stand for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from discrepancy.indexer.library import HOUSING, effect_of
from discrepancy.indexer.parameters import changed
from discrepancy.model import NONE, Hypothesis, Parameter
from indexer_env.coefficients import Coefficients, coefficients_with, number_of, numbers_of
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
    fitted : sequence of str
        Names of the machine's parameters.
    parameters : sequence of Parameter
        Of a point, before those of a hypothesis.
    known : sequence of Hypothesis
        Effects that the machine has, their parameters among these.
    """

    def __init__(
        self, machine: Machine, sensor: Sensor, fitted: Sequence[str], parameters: tuple[Parameter, ...],
        known: tuple[Hypothesis, ...],
    ) -> None:  # fmt: skip
        self.machine, self.sensor, self.parameters, self.known = machine, sensor, parameters, known
        self._numbers = numbers_of(machine)
        self._fitted = tuple((name, number_of(name)) for name in (*fitted, HOUSING))
        self._of = NONE
        self._made: dict[tuple[float, ...], tuple[Coefficients, Sensor]] = {}

    def coefficients(self, hypothesis: Hypothesis, points: np.ndarray) -> list[tuple[Coefficients, Sensor]]:
        """Coefficients without load, and the sensor, at each of some points (p, g); points that differ in single
        records alone share them, and so do those of one call and the next."""
        parameters = self.parameters + hypothesis.parameters
        own = [k for k, p in enumerate(parameters) if not p.of_record]
        if self._of is not hypothesis or len(self._made) > _KEPT:
            self._of, self._made = hypothesis, {}
        found = []
        for z in points[:, own].tolist():
            key = tuple(z)
            if key not in self._made:
                values = {parameters[k].name: parameters[k].value(v) for k, v in zip(own, z, strict=True)}
                numbers = self._numbers | {number: values[name] for name, number in self._fitted if name in values}
                effects, sensor = self._extended(hypothesis, values)
                item = coefficients_with(self.machine, numbers, self.machine.effects_with(*effects))
                self._made[key] = item, sensor
            found.append(self._made[key])
        return found

    def at(self, hypothesis: Hypothesis, point: np.ndarray) -> tuple[Machine, Sensor]:
        """Machine and sensor at a point (g,)."""
        values = self.values(hypothesis, point)
        effects, sensor = self._extended(hypothesis, values)
        own = {name: values[name] for name, _ in self._fitted if name in values}
        return changed(self.machine, own, effects), sensor

    def values(self, hypothesis: Hypothesis, point: np.ndarray) -> dict[str, float]:
        """Values of all global parameters by name."""
        parameters = self.parameters + hypothesis.parameters
        return {p.name: p.value(z) for p, z in zip(parameters, point.tolist(), strict=True)}

    def _extended(self, hypothesis: Hypothesis, values: Mapping[str, float]) -> tuple[list[MachineEffect], Sensor]:
        """Effects on the machine, and the sensor, that values of parameters stand for."""
        effects, sensor = [], self.sensor
        for one in (*self.known, *hypothesis.effects):
            effect = effect_of(one, values)
            if isinstance(effect, MachineEffect):
                effects.append(effect)
            elif isinstance(effect, SensorEffect):
                sensor = effect.extend_sensor(sensor)
        return effects, sensor
