"""Between the force that acts and the force that is read: the current loop, the amplifier, the sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.effects.base import DriveEffect, Size, standard
from discrepancy.drives.readings import SENSOR_LAG, lagged
from indexer_env.effects.sensor import SensorGain, SensorLowpass, SensorOffsetDrift

if TYPE_CHECKING:
    from discrepancy.drives.track import Track

_TIMES = (0.01, 0.05, 0.2)


def _shifted(m: Track, p, base, f: np.ndarray) -> np.ndarray:
    return np.interp(m.t + p.delay, m.t, f)


standard(
    DriveEffect(
        "delay", "The force comes later than it is asked for.", "reading(t) = F(t + d)",
        "dead time of a digital drive", (Size("delay", "delay d", "T", (*_TIMES, -0.02), -1.0, 2.0, 0.0),), _shifted,
        acts="reading", alike=("loop_lag", "compliance", SensorLowpass.name), forward="delay",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "loop_lag", "The current loop lags: what is asked for runs ahead of the force.", "reading = F + τ dF/dt",
        "first-order current loop, e.g. Leonhard, Control of Electrical Drives (2001)",
        (Size("time", "time constant τ", "T", _TIMES, 0.0, 2.0, 0.0),),
        lambda m, p, base, f: f + p.time * np.gradient(f, m.step), acts="reading", alike=("delay",), forward="lag",
    )
)  # fmt: skip


standard(
    DriveEffect(
        SensorLowpass.name, "The sensor lags: of the force, or in the forward form of the motion.",
        "τ d(reading)/dt = F - reading", SensorLowpass.source,
        (Size("time_constant", "time constant τ", "T", _TIMES, 0.0, 5.0, 0.0),),
        lambda m, p, base, f: lagged(f, p.time_constant, m.step), acts="reading", alike=("delay",),
        forward=SENSOR_LAG,
    )
)  # fmt: skip

standard(
    DriveEffect(
        SensorGain.name, "The force is read too large or too small.", "reading = (1 + e) F", SensorGain.source,
        (Size("error", "relative error e", "", (0.05, -0.05, 0.2, -0.2), -0.9, 5.0, 0.0),),
        lambda m, p, base, f: (1.0 + p.error) * f, acts="reading", alike=("inertia",), forward="gain",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "saturation", "The force is cut off at a limit.", "reading = min(max(F, -L), L), L = 1/c",
        "limit of an amplifier",
        (Size("inverse_limit", "one over the limit c", "F-1", (0.4, 0.6, 0.9), 0.0, 5.0, 0.0),),
        lambda m, p, base, f: np.clip(f, -1.0 / p.inverse_limit, 1.0 / p.inverse_limit) if p.inverse_limit > 0.0 else f,
        acts="reading", forward="saturation",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "quantisation", "The force is given or read in coarse steps.", "reading = s round(F/s)",
        "quantiser, e.g. Widrow and Kollár, Quantization Noise (2008)",
        (Size("step", "step s", "F", (0.2, 0.5, 1.0), 0.0, 10.0, 0.0),),
        lambda m, p, base, f: p.step * np.round(f / p.step) if p.step > 0.0 else f, acts="reading",
        forward="quantisation",
    )
)  # fmt: skip

standard(
    DriveEffect(
        SensorOffsetDrift.name, "What is read drifts with time.", "reading += r t", SensorOffsetDrift.source,
        (Size("rate", "rate r", "F T-1", (1e-4, -1e-4, 1e-3, -1e-3), -1.0, 1.0, 0.0),),
        lambda m, p, base, f: f + p.rate * m.t, acts="reading", alike=("offset",), forward="drift",
    )
)  # fmt: skip
