"""What one machine of a fleet starts an episode with, and its coefficients with the faults that it has at a time."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

from indexer_env.coefficients import Coefficients, coefficients
from indexer_env.fault_law import Course
from indexer_env.faults import Faults, most_backlash
from indexer_env.machine import Machine
from indexer_env.modes import coarse_step, largest_steps
from indexer_env.operating_point import OperatingPoint


@dataclass(frozen=True, eq=False)
class Start:
    """What one item starts an episode with."""

    machine: Machine
    operating_point: OperatingPoint
    course: Course

    def faults_at(self, time: float, work: float) -> Faults:
        """The faults of its course at a time [s] and work [J], on its machine."""
        return self.course.at(time, work, most_backlash(self.machine))

    @property
    def worst(self) -> Faults:
        """Every fault that its course can reach on its machine."""
        return self.course.worst_of(most_backlash(self.machine))

    def item(self, faults: Faults, step: float) -> Coefficients:
        """The coefficients with these faults, for an integrator's step [s]; raises as `items_of`."""
        return items_of([(self, faults)], step)[0]

    def check(self, step: float) -> None:
        """Refuse what the first or the worst faults of its course make of it; raises as `items_of`."""
        items_of([(self, self.faults_at(0.0, 0.0)), (self, self.worst)], step)


def items_of(starts: Sequence[tuple[Start, Faults]], step: float) -> list[Coefficients]:
    """The coefficients of starts with faults, for an integrator's step [s].

    Raises
    ------
    ParameterError
        Faults that the machine's model lacks, or a step that does not resolve its fastest mode.
    """
    machines = [faults.applied_to(start.machine) for start, faults in starts]
    items = [
        _item(machine, start.operating_point.load_torque, step)
        for machine, (start, _) in zip(machines, starts, strict=True)
    ]
    _check_steps(machines, items, step)
    return items


@functools.lru_cache(maxsize=1024)
def _item(machine: Machine, load_torque: float, step: float) -> Coefficients:
    """The coefficients for a step that is still to be checked; their row can be written until it has been."""
    return coefficients(machine, OperatingPoint(load_torque=load_torque))


def _check_steps(machines: Sequence[Machine], items: Sequence[Coefficients], step: float) -> None:
    """Refuse a step that does not resolve a machine; together, as the modes of one cost nearly those of a hundred."""
    new = [place for place, item in enumerate(items) if item.row.flags.writeable]
    for model in {items[place].model for place in new}:
        members = [place for place in new if items[place].model == model]
        largest = largest_steps([items[place] for place in members])
        for place, most in zip(members, largest.tolist(), strict=True):
            if step > most:
                raise coarse_step("IndexerEnv", machines[place], items[place], step)
            items[place].row.flags.writeable = False
