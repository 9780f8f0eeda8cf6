"""Windows side by side in a pack, advanced over their cam turns by the kernel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from indexer_env.coefficients import Pack
from indexer_env.engine import LARGEST_DEFLECTION, prepare_kernel, run_kernel
from indexer_env.kernels import layout

_STEP = 1e-3
"""Largest step of the integrator [s]: with landings on the edges its error stays fifty times below 1.5 % noise, from no
play to 20 degrees of it and with every effect."""

_BLOCK = int(layout.LANES)

_AT_ONCE, _LEAST = 2**17, 2 * _BLOCK
"""Samples simulated at once, which stay in a core's cache until they are judged, and least windows, so that two cores
have work."""

_SLIP_ROUNDS = 3
"""Windows simulated to find how much faster than the mean speed a slipping motor's command is."""

_MOTOR_ANGLE, _MOTOR_RATE, _COMMAND = (
    layout.STATE_NAMES.index(name) for name in ("motor_angle", "motor_rate", "motor_command")
)


def parts(count: int, samples: int) -> Iterator[slice]:
    """Slices of so many windows of so many samples each, simulated one after the other."""
    step = max(_LEAST, _AT_ONCE // samples // _BLOCK * _BLOCK)
    return (slice(first, first + step) for first in range(0, count, step))


def part_of(pack: Pack, part: slice) -> Pack:
    """A slice of a pack's items."""
    return Pack(pack.model, pack.features, pack.states[part], pack.coefficients[part], pack.pieces)


def advanced(
    pack: Pack, counts: np.ndarray, sample_rates: np.ndarray, rows: Sequence[int | np.integer], samples: int
) -> np.ndarray:
    """Advance a pack in place, each item over `counts` (n,) samples at its rate (n,) [Hz]; these rows of the workspace
    (n, rows, samples), without meaning behind an item's end, NaN where a run left the physical range."""
    prepare_kernel()
    every, n = _every(sample_rates), len(counts)
    out = np.empty((n, len(rows), samples))
    status, when = np.zeros(n, dtype=np.int64), np.zeros(n)
    run_kernel((
        pack.model, pack.features, pack.states, pack.coefficients, pack.pieces,
        counts.astype(np.int64) * every - 1, 1.0 / (sample_rates * every), np.zeros(n),
        every, np.array(rows, dtype=np.int64), LARGEST_DEFLECTION, out, status, when,
    ))  # fmt: skip
    out[status != layout.RUNNING] = np.nan
    return out


def let_slip(pack: Pack, kind: np.ndarray, counts: np.ndarray, sample_rates: np.ndarray) -> None:
    """Set command and start rate of slipping motors so that each cam turn takes as long as it was measured to.

    What the motor loses in one index it makes up for in the dwell, so one window of each machine and record, told apart
    by `kind` (n,), tells how much faster the command is than the mean speed, and at which rate a window ends and the
    next one starts.
    """
    every = _every(sample_rates)
    _, one, of = np.unique(kind, return_index=True, return_inverse=True)
    time = (counts[one] * every - 1) / (sample_rates[one] * every)
    mean, rate = pack.states[one, _MOTOR_RATE], pack.states[one, _MOTOR_RATE]
    command = mean
    for _ in range(_SLIP_ROUNDS):
        states = pack.states[one].copy()
        states[:, _MOTOR_RATE], states[:, _COMMAND] = rate, command
        start = states[:, _MOTOR_ANGLE].copy()
        trial = Pack(pack.model, pack.features, states, pack.coefficients[one], pack.pieces)
        advanced(trial, counts[one], sample_rates[one], (layout.TABLE_ACC,), 0)
        lost = mean - (states[:, _MOTOR_ANGLE] - start) / time
        failed = ~np.isfinite(lost + states[:, _MOTOR_RATE])
        command, rate = command + lost, states[:, _MOTOR_RATE]
        # a run that fails here fails below as well, where it counts as worse than any that does not
        command[failed], rate[failed] = mean[failed], mean[failed]
    pack.states[:, _MOTOR_RATE], pack.states[:, _COMMAND] = rate[of], command[of]


def _every(sample_rates: np.ndarray) -> int:
    """Integrator steps per sample."""
    return max(1, math.ceil(1.0 / (float(sample_rates.min()) * _STEP) - 1e-9))
