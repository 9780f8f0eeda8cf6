"""What one turn shows, and the protocol of whoever tells it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from indexer_env.signal import Signal
from indexer_records.conditions import RecordConditions
from indexer_records.stream import StreamedTurn
from monitor.intake.cutter import Mode


class Size(NamedTuple):
    """How far something is, with the ends of its interval, in the unit of its quantity."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Finding:
    """What one turn shows.

    Attributes
    ----------
    verdict : str
        In words: the name of the fault, that there is none, or why none can be named.
    healthy : bool
        Whether the verdict is that nothing is wrong.
    probability : float or None
        Of the verdict [-], where the model tells it.
    sizes : mapping of str to Size
        Of each fault, by the name of its quantity.
    novelty : float or None
        Strangeness [-]; above 1 the turn is unlike all that was taught.
    level : float
        Root mean square of the record [unit of the record].
    more : mapping
        Whatever else is worth showing, as plain values.
    """

    verdict: str
    healthy: bool
    probability: float | None
    sizes: Mapping[str, Size]
    novelty: float | None
    level: float
    more: Mapping[str, Any] = field(default_factory=dict)


class Diagnoser(Protocol):
    """Whoever says what a turn shows, in milliseconds; a twin takes seconds for a turn with an alarm.

    Attributes
    ----------
    origins : mapping of str to str
        By mode, a checksum of what its findings follow from: findings of others are of no trend with these.
    modes : tuple of Mode
        The speeds that were taught.
    quantities : tuple of str
        Names of the sizes that it tells.
    units : mapping of str to str
        Their units, where they are not those that the page has for the name.
    """

    origins: Mapping[str, str]
    modes: tuple[Mode, ...]
    quantities: tuple[str, ...]
    units: Mapping[str, str]

    def flaw(self, mode: Mode, turn: StreamedTurn) -> tuple[str, str] | None:
        """The state of `monitor.intake.states` that keeps a turn from being diagnosed, and a sentence; None: sound."""
        ...

    def diagnose_turn(
        self, signal: Signal, conditions: RecordConditions, start_angle: float | None = None
    ) -> Finding:  # fmt: skip
        """What a turn shows; `conditions` has the speed at which it was recorded, also where it was stretched, and
        `start_angle` is the cam angle at its first sample [rad], None where it is not known."""
        ...
