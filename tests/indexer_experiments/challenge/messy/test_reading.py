"""What disturbances of base and sensor do to a reading, against their differential equations and sums."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from indexer_experiments.challenge.messy.reading import cabled, drifting, shocked, tilted

RATE = 2000.0
TIME = np.arange(2000) / RATE
READING = 3.0 * np.sin(2.0 * math.pi * 5.0 * TIME) ** 3
ANGLE = 0.7 * TIME + 0.2
OMEGA, DAMPING, SIZE = 2.0 * math.pi * 12.0, 0.05, 0.4


def resonated() -> tuple[np.ndarray, np.ndarray]:
    """x and ẋ of ẍ + 2ζωẋ + ω²x = y, at rest before the record."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        driven = 3.0 * math.sin(2.0 * math.pi * 5.0 * t) ** 3
        return [y[1], driven - 2.0 * DAMPING * OMEGA * y[1] - OMEGA**2 * y[0]]

    found = solve_ivp(rates, (0.0, TIME[-1]), [0.0, 0.0], "DOP853", TIME, rtol=1e-9, atol=1e-12, max_step=1e-3)
    return found.y[0], found.y[1]


def test_a_gain_drifts_about_its_middle() -> None:
    read = drifting(SIZE)(READING, ANGLE, RATE)
    assert read == pytest.approx(READING * (1.0 + SIZE * (TIME - 0.5)), abs=1e-12)


def test_a_cable_adds_its_acceleration() -> None:
    x, rate = resonated()
    acceleration = READING - 2.0 * DAMPING * OMEGA * rate - OMEGA**2 * x
    read = cabled(SIZE, 12.0, DAMPING)(READING, ANGLE, RATE)
    assert np.abs(read - (READING + SIZE * acceleration)).max() < 1e-3


def test_a_tilted_sensor_reads_gravity_by_the_tables_angle() -> None:
    read = tilted(SIZE, 12.0, DAMPING, 0.3)(READING, ANGLE, RATE)
    expected = READING + SIZE * OMEGA**2 * resonated()[0] * np.sin(ANGLE + 0.3)
    assert np.abs(read - expected).max() < 1e-3


def test_shocks_ring_down_at_the_same_times_whatever_their_size() -> None:
    """Seed 3: silence before the first; each a decaying sine of the frequency; twice the size is twice the reading."""
    once, twice = (shocked(s, 12.0, DAMPING, np.random.default_rng(3))(0.0 * TIME, ANGLE, RATE) for s in (1.0, 2.0))
    assert twice == pytest.approx(2.0 * once)
    first = int(np.flatnonzero(once)[0])
    assert first > 0
    later = TIME[first:] - TIME[first]
    begun = TIME[first] - np.cumsum(np.random.default_rng(3).exponential(1.5, 400))[0]
    expected = np.exp(-DAMPING * OMEGA * (later + begun)) * np.sin(OMEGA * (later + begun))
    assert np.abs(np.abs(once[first : first + 100]) - np.abs(expected[:100])).max() < 1e-9
