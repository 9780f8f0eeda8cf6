"""The indexing machine's own parameters: how well each is known, and the machine that a set of values stands for."""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Sequence

import numpy as np

from discrepancy.indexer.windows import Experiment
from discrepancy.model import Parameter
from indexer_env.effects import MachineEffect
from indexer_env.errors import refuse
from indexer_env.machine import Machine

UNCERTAINTY = {
    "input_joint.stiffness": 0.12, "input_joint.damping": 0.3, "input_joint.backlash": 0.15,
    "output_joint.stiffness": 0.12, "output_joint.damping": 0.3,
    "table_inertia": 0.1, "cam_inertia": 0.1, "follower_inertia": 0.1,
}  # fmt: skip
"""Relative standard deviation (of ln) of each parameter where the user states none: stiffnesses come from catalogues,
damping from experience, inertias from drawings with unknown fixtures on the table."""

_FACTORS = (0.95, 0.98, 1.02, 1.05)
"""By which all torques are multiplied at once, steps within how well they are known."""

_UNITS = {"stiffness": "N m/rad", "damping": "N m s/rad", "backlash": "rad", "inertia": "kg m²"}

OF_RECORDS = {"start_angle": "rad", "speed": "-", "drift": "-", "load": "-", "clock": "-", "inertia": "-"}
"""Nuisance parameters of each record with their units; but for the angle relative to what was stated, of the inertia as
its logarithm."""

_BOUNDED = ("drift", "load", "clock", "inertia")
"""Those that an effect could hide behind: a clock that is far off looks like a gain."""

_REACH = 3.0
"""Standard deviations to which a parameter is bounded: what lies beyond is not this machine, but an effect."""


def base_parameters(machine: Machine, uncertainty: dict[str, float]) -> tuple[Parameter, ...]:
    """The machine's parameters with their uncertainties; a play or damping that is nominally 0 stays 0."""
    if machine.model != "B":
        raise refuse("Machine", "model", "'B'", machine.model, "a loose base is found as the effect base.looseness")
    parameters = []
    for name, spread in {**UNCERTAINTY, **uncertainty}.items():
        nominal = read(machine, name)
        if nominal == 0.0:
            continue
        unit = next(unit for ending, unit in _UNITS.items() if name.endswith(ending))
        reach = math.exp(_REACH * spread)
        low, high, rough = nominal / reach, nominal * reach, name.endswith("backlash")
        parameters.append(Parameter(name, unit, nominal, spread, low, high, known=True, logarithmic=True, rough=rough))
    return tuple(parameters)


def record_parameters(number: int, experiment: Experiment) -> tuple[Parameter, ...]:
    """What is free in each record beside its stated value: the drive's angle at its first sample, its mean speed, how
    the speed drifts, load torque, sampling rate and the table's inertia; what is known exactly is no parameter."""
    spreads = (
        experiment.start_uncertainty, experiment.speed_uncertainty, experiment.drift_uncertainty,
        experiment.load_uncertainty if experiment.operating_point.load_torque != 0.0 else 0.0,
        experiment.clock_uncertainty, experiment.inertia_uncertainty,
    )  # fmt: skip
    return tuple(
        Parameter(f"record {number}.{name}", unit, 0.0, spread, -_REACH * spread, _REACH * spread, True, record=number)
        if name in _BOUNDED
        else Parameter(f"record {number}.{name}", unit, 0.0, spread, known=True, record=number)
        for (name, unit), spread in zip(OF_RECORDS.items(), spreads, strict=True)
        if spread > 0.0
    )


class OfRecords:
    """Values of the nuisance parameters of `count` records, given all parameters of a model."""

    def __init__(self, parameters: Sequence[Parameter], count: int) -> None:
        at = {p.name: k for k, p in enumerate(parameters)}
        columns = [[at.get(f"record {number}.{name}", -1) for number in range(count)] for name in OF_RECORDS]
        self._columns = np.array(columns)
        self._scales = np.array([[0.0 if k < 0 else parameters[k].scale for k in row] for row in columns])

    def values(self, points: np.ndarray, record: np.ndarray) -> np.ndarray:
        """Values (v, n) of all OF_RECORDS of records (n,) at global points (n, g); 0 where they are known exactly."""
        return self._scales[:, record] * points[np.arange(len(record)), self._columns[:, record]]

    def value(self, name: str, points: np.ndarray, record: np.ndarray) -> np.ndarray:
        """Value (n,) of one of them."""
        return self.values(points, record)[[*OF_RECORDS].index(name)]


def torque_power(unit: str) -> int:
    """Power in which torque enters a unit: 1 for stiffness, damping, inertia and torque, -1 for compliance, else 0."""
    if unit.startswith(("N m", "kg m²")):
        return 1
    return -1 if unit.endswith("N m)") else 0


def scaled(parameters: Sequence[Parameter], point: np.ndarray) -> np.ndarray:
    """Scaled points (k, g) whose inertias, stiffnesses and torques are all larger or smaller by one factor: the motion
    stays, but for what the load torque, which is known, makes of it."""
    rows = [(p, float(z), torque_power(p.unit)) for p, z in zip(parameters, point, strict=True)]
    return np.array(
        [[p.coordinate(p.value(z) * factor**power) if power else z for p, z, power in rows] for factor in _FACTORS]
    )


def read(machine: Machine, name: str) -> float:
    """Value of a parameter, ``joint.field`` or ``field``."""
    return float(operator.attrgetter(name)(machine))


def changed(machine: Machine, values: dict[str, float], effects: Sequence[MachineEffect] = ()) -> Machine:
    """The machine with these values of its parameters and further effects."""
    fields: dict[str, object] = {}
    joints: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        joint, _, field = name.rpartition(".")
        if joint:
            joints.setdefault(joint, {})[field] = value
        else:
            fields[name] = value
    for joint, changes in joints.items():
        fields[joint] = dataclasses.replace(getattr(machine, joint), **changes)
    return dataclasses.replace(machine, **fields, effects=machine.effects_with(*effects))
