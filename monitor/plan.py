"""What all machines of a monitor share, and what comes of a block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from indexer_records.conditions import Pulse
from monitor.alarms import Event, Limits, Rules
from monitor.analysis.finding import Finding, Size
from monitor.analysis.remaining import Remaining
from monitor.intake.cutter import CutTurn

CHANGE = "change"
"""Quantity of what no fault explains: how far a turn is from what was taught and from what is usual."""

DEFAULT_RULES = Rules()


@dataclass(frozen=True)
class Plan:
    """What all machines of a monitor share.

    Attributes
    ----------
    limits : mapping of str to Limits
        Of each quantity, and of CHANGE.
    rules : Rules
    window : int
        Turns of the running median.
    jitter : float
        By how much the time of a block may be off [s].
    pulse_range : tuple of float
        Least and greatest value of a pulse.
    pulse : Pulse
    pulse_angle : float or None
        Cam angle at the edge that begins a turn [rad], counted from the index out of station 0; None: it is not known.
    sensor_radius : float or None
        Of the accelerometers [m].
    stations : int or None
        Of the tables; the level of each is followed where a pulse marks the turns. None: it is not known.
    """

    limits: Mapping[str, Limits]
    rules: Rules = DEFAULT_RULES
    window: int = 7
    jitter: float = 0.02
    pulse_range: tuple[float, float] = (0.0, 1.0)
    pulse: Pulse = Pulse()
    pulse_angle: float | None = None
    sensor_radius: float | None = None
    stations: int | None = None


@dataclass(frozen=True, eq=False)
class Turn:
    """A turn that was accepted.

    number    its number, from 1
    cut       the turn as it was cut
    problem   state and sentence where it was not diagnosed
    finding   what it shows; None where there is a problem
    sizes     smoothed, by quantity
    remaining running time to the limit, by quantity, where it can be told
    """

    number: int
    cut: CutTurn
    problem: tuple[str, str] | None
    finding: Finding | None
    sizes: Mapping[str, Size]
    remaining: Mapping[str, Remaining]


@dataclass(eq=False)
class Outcome:
    """What a block has led to."""

    turns: list[Turn] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


@dataclass(frozen=True)
class Change:
    """What came of a batch for one machine: its summary, and what happened to its alarms; `own`: not seen to change in
    another process."""

    summary: dict[str, Any]
    events: tuple[Event, ...]
    own: bool = True
