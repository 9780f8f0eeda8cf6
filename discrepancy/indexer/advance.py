"""Windows side by side in a pack, advanced over their cam turns by the kernel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from discrepancy.indexer.reading import of_its_rate
from indexer_env.coefficients import LawTable, Pack
from indexer_env.engine import LARGEST_DEFLECTION, prepare_kernel, run_kernel
from indexer_env.kernels import layout
from indexer_env.modes import quick_steps
from indexer_env.sensors import Sensor

_INTERVAL = 2.5e-3
"""Most between two samples in a search [s]: filters of the sensor are looked for up to 0.44 of 400 Hz then, or more."""

_PHASE, _DECAY = 0.75, 2.0
"""h ω of the fastest mode and of the drive's orders [rad], and h λ of the fastest decay, that a step h may have: eight
steps in a period, and three quarters of what is stable. The scheme is of fourth order and lands on the edges. For eight
machines unlike each other, with every effect of the library, with play of 2 arc minutes to 1 degree at the cam, the
error is 3e-6 to 1e-4 of the signal in the median of the effects, 1 % with the stiffest friction."""

FINEST = 1.25e-4
"""No step is shorter [s]: friction so stiff that it needs that chatters, as it does in no record."""

_BLOCK = int(layout.LANES)

_AT_ONCE, _LEAST = 2**17, 2 * _BLOCK
"""Samples simulated at once, which stay in a core's cache until they are judged, and least windows, so that two cores
have work."""

_NEARLY = 0.05
"""Share by which steps may be longer: the sampling rate that a fit finds differs a little from the stated one, and half
the step takes twice the time."""

_SLIP_ROUNDS = 2
"""Windows simulated to find how much faster than the mean speed a slipping motor's command is."""

_MOTOR_ANGLE, _MOTOR_RATE, COMMAND = (
    layout.STATE_NAMES.index(name) for name in ("motor_angle", "motor_rate", "motor_command")
)


