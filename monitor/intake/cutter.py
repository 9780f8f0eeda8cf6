"""Blocks in their order -> turns with their times, for every operating mode that a model was taught."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from indexer_env.errors import SignalError
from indexer_env.units import RPM
from indexer_records.conditions import Pulse, TurnGrid
from indexer_records.measured import same_rate
from indexer_records.stream import StreamedTurn, TurnStream
from monitor.intake.blocks import NANO, Block

SPEED_TOLERANCE = 0.02
"""By which share a stated speed may differ from that of a mode, as a turn between two pulses may."""

_TURNS_BACK = 4
"""Turns for which it is known when each block was taken: a turn is told before another of its length has passed."""


@dataclass(frozen=True)
class Mode:
    """An operating mode: a speed at which a model was taught.

    Attributes
    ----------
    name : str
        As the page shows it, "1500 rpm".
    rate : float
        Of its records [Hz].
    duration : float
        Of a turn [s].
    unit : str
        Of its records.
    motor_speed : float or None
        Of the motor shaft [rad/s], where the model states it.
    """

    name: str
    rate: float
    duration: float
    unit: str
    motor_speed: float | None = None


@dataclass(frozen=True, eq=False)
class CutTurn:
    """A turn in its mode: when it began [ns since 1970], and what `TurnStream` says of it."""

    mode: Mode
    start_ns: int
    turn: StreamedTurn
    by_pulse: bool

    @property
    def end_ns(self) -> int:
        """When it ended [ns since 1970]."""
        return self.start_ns + round(self.turn.duration * NANO)


class OtherSpeed(SignalError):
    """Samples of a speed that was not taught."""


class Cutter:
    """Cuts the samples of one machine into turns.

    With a pulse every mode looks at the samples, and a turn belongs to the one whose duration it has. Without one the
    sender's speed says which mode looks; where there is but one mode it always does.

    Parameters
    ----------
    modes : sequence of Mode
    pulse_range : tuple of float
        Least and greatest value of a pulse.
    pulse : Pulse
        Its edge and tolerance.
    """

    def __init__(self, modes: Sequence[Mode], pulse_range: tuple[float, float], pulse: Pulse) -> None:
        self._modes, self._pulse_range, self._pulse = tuple(modes), pulse_range, pulse
        self._streams: dict[str, TurnStream] = {}
        self._rates: dict[str, float] = {}
        self._kind: tuple[float, bool, str] | None = None
        self._places: deque[tuple[int, int, float]] = deque()
        self._count = 0

    def feed(self, block: Block, restart: bool) -> list[CutTurn]:
        """The turns that this block completes.

        Raises
        ------
        SignalError
            The block does not suit the modes: its unit, its rate, or a speed that none has.
        """
        modes = [mode for mode in self._modes if mode.unit == block.unit]
        if not modes:
            units = " or ".join(sorted({mode.unit for mode in self._modes}))
            raise SignalError(f"the samples must be in {units} as the model was taught, got {block.unit}")
        looking = self._looking(modes, block)
        names = "" if block.pulse is not None else looking[0].name
        kind = (block.rate, block.pulse is not None, names)
        if restart or kind != self._kind:
            self._begin(looking, block, kind)
        self._places.append((self._count, block.start_ns, block.rate))
        needed = self._count - _TURNS_BACK * max(mode.duration for mode in self._modes) * block.rate
        while len(self._places) > 1 and self._places[1][0] <= needed:
            self._places.popleft()
        self._count += block.values.size
        turns = [
            CutTurn(mode, self.time_of(turn.start, self._rates[mode.name]), turn, block.pulse is not None)
            for mode in looking
            for turn in self._streams[mode.name].feed(block.values, block.pulse)
        ]
        return sorted(self._own(looking, turns), key=lambda cut: cut.start_ns)

    def set_clock(self, shift_ns: int) -> None:
        """The sender's clock was set by so much [ns]: turns that are not told yet have their times by the new one."""
        self._places = deque((count, start_ns + shift_ns, rate) for count, start_ns, rate in self._places)

    def finish(self) -> list[CutTurn]:
        """The turns that waited for samples that will not come."""
        turns = [
            CutTurn(mode, self.time_of(turn.start, self._rates[mode.name]), turn, bool(self._kind and self._kind[1]))
            for mode in self._modes
            if mode.name in self._streams
            for turn in self._streams[mode.name].finish()
        ]
        self._streams, self._kind = {}, None
        return sorted(self._own(self._modes, turns), key=lambda cut: cut.start_ns)

    def time_of(self, seconds: float, rate: float) -> int:
        """When the sample `seconds` after the first one by a stream of this rate [Hz] was taken [ns since 1970]: a
        stream counts by the mode's rate, from which the sender's may be off a little."""
        index = seconds * rate
        place = next((place for place in reversed(self._places) if place[0] <= index + 1e-6), self._places[0])
        return place[1] + round((index - place[0]) / place[2] * NANO)

    def _looking(self, modes: list[Mode], block: Block) -> list[Mode]:
        if block.pulse is not None or (len(modes) == 1 and block.motor_speed is None):
            return modes
        speed = block.motor_speed
        if speed is None:
            raise SignalError("samples without a pulse must state speed_rpm where several modes were taught")
        fitting = [
            mode
            for mode in modes
            if mode.motor_speed is None or abs(speed - mode.motor_speed) <= SPEED_TOLERANCE * mode.motor_speed
        ]
        if not fitting:
            taught = ", ".join(mode.name for mode in modes)
            raise OtherSpeed(f"the speed must be one that was taught ({taught}), got {speed / RPM:.5g} rpm")
        return fitting[:1]

    def _begin(self, modes: Sequence[Mode], block: Block, kind: tuple[float, bool, str]) -> None:
        self._streams, self._kind, self._count = {}, None, 0
        self._places.clear()
        span = self._pulse_range if block.pulse is not None else None
        for mode in modes:
            rate = mode.rate if same_rate(block.rate, mode.rate) else block.rate
            grid = TurnGrid(mode.rate, mode.duration, self._pulse)
            self._streams[mode.name], self._rates[mode.name] = TurnStream(rate, grid, span), rate
        self._kind = kind

    def _own(self, modes: Sequence[Mode], turns: list[CutTurn]) -> list[CutTurn]:
        """Each turn once: as its own mode sees it, one that fits none as the first mode does."""
        kept = []
        for cut in turns:
            lasts = cut.turn.duration
            fits = [mode for mode in modes if abs(lasts - mode.duration) <= self._pulse.tolerance * mode.duration]
            if cut.mode == (fits[0] if fits else modes[0]):
                kept.append(cut)
        return kept
