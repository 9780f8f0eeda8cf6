"""How to simulate and record: one object for the whole run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from indexer_env.checks import as_python, check_integer, check_number
from indexer_env.trajectory import check_channels


@dataclass(frozen=True)
class Run:
    """How to simulate and record.

    Attributes
    ----------
    sample_rate : float
        [Hz], in (0, 1e6].
    samples : int or None
        Samples of the record; None is one table turn at the commanded speed, rounded.
    step : float or None
        Largest step of the integrator [s]; the step used is the sampling interval over a whole number. None: for each
        machine the largest with which the relative rms error of φ̈ should stay below 1e-6 over a turn, with play or an
        effect below 1e-5 over the first half second, and with dry friction below 1e-4 (modes.steps_of).
    warmup_turns : int
        Bound on the table turns run before the record, >= 0. Every contact re-made at random by play keeps turns from
        agreeing; the linear transient is gone by then (two turns are 46 time constants of the reference machine's
        slowest mode).
    warmup_tolerance : float
        A turn is recorded once its last cam turn agrees with that of the turn before to this relative rms difference of
        φ̈ [-], > 0: the state then repeats, so the turn is free of the start's transient from its first sample.
    channels : tuple of str
        Quantities to record, of `trajectory.CHANNELS`.
    """

    sample_rate: float = 1000.0
    samples: int | None = None
    step: float | None = None
    warmup_turns: int = 2
    warmup_tolerance: float = 1e-6
    channels: tuple[str, ...] = ("table_acceleration",)

    def __post_init__(self) -> None:
        check_number("Run", "sample_rate", self.sample_rate, low=0.0, low_open=True, high=1e6, unit="Hz")
        if self.samples is not None:
            check_integer("Run", "samples", self.samples, low=1)
        if self.step is not None:
            check_number("Run", "step", self.step, low=0.0, low_open=True, unit="s")
        check_integer("Run", "warmup_turns", self.warmup_turns, low=0, high=1000)
        check_number("Run", "warmup_tolerance", self.warmup_tolerance, low=0.0, low_open=True)
        check_channels("Run", self.channels)
        as_python(self, "sample_rate", "samples", "step", "warmup_turns", "warmup_tolerance")

    def steps_per_sample(self, accurate: float) -> int:
        """Integrator steps per sampling interval of a machine for which `accurate` [s] is the automatic step."""
        step = accurate if self.step is None else self.step
        return max(1, math.ceil(1.0 / (self.sample_rate * step) - 1e-9))

    def samples_of(self, turn_duration: float) -> int:
        """Samples of the record of a machine whose turn takes so long."""
        return self.samples or max(1, round(turn_duration * self.sample_rate))
