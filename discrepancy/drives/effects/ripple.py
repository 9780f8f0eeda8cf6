"""Forces that waver: with the position, and with time. The record itself proposes their wavelengths."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from discrepancy.drives.effects.base import PHASES, DriveEffect, Size, standard
from discrepancy.drives.smoothing import holding
from indexer_env.effects.sensor import SensorMainsHum

if TYPE_CHECKING:
    from discrepancy.drives.track import Track

_PEAKS = 3
"""Wavelengths that a record proposes."""

_MOVING = 0.99
"""Share of the speed's variance that the band of the motion holds."""

_SEEN = 2.0
"""Highest frequency of a line over the cut-off: both kernels leave a sixth of it there, and half the rate at which
samples are compared lies above."""

_FINENESS = 4
"""Trial wavelengths per one that the record can resolve."""


def lines(x: np.ndarray, left: np.ndarray, lowest: float, highest: float) -> list[tuple[float, float, float]]:
    """The strongest lines a sin(k x + φ) of a row over x, as (a, k, φ): peaks of its periodogram, at least two
    resolved widths apart, k between `lowest` and `highest`."""
    width = 2.0 * math.pi / float(np.ptp(x))
    trials = np.arange(max(lowest, 1.5 * width), highest, width / _FINENESS)[:8000]
    if not len(trials):
        return []
    # samples are weighted by how fast x passes, so that standing at one place counts as one look at it
    weight = np.abs(np.gradient(x))
    weight, left = weight / weight.sum(), left - np.average(left, weights=weight + 1e-300)
    spectrum = np.array([np.exp(-1j * k * x) @ (weight * left) for k in trials])
    # a sin(k x + φ) has the coefficient a e^{i(φ - π/2)}/2
    return [
        (2.0 * float(np.abs(spectrum[k])), float(trials[k]), float(np.angle(spectrum[k])) + 0.5 * math.pi)
        for k in peaks(np.abs(spectrum))
    ]


def peaks(power: np.ndarray) -> list[int]:
    """Places of the highest values above nothing of a row over trial wavenumbers, apart by two resolved widths."""
    found, power = [], power.copy()
    while len(found) < _PEAKS and power.max(initial=0.0) > 0.0:
        best = int(power.argmax())
        found.append(best)
        power[max(0, best - 2 * _FINENESS) : best + 2 * _FINENESS + 1] = 0.0
    return found


def varying(m: Track, left: np.ndarray) -> list[tuple[float, float, float]]:
    """The inertias J sin(k q + φ) that take most from what a model leaves, as (J, k, φ), from a third of a wave over
    the stroke up."""
    q, v, a = m.q[m.at], m.v[m.at], m.a[m.at]
    width = 2.0 * math.pi / float(np.ptp(q))
    trials = np.arange(0.33 * width, 16.0 * width, width / _FINENESS)
    taken, fits = np.zeros(len(trials)), np.zeros((len(trials), 2))
    for trial, k in enumerate(trials):
        s, c = np.sin(k * q), np.cos(k * q)
        columns = np.stack([s * a + 0.5 * k * c * v**2, c * a - 0.5 * k * s * v**2, a, np.ones_like(a)], axis=1)
        fit, *_ = np.linalg.lstsq(columns, left, rcond=1e-10)
        taken[trial], fits[trial] = max(float(left @ left - np.sum((left - columns @ fit) ** 2)), 0.0), fit[:2]
    return [(float(np.hypot(*fits[k])), float(trials[k]), math.atan2(fits[k][1], fits[k][0])) for k in peaks(taken)]


def _over_position(m: Track, left: np.ndarray) -> list[tuple[float, float, float]]:
    q = m.q[m.at]
    fastest = math.pi / (np.abs(m.v).max() * m.step * m.every)
    # two waves over the stroke at least: fewer are a spring
    slowest = 4.0 * math.pi / float(np.ptp(q))
    return lines(q, left, slowest, min(fastest, 100.0 * slowest))


def ringing(m: Track, left: np.ndarray) -> list[tuple[float, float, float]]:
    """The strongest lines in time, (a, ω, φ), from three periods in the record up."""
    t = m.t[m.at]
    return lines(t, left, 6.0 * math.pi / float(np.ptp(t)), _SEEN * 2.0 * math.pi * m.cutoff)


def _over_time(m: Track, left: np.ndarray) -> list[tuple[float, float, float]]:
    """Above the band of the motion: within it, a line in time is not told from what the motion does."""
    slowest = holding(m.v, 1.0 / m.step, _MOVING)
    found = lines(m.t[m.at], left, 2.0 * math.pi * slowest, _SEEN * 2.0 * math.pi * m.cutoff)
    return [(a, k / (2.0 * math.pi), phase) for a, k, phase in found]


standard(
    DriveEffect(
        "cogging", "The force wavers with the position, as of magnets, rollers or a pitch.", "F += A sin(k q + φ)",
        "first harmonic of a cogging force, e.g. Krause, Analysis of Electric Machinery",
        (
            Size("force", "amplitude A", "F", (), 0.0, 20.0, 0.0, 0.1),
            Size("wavenumber", "wavenumber k = 2π/pitch", "Q-1", (), 6.0, 2000.0, step=0.2),
            Size("phase", "phase φ at q = 0", "", (), -20.0, 20.0, step=0.5),
        ),
        lambda m, p, base: p.force * m.passes(p.wavenumber * m.v) * np.sin(p.wavenumber * m.q + p.phase),
        placed=True, alike=("ripple",),
        starts=_over_position, forward="cogging",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "ripple", "The torque ripples at an order of the shaft.", "F += A sin(n q + φ)",
        "torque ripple by order, e.g. Jahns and Soong, IEEE Trans. Ind. Electron. 43 (1996) 321",
        (
            Size("torque", "amplitude A", "F", (0.1, 0.3), 0.0, 20.0, 0.0),
            Size("phase", "phase φ at q = 0", "", PHASES, -20.0, 20.0, step=0.5),
        ),
        lambda m, p, base: p.torque * m.passes(p.order * m.v) * np.sin(p.order * m.q + p.phase),
        rotary=True, placed=True,
        alike=("cogging", "drive.transmission_error"), choices=tuple({"order": float(n)} for n in (2, 3, 4, 6)),
        forward="ripple",
    )
)  # fmt: skip


def _with_line(m: Track, p: Any, base: Any, force: np.ndarray) -> np.ndarray:
    rate = 2.0 * math.pi * p.frequency
    return force + p.amplitude * m.passes(rate) * np.sin(rate * m.t + p.phase)


standard(
    DriveEffect(
        SensorMainsHum.name, "A line stands at one frequency, whatever the drive does.", "reading += A sin(2π f t + φ)",
        SensorMainsHum.source,
        (
            Size("amplitude", "amplitude A", "F", (), 0.0, 20.0, 0.0, 0.05),
            Size("frequency", "frequency f", "T-1", (), 1e-4, 1000.0, step=0.01),
            Size("phase", "phase φ at the record's first sample", "", (), -20.0, 20.0, step=0.5),
        ),
        _with_line, acts="reading",
        starts=_over_time, forward="hum",
    )
)  # fmt: skip
