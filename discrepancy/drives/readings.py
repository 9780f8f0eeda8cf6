"""What the effects between command and force do to a command, and a sensor to a motion, for the forward form."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

SENSOR_LAG = "sensor_lag"
"""Name of the effect that acts on what is measured."""


def lagging(rows: np.ndarray, time: float, step: float) -> np.ndarray:
    """Channels (k, n) as sensors read them that lag by a time constant: τ dy/dt = x - y, x linear between samples, and
    y at first as if x had come at its first rate for long."""
    import scipy.signal

    b, left = _first_order(time, step)
    rate = rows[:, 1:2] - rows[:, :1]
    before = b[1] * (rows[:, :1] - rate) + left * (rows[:, :1] - rate * (1.0 + time / step))
    return scipy.signal.lfilter(b, [1.0, -left], rows, axis=1, zi=before)[0]


def lagged(u: np.ndarray, time: float, step: float) -> np.ndarray:
    """A row (n,) through a first-order lag, τ dy/dt = u - y, u linear between samples, and y at first at rest."""
    import scipy.signal

    if time <= 0.0:
        return u
    b, left = _first_order(time, step)
    return scipy.signal.lfilter(b, [1.0, -left], u, zi=[(1.0 - b[0]) * u[0]])[0]


def _first_order(time: float, step: float) -> tuple[list[float], float]:
    """b and e of y_k = b_0 u_k + b_1 u_(k-1) + e y_(k-1), the lag's exact answer to a u that is linear between
    samples: one held from sample to sample would come half a step early."""
    left, per = math.exp(-step / time), time / step
    return [1.0 - (1.0 - left) * per, (1.0 - left) * per - left], left


def commanded(name: str, u: np.ndarray, values: Sequence[float], step: float) -> np.ndarray:
    """A command (n,) as it acts.

    delay: u(t - d); lag: τ dF/dt = u - F; gain: u/(1 + e); saturation: within ±1/c; quantisation: in whole steps;
    drift: u - r t; hum: u - A sin(2π f t + φ).
    """
    t = step * np.arange(len(u))
    value = values[0]
    if name == "hum":
        return u - value * np.sin(2.0 * np.pi * values[1] * t + values[2])
    if name == "delay":
        return np.interp(t - value, t, u)
    if name == "lag":
        return lagged(u, value, step)
    if name == "gain":
        return u / (1.0 + value)
    if name == "saturation":
        return np.clip(u, -1.0 / value, 1.0 / value) if value > 0.0 else u
    if name == "quantisation":
        return value * np.round(u / value) if value > 0.0 else u
    if name == "drift":
        return u - value * t
    raise ValueError(f"{name!r} is nothing that is done to a command.")


def acting(row: np.ndarray) -> np.ndarray:
    """What acts around each sample of a row (n,) that is held, u(t) = u[k] from t[k] to t[k + 1].

    Below the sampling rate that is U(f) sin(x)/x exp(-ix), x = π f h; the weights have this to x⁴.
    """
    return np.convolve(row, np.array([-1.0, 13.0, 13.0, -1.0]) / 24.0)[1 : len(row) + 1]
