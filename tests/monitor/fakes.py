"""A diagnoser that needs no model: the play is the record's level, and a machine whose turns last a second."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from indexer_env.signal import Signal
from indexer_records.conditions import RecordConditions
from indexer_records.stream import StreamedTurn
from monitor.alarms import Limits, Rules
from monitor.analysis.finding import Finding, Size
from monitor.intake.blocks import NANO, Block
from monitor.intake.cutter import Mode
from monitor.plan import CHANGE, Plan

RATE = 100.0
START_NS = 1_800_000_000 * NANO
FAST, SLOW = Mode("60 rpm", RATE, 1.0, "m/s^2", 10.0), Mode("48 rpm", RATE, 1.25, "m/s^2", 8.0)
PLAN = Plan(
    {"backlash_deg": Limits(3.0, 6.0, 12.0), "crack": Limits(0.2, 0.4, 0.6), CHANGE: Limits(1.5, 3.0, 6.0)},
    Rules(on_delay=2, off_delay=3),
    window=3,
)


class FakeDiagnoser:
    """The play is the level of the record, known to 10 %; a record of zeros is dead."""

    quantities = ("backlash_deg", "crack")
    units: Mapping[str, str] = {}

    def __init__(self, *modes: Mode) -> None:
        self.modes = modes or (FAST,)
        self.origins: Mapping[str, str] = {mode.name: "one" for mode in self.modes}

    def flaw(self, mode: Mode, turn: StreamedTurn) -> tuple[str, str] | None:
        if turn.record is None:
            return "other_speed", turn.problem
        return ("dead", "it is dead") if not turn.record.any() else None

    def diagnose_turn(
        self, signal: Signal, conditions: RecordConditions, start_angle: float | None = None
    ) -> Finding:  # fmt: skip
        level = float(np.sqrt(np.mean(signal.values**2)))
        sizes = {"backlash_deg": Size(level, 0.9 * level, 1.1 * level), "crack": Size(0.0, 0.0, 0.1)}
        return Finding("intact" if level < 3 else "backlash", level < 3, 0.9, sizes, 0.5, level)


def samples(level: float, first: int, count: int) -> np.ndarray:
    """A tone of this level that goes on over blocks; whole periods in a turn of either mode."""
    return level * np.sqrt(2.0) * np.sin(2 * np.pi * 20.0 * (first + np.arange(count)) / RATE)


def block(first: int, count: int = 50, level: float = 1.0, machine: str = "m", pulse: bool = False, **more) -> Block:
    """Samples `first` … `first + count` of a machine that started at START_NS; a pulse every 100 samples."""
    place = first + np.arange(count)
    start = START_NS + round(first / RATE * NANO)
    pulses = (place % 100 < 5).astype(float) if pulse else None
    return Block(machine, more.pop("start_ns", start), RATE, "m/s^2", samples(level, first, count), pulses, **more)