def in_parts(
    pack: Pack, counts: np.ndarray, sample_rates: np.ndarray, every: int, rows: Sequence[int | np.integer], samples: int
) -> Iterator[tuple[slice, np.ndarray]]:
    """As `advanced`, some items at a time, which fit into a core's cache."""
    step = max(_LEAST, _AT_ONCE // samples // _BLOCK * _BLOCK)
    for part in (slice(first, first + step) for first in range(0, len(counts), step)):
        some = Pack(pack.model, pack.features, pack.states[part], pack.coefficients[part], pack.pieces)
        yield part, advanced(some, counts[part], sample_rates[part], every, rows, samples)


def advanced(
    pack: Pack, counts: np.ndarray, sample_rates: np.ndarray, every: int, rows: Sequence[int | np.integer], samples: int
) -> np.ndarray:
    """Advance a pack in place, each item over `counts` (n,) samples at its rate (n,) [Hz], `every` steps to each; these
    rows of the workspace (n, rows, samples), without meaning behind an item's end, NaN where a run left the physical
    range."""
    prepare_kernel()
    n = len(counts)
    out = np.empty((n, len(rows), samples))
    status, when = np.zeros(n, dtype=np.int64), np.zeros(n)
    run_kernel((
        pack.model, pack.features, pack.states, pack.coefficients, pack.pieces,
        counts.astype(np.int64) * every - 1, 1.0 / (sample_rates * every), np.zeros(n),
        every, np.array(rows, dtype=np.int64), LARGEST_DEFLECTION, out, status, when,
    ))  # fmt: skip
    out[status != layout.RUNNING] = np.nan
    return out


def let_slip(
    pack: Pack, kind: np.ndarray, sample_rates: np.ndarray, every: int, periods: np.ndarray, begun: np.ndarray,
    lengths: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """How far ahead a slipping motor is where a window begins (n,) [rad], its command and its rate there (n,) [rad/s].

    A pack stands where its motors would be if they turned evenly from the angle at their record's first sample on, at
    a speed of each window's own. What a motor loses in one index it makes up for in the dwell: p(t), by which it gets
    ahead of turning evenly from a window's start on, comes again with the cam's turn. So one window of each machine and
    record tells how much faster the command is than the mean speed, at which rate a window ends and the next one
    starts, and p. What was measured is the angle at a record's first sample and the mean speed up to its last one, T
    later. So where a window begins, t0 after the first sample, the motor is ahead by

        -p(-t0) + (p(-t0) - p(T - t0)) t0/T

    Parameters
    ----------
    pack : Pack
    kind : ndarray (n,)
        Tells machines and records apart.
    sample_rates : ndarray (n,)
        [Hz]
    every : int
        Steps to each sample.
    periods, begun, lengths : ndarray (n,)
        Samples of a cam turn at the mean speed, from the record's first one to the window's, and of the record.
    """
    _, one, of = np.unique(kind, return_index=True, return_inverse=True)
    sample_rates, turn = sample_rates[one], periods[one]
    counts = np.floor(turn).astype(int) + 2  # one sample behind the turn, also where it is a whole number of them
    time = np.arange(int(counts.max())) / sample_rates[:, None]
    mean, rate, own = pack.states[one, _MOTOR_RATE], pack.states[one, _MOTOR_RATE], pack.states[:, _MOTOR_RATE]
    command, each = mean, np.arange(len(one))
    for _ in range(_SLIP_ROUNDS):
        states = pack.states[one].copy()
        states[:, _MOTOR_RATE], states[:, COMMAND] = rate, command
        start = states[:, _MOTOR_ANGLE, None].copy()
        trial = Pack(pack.model, pack.features, states, pack.coefficients[one], pack.pieces)
        rows = advanced(trial, counts, sample_rates, every, (layout.MOTOR, layout.MOTOR_RATE), time.shape[1])
        ahead = rows[:, 0] - start - mean[:, None] * time
        lost = -_between(ahead, each, turn) * sample_rates / turn
        rate = _between(rows[:, 1], each, turn) + lost
        # a run that fails here fails below as well, where it counts as worse than any that does not
        failed = ~np.isfinite(rate + lost)
        command, rate = np.where(failed, mean, command + lost), np.where(failed, mean, rate)
        ahead = np.where(failed[:, None], 0.0, ahead + lost[:, None] * time)
    first, last = (_between(ahead, of, np.mod(moment, periods)) for moment in (-begun, lengths - 1 - begun))
    slower = (first - last) * sample_rates[of] / (lengths - 1)
    # where the speed drifts over a record each window has its own
    own = own + slower
    return slower * begun / sample_rates[of] - first, own + (command - mean)[of], own + (rate - mean)[of]


def _between(rows: np.ndarray, which: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Values (n,) of these rows (m, samples) at places (n,) between samples, linear."""
    before = place.astype(int)
    low, high = rows[which, before], rows[which, before + 1]
    return low + (place - before) * (high - low)


def steps_of(model: int, features: int, rows: np.ndarray, law: LawTable, speed: float) -> np.ndarray:
    """The integrator's steps (n,) [s] for coefficients (n, c) of one model, features and law at a motor's speed
    [rad/s]."""
    return np.maximum(quick_steps(model, features, rows, law.steepest, speed, _PHASE, _DECAY), FINEST)


def steps_per_sample(sample_rate: float, step: float) -> int:
    """Integrator steps of at most `step` [s] from one sample of a rate [Hz], or of one next to it, to the next."""
    return max(1, math.ceil(1.0 / (sample_rate * step) - _NEARLY))


def samples_per_step(sample_rate: float, step: float, sensor: Sensor) -> int:
    """Samples of a rate [Hz] that pass in one step of a search of at most `step` [s], at least one; of a sensor
    with filters that are others at another rate one."""
    if of_its_rate(sensor):
        return 1
    return max(1, math.floor(sample_rate * min(_INTERVAL, step) + _NEARLY))
