"""Samples as they come -> turns with their records, however they are cut into pieces, in bounded memory.

The turns are those of `turns`, the records those of `resample`, each made from the samples around its turn alone.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from indexer_env.checks import check_number
from indexer_env.errors import SignalError
from indexer_records.conditions import TurnGrid
from indexer_records.quality import worst_quality
from indexer_records.resample import REACH, check_ratio, doubt, on_grid, resampled
from indexer_records.turns import EdgeFinder, Turn, turns_by_pulse

LONGEST_PIECE = 2**16
"""Samples taken in at once; a longer piece is cut, so that memory is bounded by the length of a turn."""


@dataclass(frozen=True, eq=False)
class StreamedTurn:
    """A turn of a running measurement.

    Attributes
    ----------
    start, duration : float
        Where it begins after the first sample of all, and how long it lasts [s].
    problem : str
        The rule it breaks, as the end of a sentence; "" for none.
    record : numpy.ndarray or None, shape (samples,) or (channels, samples), float32
        As `datagen.ingest` writes it; None where there is a problem.
    clipped_share, constant_share : float
        Of the turn's own samples [-], see `quality`, the largest of its channels; 0 where there is a problem.
    """

    start: float
    duration: float
    problem: str = ""
    record: np.ndarray | None = None
    clipped_share: float = 0.0
    constant_share: float = 0.0


class TurnStream:
    """Turns of a measurement that is still running.

    Parameters
    ----------
    rate : float
        Of the samples [Hz], > 0.
    grid : TurnGrid
        The records that turns become.
    pulse_range : tuple of float, optional
        Least and greatest value of a pulse that comes with the samples, in its unit; None: turns follow each other by
        the period from the first sample on.
    channels : int
        Of the measurement.

    Raises
    ------
    ParameterError
        The rate is none.
    SignalError
        The records' rate is too far above that of the samples; a pulse that `EdgeFinder` refuses.
    """

    def __init__(
        self, rate: float, grid: TurnGrid, pulse_range: tuple[float, float] | None = None, channels: int = 1
    ) -> None:
        check_number("TurnStream", "rate", rate, low=0.0, low_open=True, unit="Hz")
        check_ratio(rate, grid.rate)
        self._rate, self._grid, self._pulse_range = float(rate), grid, pulse_range
        self._channels = channels
        longest = grid.turn_duration * (1.0 + grid.pulse.tolerance)
        self._margin = math.ceil(REACH * max(1.0, rate * longest / grid.samples))
        # A turn, the wait until its last edge is sure, which may take another, and what lies around.
        self._kept = math.ceil(2.0 * longest * rate) + 2 * self._margin + 2
        self.reset()

    def reset(self) -> None:
        """Forget all samples: the next one is the first."""
        self._edges = None if self._pulse_range is None else EdgeFinder(*self._pulse_range, self._grid.pulse)
        self._edge: float | None = None
        self._count = self._turns = 0
        self._waiting: deque[Turn] = deque()
        self._buffer, self._held = np.empty((self._channels, 2 * (self._kept + LONGEST_PIECE))), 0

    @property
    def count(self) -> int:
        """Samples that have come."""
        return self._count

    def feed(self, values: np.ndarray, pulse: np.ndarray | None = None) -> list[StreamedTurn]:
        """The turns that these samples complete.

        Parameters
        ----------
        values : array_like, shape (n,), of several channels (channels, n)
            Samples in the order in which they were taken, any number; not finite where the sensor gave none.
        pulse : array_like, shape (n,), optional
            The once-per-turn pulse at the same times.

        Raises
        ------
        SignalError
            Samples that are no real numbers of this shape, a pulse that is missing, not asked for or not finite. The
            stream is then as it was before.
        """
        samples = _samples(values, "values", self._channels)
        edges = self._checked_pulse(pulse, samples.shape[1])
        turns = []
        for first in range(0, samples.shape[1], LONGEST_PIECE):
            piece = slice(first, first + LONGEST_PIECE)
            self._take(samples[:, piece])
            self._find(None if edges is None else edges[piece])
            turns += self._ready(final=False)
        return turns

    def finish(self) -> list[StreamedTurn]:
        """The turns that are complete but waited for the samples after them, as none will come; all is forgotten."""
        turns = self._ready(final=True)
        self.reset()
        return turns

    def _checked_pulse(self, pulse: np.ndarray | None, samples: int) -> np.ndarray | None:
        if (pulse is None) != (self._edges is None):
            rule = "given with all samples" if pulse is None else "left out where its range was not given"
            raise SignalError(f"the pulse must be {rule}.")
        if pulse is None:
            return None
        checked = _samples(pulse, "pulse")[0]
        if len(checked) != samples:
            raise SignalError(f"the pulse must be as long as the samples, {samples}, got {len(checked)}.")
        if not np.isfinite(checked).all():
            place = self._count + int(np.argmin(np.isfinite(checked)))
            raise SignalError(f"the pulse must be finite, got {checked[place - self._count]} at sample {place}.")
        return checked

    def _take(self, samples: np.ndarray) -> None:
        count = samples.shape[1]
        if self._held + count > self._buffer.shape[1]:
            kept = min(self._kept, self._held)
            self._buffer[:, :kept] = self._buffer[:, self._held - kept : self._held]
            self._held = kept
        self._buffer[:, self._held : self._held + count] = samples
        self._held += count
        self._count += count

    def _find(self, pulse: np.ndarray | None) -> None:
        """Put the turns whose end has come into the queue."""
        period = self._grid.turn_duration
        if self._edges is None or pulse is None:
            # A turn may lack a millionth of a sample by the rounding of the rate, as in `turns_by_period`.
            whole = int(self._count / self._rate / period * (1.0 + 1e-9))
            self._waiting.extend(Turn(index * period, period) for index in range(self._turns, whole))
            self._turns = whole
            return
        for position, sure in zip(*self._edges.feed(pulse), strict=True):
            edge = float(position) / self._rate
            if self._edge is not None:
                (turn,), _ = turns_by_pulse(np.array([self._edge, edge]), period, self._grid.pulse.tolerance)
                if not turn.problem and sure / self._rate - edge > period:
                    turn = Turn(
                        turn.start, turn.duration, "must end with a pulse that rises within a turn, got a slower"
                    )
                self._waiting.append(turn)
            self._edge = edge

    def _ready(self, *, final: bool) -> list[StreamedTurn]:
        done = []
        while self._waiting:
            turn = self._waiting[0]
            first, last = self._reach(turn)
            if not turn.problem and last > self._count and not final:
                break
            self._waiting.popleft()
            done.append(self._streamed(turn, first, min(last, self._count)))
        return done

    def _on_grid(self, turn: Turn) -> bool:
        start, step = np.array([turn.start]), np.array([self._step(turn)])
        return on_grid(self._rate, self._grid.rate, start, step, self._grid.samples)

    def _reach(self, turn: Turn) -> tuple[int, int]:
        """First sample that the record of a turn depends on, and the one behind the last."""
        begin, end = turn.start * self._rate, (turn.start + turn.duration) * self._rate
        if self._on_grid(turn):
            return round(begin), round(begin) + self._grid.samples
        return max(0, math.floor(begin) - self._margin), math.ceil(end) + self._margin

    def _step(self, turn: Turn) -> float:
        # By the pulse, samples lie evenly over the turn; by the period, at the rate exactly.
        return turn.duration / self._grid.samples if self._edges is not None else 1.0 / self._grid.rate

    def _streamed(self, turn: Turn, first: int, last: int) -> StreamedTurn:
        if turn.problem:
            return StreamedTurn(turn.start, turn.duration, turn.problem)
        offset, own = self._count - self._held, self._on_grid(turn) and self._count >= self._grid.samples
        if own:
            # by a slow clock the last turn may end some samples behind what came
            first = min(first, last - self._grid.samples)
        stretch = self._buffer[:, first - offset : last - offset]
        finite = np.isfinite(stretch)
        if not finite.all():
            missing = int(np.count_nonzero(~finite))
            place = (first + int(np.argmin(finite.all(axis=0)))) / self._rate
            problem = f"must hold finite samples only, got {missing} that are none, the first at {place:.6g} s"
            return StreamedTurn(turn.start, turn.duration, problem)
        start = np.array([turn.start - first / self._rate])
        step, grid = np.array([self._step(turn)]), self._grid
        channels = (
            list(stretch)
            if own
            else [resampled(row, self._rate, grid.rate, start, step, grid.samples)[0] for row in stretch]
        )
        record = channels[0] if self._channels == 1 else np.stack(channels)
        with np.errstate(over="ignore"):
            record = record.astype(np.float32)
        if not np.isfinite(record).all():
            problem = "must stay within the range of float32, got a larger number"
            return StreamedTurn(turn.start, turn.duration, problem)
        begin, end = (self._sample_at(time) for time in (turn.start, turn.start + turn.duration))
        mine = self._buffer[:, begin - offset : max(begin + 1, end) - offset]
        return StreamedTurn(turn.start, turn.duration, "", record, **worst_quality(list(mine)))

    def _sample_at(self, time: float) -> int:
        """The first sample at a time [s] or after it."""
        return math.ceil(time * self._rate - float(doubt(time * self._rate)))


def _samples(values: np.ndarray, name: str, channels: int = 1) -> np.ndarray:
    """Values (n,) or (channels, n) as float64 (channels, n)."""
    array = np.asanyarray(values)
    if np.ma.isMaskedArray(array):
        array = np.ma.filled(array.astype(np.float64), np.nan)
    fits = array.ndim == 1 if channels == 1 else array.ndim == 2 and len(array) == channels
    if array.dtype.kind not in "iuf" or not fits:
        shape = f"shape {array.shape} of {array.dtype}"
        wanted = (
            "a one-dimensional array (n,)" if channels == 1 else f"an array ({channels}, n), a row for each channel"
        )
        raise SignalError(f"the {name} must be real numbers in {wanted}, got {shape}.")
    return array.astype(np.float64).reshape(channels, -1)
