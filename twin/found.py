"""A fault of an answer, from what networks or physics say of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from indexer_env.effects import EFFECTS
from indexer_env.machine import Machine
from twin.diagnosis import TurnDiagnosis
from twin.faults import FAULTS, Fault, number_of
from twin.physics import PhysicalFault, Physics

BOTH = "physics and network"
"""Who names a fault."""


@dataclass(frozen=True)
class FoundFault:
    """A fault of the answer.

    Attributes
    ----------
    name, words : str
    size, low, high : float
        In the shop's unit.
    unit : str
    probability : float
    station : int or None
    by : str
        "physics and network", "physics" or "network".
    matters : bool
    sized_by : str
        Whose size and interval it has: "physics" or "network".
    """

    name: str
    words: str
    size: float
    low: float
    high: float
    unit: str
    probability: float
    station: int | None
    by: str
    matters: bool
    sized_by: str = "network"

    @property
    def told(self) -> str:
        """As a sentence has it."""
        place = "" if self.station is None else f" at station {self.station}"
        digits = [number_of(value) for value in (self.size, self.low, self.high)]
        return f"{self.words}{place}, {digits[0]} {self.unit} ({digits[1]} to {digits[2]})"


def by_network(network: TurnDiagnosis) -> tuple[FoundFault, ...]:
    """The faults of the networks."""
    return tuple(
        FoundFault(
            one.name, FAULTS[one.name].words, one.size, one.low, one.high, one.unit, one.probability, one.station,
            "network", one.matters,
        )
        for one in network.faults
    )  # fmt: skip


def by_physics(
    physics: Physics, seen: Sequence[FoundFault], machine: Machine, matters: Mapping[str, float],
    faults: Sequence[Fault], own: bool = False,
) -> tuple[FoundFault, ...]:  # fmt: skip
    """The faults of physics; those that the networks name too with the networks' size, or with its `own`."""
    named, table = {one.name: one for one in seen}, {fault.name: fault for fault in faults}
    found = []
    for one in physics.faults:
        both = named.get(one.fault)
        if both is None:
            found.append(physical(one, table.get(one.fault), machine, matters))
        else:
            first, second = (one, both) if own else (both, one)
            station = second.station if first.station is None else first.station
            whose = physical(one, table.get(one.fault), machine, matters) if own else both
            found.append(dataclasses.replace(whose, probability=both.probability, by=BOTH, station=station))
    return tuple(found)


def physical(one: PhysicalFault, fault: Fault | None, machine: Machine, matters: Mapping[str, float]) -> FoundFault:
    """A fault as physics measured it; `fault` is its entry in the twin's table, None for an effect of no table."""
    if fault is None:
        words = EFFECTS[one.fault].sentence.rstrip(".")
        return FoundFault(
            one.fault, words, one.size, one.low, one.high, "", one.probability, one.station, "physics", True, "physics"
        )  # fmt: skip
    shop = [fault.told(min(share, fault.most), machine) for share in (one.size, one.low, one.high)]
    words = " or ".join((fault.words, *one.rivals))
    return FoundFault(
        fault.name, words, shop[0], min(shop[1:]), max(shop[1:]), fault.unit, one.probability, one.station, "physics",
        abs(one.size) >= matters.get(fault.name, 0.0), "physics",
    )  # fmt: skip
