"""What the effects between command and force do to a command, and a sensor to a motion, for the forward form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SENSOR_LAG = "sensor_lag"
"""Name of the effect that acts on what is measured."""


def lagging(rows: np.ndarray, time: float, step: float) -> np.ndarray:
    """Channels (k, n) as sensors read them that lag by a time constant: τ dy/dt = x - y, x linear between samples, and
    y at first as if x had come at its first rate for long."""
    import scipy.signal

    left, per = np.exp(-step / time), time / step
    b = [1.0 - (1.0 - left) * per, (1.0 - left) * per - left]
    rate = rows[:, 1:2] - rows[:, :1]
    before = b[1] * (rows[:, :1] - rate) + left * (rows[:, :1] - rate * (1.0 + per))
    return scipy.signal.lfilter(b, [1.0, -left], rows, axis=1, zi=before)[0]


def lagged(u: np.ndarray, time: float, step: float) -> np.ndarray:
    """A row (n,) through a first-order lag, τ dy/dt = u - y, u held between samples, and y at first at rest."""
    import scipy.signal

    if time <= 0.0:
        return u
    left = np.exp(-step / time)
    return scipy.signal.lfilter([1.0 - left], [1.0, -left], u, zi=[left * u[0]])[0]


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
