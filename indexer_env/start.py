"""What one machine of a fleet starts an episode with, and its coefficients with the faults that it has at a time."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from indexer_env.coefficients import Coefficients, coefficients
from indexer_env.errors import ParameterError
from indexer_env.fault_law import Course
from indexer_env.faults import Faults
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.modes import LARGEST_PHASE_STEP, largest_steps
from indexer_env.operating_point import OperatingPoint

_NO_EDGE = -1e90
"""rad; stands for -inf where others of a call have edges: the cube of a hardening contact must stay finite."""

_EDGES = [layout.COEFFICIENT_NAMES.index(f"edge_{joint}") for joint in (1, 2, 3)]


@dataclass(frozen=True, eq=False)
class Start:
    """What one item starts an episode with."""

    machine: Machine
    operating_point: OperatingPoint
    course: Course

    def item(self, faults: Faults, step: float) -> Coefficients:
        """The coefficients with these faults, for an integrator's step [s].

        Raises
        ------
        ParameterError
            Faults that the machine's model lacks, or a step that does not resolve its fastest mode.
        """
        return _item(faults.applied_to(self.machine), self.operating_point.load_torque, step)


@functools.lru_cache(maxsize=1024)
def _item(machine: Machine, load_torque: float, step: float) -> Coefficients:
    item = coefficients(machine, OperatingPoint(load_torque=load_torque))
    largest = float(largest_steps([item])[0])
    if step > largest:
        raise ParameterError(
            f"IndexerEnv.step must be <= {largest:.3g} s to resolve the fastest mode of {machine.name} "
            f"(phase per step <= {LARGEST_PHASE_STEP} rad), got {step:.3g} s; set step to {0.9 * largest:.2g}."
        )
    item.row[_EDGES] = np.maximum(item.row[_EDGES], _NO_EDGE)
    item.row.flags.writeable = False
    return item
