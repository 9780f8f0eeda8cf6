"""The noise of a sensor's records: how large it is, and what draws it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from indexer_env.errors import SignalError, refuse


def noise_sigmas(snr_db: float | None, density: float, y: np.ndarray, rate: float) -> list[float]:
    """Standard deviation of the white noise of each record (rows, n) at `rate` [Hz], by its signal-to-noise ratio [dB],
    or, where that is None, by its one-sided density [unit/√Hz]; SignalError where a ratio meets a constant."""
    if snr_db is None:
        return [density * math.sqrt(rate / 2.0)] * len(y)
    # Row by row: the order of a summation must not depend on the batch.
    spreads = [float(np.std(row)) for row in y]
    if 0.0 in spreads:
        where = f"row {spreads.index(0.0)} of the record to vary"
        raise SignalError(f"Sensor.noise_snr_db needs {where}, got a constant; set noise_density instead.")
    return [spread * 10.0 ** (-snr_db / 20.0) for spread in spreads]


def checked_generators(rngs: Sequence[np.random.Generator] | None, rows: int) -> Sequence[np.random.Generator]:
    """The generators of a noisy sensor's records, one for each."""
    rule = "one numpy.random.Generator per record, because the sensor has noise"
    remedy = "pass numpy.random.default_rng(seed)"
    if not isinstance(rngs, Sequence):
        raise refuse("Sensor.read", "rng", rule, rngs, remedy)
    for generator in rngs:
        if not isinstance(generator, np.random.Generator):
            raise refuse("Sensor.read", "rng", rule, generator, remedy)
    if len(rngs) != rows:
        raise refuse("Sensor.read", "rng", f"{rule} ({rows})", len(rngs), remedy + " for each")
    return rngs
