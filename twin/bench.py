"""The healthy records of a machine, as a twin is made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from discrepancy.indexer import Experiment
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env.errors import SignalError
from indexer_env.operating_point import OperatingPoint
from twin.turns import Cells


@dataclass(frozen=True, eq=False)
class Bench:
    """The healthy records of a machine, checked: those fitted, then those held out."""

    subject: IndexerSubject

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """All of them."""
        return (*self.subject.model.experiments, *self.subject.held_out.experiments)

    @property
    def points(self) -> list[OperatingPoint]:
        """Speed and load of each record, once where a part of it is held out."""
        return list({e.signal.source: e.operating_point for e in self.experiments}.values())

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return self.experiments[0].signal.sample_rate

    @property
    def shift(self) -> float:
        """Standard deviation of the cam angle at a record's first sample [rad]."""
        return max(e.start_uncertainty for e in self.experiments)

    @property
    def start_compared(self) -> bool:
        """Whether the cam angle of a record was found by comparison with the drawing."""
        return any(e.start_compared for e in self.experiments)

    def check(self, motor_speeds: Sequence[float] = ()) -> None:
        """Refuse what would keep a twin, for these motor speeds [rad/s] too, from being made, before anything is fitted
        or an old twin is removed."""
        machine = self.subject.machine
        Cells.of(machine, self.rate, max([*motor_speeds, *(e.operating_point.motor_speed for e in self.experiments)]))
        fitted = self.subject.model.experiments
        if not any(e.signal.duration >= machine.turn_duration(e.operating_point) for e in fitted):
            raise no_whole_turn()


def no_whole_turn() -> SignalError:
    """The refusal of records none of which, in the part that is fitted, holds a turn of the table."""
    return SignalError(
        "One healthy record or more must hold a whole turn of the table in the part that is fitted, got none; record "
        "for longer, or hold whole records out."
    )
