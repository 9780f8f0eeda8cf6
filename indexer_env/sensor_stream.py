"""A sensor read block by block: filters keep their states from block to block, as a data logger's do."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from indexer_env.errors import refuse
from indexer_env.sensors import Sensor


class SensorStream:
    """Reads `rows` accelerations side by side, each started anew on its own.

    What is read of a row since its start, block after block, is what `Sensor.read` gives for the whole record, but for
    the noise: that is drawn block by block, one standard normal per sample, by its density.

    Parameters
    ----------
    sensor : Sensor
    sample_rate : float
        Of the acceleration and of the readings [Hz].
    rows : int

    Raises
    ------
    ParameterError
        The rate does not suit the sensor, it has another rate of its own, or its noise is a signal-to-noise ratio,
        which only a whole record has.
    """

    def __init__(self, sensor: Sensor, sample_rate: float, rows: int) -> None:
        if sensor.noise_snr_db is not None:
            remedy = "set noise_density instead"
            raise refuse(
                "Sensor", "noise_snr_db", "null where a record is read as it grows", sensor.noise_snr_db, remedy
            )
        if sensor.record_rate(sample_rate) != sample_rate:
            rule = f"null or the simulation's {sample_rate:g} Hz where a record is read as it grows"
            raise refuse("Sensor", "sample_rate", rule, sensor.sample_rate)
        self._sensor, self._rate = sensor, float(sample_rate)
        self._sections = sensor.sections(sample_rate)
        self._rest = _at_rest(self._sections)
        self._states = [np.zeros((len(sections), rows, 2)) for sections in self._sections]
        self._read = np.zeros(rows, dtype=np.int64)
        self._sigma = sensor.noise_density * math.sqrt(sample_rate / 2.0)
        self._background = any((sensor.offset, sensor.offset_drift, sensor.hum_amplitude))

    @property
    def sections(self) -> np.ndarray:
        """All second-order sections of the chain, one behind the other (s, 6)."""
        return np.concatenate([np.zeros((0, 6)), *self._sections])

    @property
    def rest(self) -> np.ndarray:
        """The sections' states (s, 2) on which a reading of 1 has lasted for ever."""
        return np.concatenate([np.zeros((0, 2)), *(rest[:, 0, :] for rest in self._rest)])

    @property
    def plain(self) -> bool:
        """Whether a reading is the acceleration times a number, within the range: no state, no time, no chance."""
        return not (self._sections or self._background or self._sigma > 0.0 or self._sensor.bits is not None)

    def start(self, index: np.ndarray, first: np.ndarray) -> None:
        """Start rows `index` (k,) anew, as if their first acceleration `first` (k,) [rad/s²] had lasted for ever."""
        y = first * self._sensor.scale
        for rest, state in zip(self._rest, self._states, strict=True):
            state[:, index] = rest * y[np.newaxis, :, np.newaxis]
        self._read[index] = 0

    def read(self, index: np.ndarray | None, block: np.ndarray, rngs: Sequence[np.random.Generator]) -> np.ndarray:
        """Readings (k, m) of the next m accelerations (k, m) [rad/s²] of rows `index` (k,), all rows where None; `rngs`
        has a generator for each row of the stream. Returns a new array."""
        y = block * self._sensor.scale
        for number, sections in enumerate(self._sections):
            y = self._filtered(number, sections, index, y)
        if self._background:
            count = self._read if index is None else self._read[index]
            y = self._sensor.with_background(y, (count[:, np.newaxis] + np.arange(y.shape[1])) / self._rate)
            if index is None:
                self._read += y.shape[1]
            else:
                self._read[index] += y.shape[1]
        if self._sigma > 0.0:
            for row, item in zip(y, range(len(y)) if index is None else index, strict=True):
                row += self._sigma * rngs[item].standard_normal(row.size)
        return self._sensor.recorded(y)

    def _filtered(self, number: int, sections: np.ndarray, index: np.ndarray | None, y: np.ndarray) -> np.ndarray:
        import scipy.signal

        state = self._states[number]
        if index is None:
            y, state[:] = scipy.signal.sosfilt(sections, y, axis=-1, zi=state)
        else:
            y, state[:, index] = scipy.signal.sosfilt(sections, y, axis=-1, zi=state[:, index])
        return y


def _at_rest(filters: Sequence[np.ndarray]) -> list[np.ndarray]:
    """States (s, 1, 2) of each filter of a chain on whose first one a reading of 1 has lasted for ever: a high-pass
    hands nothing of it on to those behind it."""
    if not filters:
        return []
    import scipy.signal

    rest, passed = [], 1.0
    for sections in filters:
        rest.append(passed * scipy.signal.sosfilt_zi(sections)[:, np.newaxis, :])
        passed *= float(np.prod(sections[:, :3].sum(axis=1) / sections[:, 3:].sum(axis=1)))
    return rest
