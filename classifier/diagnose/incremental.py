"""Samples as they come -> a report at every turn; a whole signal is diagnosed by the same means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from classifier.diagnose.diagnosis import Diagnosis, diagnose_turn
from classifier.model import Model
from indexer_env.errors import SignalError
from indexer_env.signal import Signal
from indexer_records.conditions import Pulse, RecordConditions, TurnGrid
from indexer_records.measured import same_rate
from indexer_records.resample import MOST_UPSAMPLING
from indexer_records.stream import StreamedTurn, TurnStream
from indexer_records.turns import pulse_levels


@dataclass(frozen=True, eq=False)
class TurnReport:
    """What became of one turn of the table.

    turn             its number, from 0
    start, duration  where it begins after the first sample, and how long it lasts [s]
    problem          why it was not diagnosed, as the end of a sentence; "" where it was
    diagnosis        None where there is a problem
    record           (samples,) or (channels, samples) float32 that was diagnosed, at the model's rate; None where there
                     is a problem
    """

    turn: int
    start: float
    duration: float
    problem: str
    diagnosis: Diagnosis | None
    record: np.ndarray | None

    @property
    def verdict(self) -> str:
        """The name of the class, or why there is none: see `Diagnosis.verdict`, or the problem."""
        return f"not diagnosed: it {self.problem}" if self.diagnosis is None else self.diagnosis.verdict

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, texts, lists and mappings, for JSON; without the record."""
        place = {
            "turn": self.turn,
            "start": self.start,
            "duration": self.duration,
            "verdict": self.verdict,
            "problem": self.problem,
        }
        return place | ({} if self.diagnosis is None else self.diagnosis.to_dict())


class IncrementalDiagnoser:
    """Diagnoses a measurement that is still running: a report at the end of every turn.

    The reports are those of the whole measurement diagnosed at once, bit for bit, in whatever pieces the samples come.
    Memory is bounded by the length of two turns. A turn whose sensor was dead, clipped or gave no number is reported
    with this as its problem, as is one that does not show the table's indexing as the training records do: none at all,
    at another rate, or with the sign reversed.

    model        a trained classifier
    sample_rate  of the samples [Hz]; within RATE_TOLERANCE of the model's they are taken as they are, at a higher one
                 records are resampled as `datagen.ingest` does
    unit         of the samples
    known        what is known of the measurement beside its samples
    pulse_range  least and greatest value, in its unit, of a once-per-turn pulse that is fed with the samples, by which
                 its threshold is set and what counts as noise on it; None: no pulse, turns follow each other from the
                 first sample on, each of the length of the model's records
    pulse        which edge of the pulse begins a turn, and how far turns may be off that length
    source       what messages call the measurement
    quantity     what is measured

    Raises SignalError for a measurement that does not fit the model, ParameterError for numbers that are none.
    """

    def __init__(
        self,
        model: Model,
        sample_rate: float,
        unit: str,
        known: RecordConditions = RecordConditions(),
        pulse_range: tuple[float, float] | None = None,
        pulse: Pulse = Pulse(),
        source: str = "the measurement",
        quantity: str = "table_acceleration",
    ) -> None:
        check_fits(model, source, sample_rate, quantity, unit)
        model.conditions.check(known, source)
        if same_rate(sample_rate, model.sample_rate):
            sample_rate = model.sample_rate
        grid = TurnGrid(model.sample_rate, model.samples / model.sample_rate, pulse)
        self._stream = TurnStream(sample_rate, grid, pulse_range, model.channels)
        self._model, self._turns = model, 0

    def feed(self, values: np.ndarray, pulse: np.ndarray | None = None) -> list[TurnReport]:
        """Reports of the turns that these samples (n,), or (channels, n) for a model of several, complete; none where
        the turn goes on.

        pulse  (n,) the once-per-turn pulse at the same times, where one was asked for

        Raises SignalError for what is no array of real numbers; the samples are then not taken.
        """
        return [self._report(turn) for turn in self._stream.feed(values, pulse)]

    def finish(self) -> list[TurnReport]:
        """Reports of complete turns that waited for the samples after them, which resampling needs; then all samples
        are forgotten."""
        reports = [self._report(turn) for turn in self._stream.finish()]
        self._turns = 0
        return reports

    def reset(self) -> None:
        """Forget all samples: the next one is the first of a turn (without a pulse)."""
        self._stream.reset()
        self._turns = 0

    def _report(self, turn: StreamedTurn) -> TurnReport:
        number, self._turns = self._turns, self._turns + 1
        problem = turn.problem or self._model.conditions.flaw(turn.clipped_share, turn.constant_share)
        if not problem and turn.record is not None:
            problem = self._model.conditions.indexing_flaw(turn.record)
        if problem or turn.record is None:
            return TurnReport(number, turn.start, turn.duration, problem, None, None)
        diagnosis = diagnose_turn(self._model, turn.record)
        return TurnReport(number, turn.start, turn.duration, "", diagnosis, turn.record)


def check_fits(model: Model, name: str, sample_rate: float, quantity: str, unit: str) -> None:
    """Refuse a signal of another quantity or unit than the model was trained on, or of too low a rate [Hz].

    Raises SignalError.
    """
    if (quantity, unit) != (model.quantity, model.unit):
        raise SignalError(
            f"{name} must be {model.quantity} in {model.unit} as the model was trained on, "
            f"got {quantity} in {unit}; convert it (angular = tangential / radius) or train on "
            "records of such a sensor."
        )
    if model.sample_rate > MOST_UPSAMPLING * sample_rate:
        raise SignalError(
            f"{name} must be sampled at {model.sample_rate:g} Hz or faster as the model was trained on, "
            f"got {sample_rate:g} Hz; record at that rate or train on records of this one."
        )


def diagnose(
    model: Model,
    signal: Signal | Sequence[Signal],
    known: RecordConditions = RecordConditions(),
    pulse_values: np.ndarray | None = None,
    pulse: Pulse = Pulse(),
) -> list[TurnReport]:
    """Diagnose every whole turn of a signal; as `IncrementalDiagnoser`.

    signal        for a model of several channels one signal each, in its order, of one rate, length and unit
    pulse_values  (n,) a once-per-turn pulse at the times of the samples; None: there is none

    Raises SignalError for a signal that does not fit the model or is shorter than one turn, and for a pulse without an
    edge.
    """
    signals = (signal,) if isinstance(signal, Signal) else tuple(signal)
    signal, name = signals[0], signals[0].source or "the signal"
    if len(signals) != model.channels:
        raise SignalError(
            f"{name} must give {model.channels} channels as the model was trained on, got {len(signals)}; "
            "name them in their order (read.signal_column=[NAME,NAME])."
        )
    values = signal.values if len(signals) == 1 else np.stack([channel.values for channel in signals])
    span = None
    try:
        if pulse_values is not None:
            *extremes, level = pulse_levels(pulse_values, pulse)
            span, pulse = (extremes[0], extremes[1]), replace(pulse, threshold=level)
        diagnoser = IncrementalDiagnoser(
            model, signal.sample_rate, signal.unit, known, span, pulse, name, signal.quantity
        )
        reports = [*diagnoser.feed(values, pulse_values), *diagnoser.finish()]
    except SignalError as error:
        raise error if str(error).startswith(name) else SignalError(f"{name}: {error}") from None
    if not reports:
        needed = model.samples / model.sample_rate
        what = (
            f"at least {needed:g} s, one turn of the table" if span is None else "two pulses at least, one turn apart"
        )
        raise SignalError(f"{name} must hold {what}, got {signal.duration:g} s; record for longer.")
    return reports
