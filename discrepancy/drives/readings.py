"""What the effects between command and force do to a command, for the forward form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def commanded(name: str, u: np.ndarray, values: Sequence[float], step: float) -> np.ndarray:
    """A command (n,) as it acts.

    delay: u(t - d); lag: τ dF/dt = u - F; gain: u/(1 + e); saturation: within ±1/c; quantisation: in whole steps;
    drift: u - r t; hum: u - A sin(2π f t + φ).
    """
    import scipy.signal

    t = step * np.arange(len(u))
    value = values[0]
    if name == "hum":
        return u - value * np.sin(2.0 * np.pi * values[1] * t + values[2])
    if name == "delay":
        return np.interp(t - value, t, u)
    if name == "lag":
        if value <= 0.0:
            return u
        left = np.exp(-step / value)
        return scipy.signal.lfilter([1.0 - left], [1.0, -left], u, zi=[left * u[0]])[0]
    if name == "gain":
        return u / (1.0 + value)
    if name == "saturation":
        return np.clip(u, -1.0 / value, 1.0 / value) if value > 0.0 else u
    if name == "quantisation":
        return value * np.round(u / value) if value > 0.0 else u
    if name == "drift":
        return u - value * t
    raise ValueError(f"{name!r} is nothing that is done to a command.")
