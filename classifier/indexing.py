"""The table's indexing as a record shows it: how often it moves in a turn, and in which sense.

In each index the table is accelerated, then decelerated, then it dwells. So its velocity is a train of pulses of
one sign: seen from its mean, the velocity is far above for short and a little below for long. The third moment has the
sign of the pulses wherever in the turn the record begins, as the moments of a periodic signal do not hang on its phase:

    V_h = A(h S) / (2πi h S),  h = 1 … 3,     v(t) = Σ_h V_h e^(2πi h S t) + c.c.,     γ = mean(v³) / mean(v²)^(3/2)

A(o) is the spectrum of the record under a Hann window at o cycles a record, S the order whose three harmonics hold most
of the velocity. γ is −γ for a record of the other sign. Three harmonics of the indexing lie far below the machine's
natural frequencies and the sensor's, so that faults and noise hardly reach them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import get_window

HARMONICS = 3
"""Harmonics of the indexing that are looked at: more come near the natural frequencies, fewer lose the shape."""

STATIONS = (4.0, 64.0)
"""Indexes in a record between which S is sought: with fewer the harmonics cannot be told from a sensor's drift."""

SHARE = 0.9
"""Share of the velocity, from half an order S to three and a half, that its harmonics hold in a record that shows
indexing: 0.99 in simulated machines with all faults, below 0.9 in white noise (99 %)."""

SKEWNESS = 0.5
"""|γ| from which a sense is told: 0.9 where the table moves half of the time, 0.5 for two thirds, 0 for a tone."""

_PADDING = 8
_LOBE = 1.5
"""Half the width of a line under the Hann window [orders], without its edges."""


class Indexing(NamedTuple):
    """What a record shows of the table's indexing.

    stations  S, indexes in the record
    skewness  γ of the velocity [-]
    share     of the velocity that three harmonics of S hold [-]
    """

    stations: float
    skewness: float
    share: float

    @property
    def sense(self) -> int:
        """1 where the acceleration comes before the deceleration, −1 where the sign is reversed, 0: cannot be told."""
        if self.share < SHARE or abs(self.skewness) < SKEWNESS:
            return 0
        return 1 if self.skewness > 0.0 else -1


def indexing_of(record: np.ndarray) -> Indexing:
    """The indexing in a record (samples,) of the table's acceleration, of about one turn; in any unit."""
    orders, velocity = _velocity(record)
    power = np.abs(velocity) ** 2
    tried = np.flatnonzero((orders >= STATIONS[0]) & (orders <= min(STATIONS[1], orders[-1] / (HARMONICS + 0.5))))
    if tried.size == 0 or not power.any():
        return Indexing(0.0, 0.0, 0.0)
    held = sum(power[h * tried] for h in range(1, HARMONICS + 1))
    place = int(tried[np.argmax(held)])
    return Indexing(float(orders[place]), _skewness(velocity, place), _share(orders, power, orders[place]))


def _velocity(record: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orders (m,) [cycles a record] and the velocity's spectrum (m,) there, up to a factor; 0 at order 0."""
    values = np.asarray(record, dtype=np.float64)
    kept = min(len(values) // 2, int((HARMONICS + 1) * STATIONS[1]))
    spectrum = np.fft.rfft((values - values.mean()) * get_window("hann", len(values)))[:kept]
    # The low part alone as a short signal, whose padding with zeros gives the values between the lines.
    acceleration = np.fft.rfft(np.fft.irfft(spectrum, 2 * kept), 2 * kept * _PADDING)
    orders = np.arange(len(acceleration)) / _PADDING
    acceleration[0] = 0.0
    return orders, acceleration / (1j * np.maximum(orders, 1.0 / _PADDING))


def _skewness(velocity: np.ndarray, place: int) -> float:
    lines = np.zeros(1 + 4 * HARMONICS, dtype=np.complex128)
    lines[1 : HARMONICS + 1] = velocity[place * np.arange(1, HARMONICS + 1)]
    pulse = np.fft.irfft(lines, 8 * HARMONICS)
    return float(np.mean(pulse**3) / np.mean(pulse**2) ** 1.5)


def _share(orders: np.ndarray, power: np.ndarray, stations: float) -> float:
    band = (orders >= 0.5 * stations) & (orders <= (HARMONICS + 0.5) * stations)
    nearest = stations * np.clip(np.round(orders / stations), 1, HARMONICS)
    lines = np.abs(orders - nearest) <= _LOBE
    return float(power[band & lines].sum() / power[band].sum())
