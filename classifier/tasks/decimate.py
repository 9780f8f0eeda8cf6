"""Records at a lower rate and of unit size, for methods that see the record itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal

from classifier.dataset import Dataset

RATE = 250.0
"""Lowest rate [Hz] that still holds the 100 Hz which the features see, with room for the filter's edge."""


@dataclass(frozen=True)
class Decimated:
    """Each record without its mean, an anti-alias filter, decimation, and division by the rms of the calibration
    records.

    factor  samples of the record for one that is kept, >= 1
    rms     root mean square of the calibration records about their means, in their unit
    """

    factor: int
    rms: float

    @classmethod
    def fit(cls, dataset: Dataset, rate: float) -> Decimated:
        """Of a data set, to a rate of at least so many Hz."""
        records = dataset.records[dataset.rows("calibration")]
        rms = float(np.sqrt(records.var(axis=-1, dtype=np.float64).mean()))
        return cls(max(1, int(dataset.sample_rate // rate)), rms)

    def apply(self, records: np.ndarray) -> np.ndarray:
        """Records (n, …, samples / factor) of zero mean, float64."""
        centred = (records - records.mean(axis=-1, keepdims=True)).astype(np.float64) / self.rms
        if self.factor == 1:
            return centred
        return scipy.signal.resample_poly(centred, 1, self.factor, axis=-1)
