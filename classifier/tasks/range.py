"""Range: whether a record's level and octaves are those of the training records; few records are enough to tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy import stats

from classifier.dataset import Dataset
from classifier.tasks.need import independent, need
from indexer_env.checks import check_number
from indexer_env.errors import refuse

REFUSED = 0.01
"""Share of records like those of the training that are refused at most, were all quantities normal. Small, since what
is to be refused lies tens of standard deviations away: noise, a tone, another gain."""

LEAST = 6
"""Independent records with which limits can be set: they lie 7 standard deviations from the mean with 6 records, 13
with 4 and 33 with 3, which would accept nearly all."""

MARGIN = 0.02
"""By which the limits are wider [decades]: 5 % in amplitude, since records of one day and one mounting do not show
how far another calibration of the sensor is off."""

OUTSIDE = "is_outside"
"""Column that says whether a record is outside the range."""

BLOCKS = 32
"""Blocks that the lowest octave has at least in a record, so that it does not hang on where the record begins."""


def octave_count(samples: int) -> int:
    """Octaves that a record of so many samples is taken apart into; the highest one is not used."""
    return max(1, int(np.log2(max(2, samples // BLOCKS))))


def octaves(records: np.ndarray) -> np.ndarray:
    """Logarithms (n, 1 + octaves) of the root mean square of records (n, samples) without their means, and of their
    octaves of the Haar wavelet, falling from a quarter of the sampling rate; of records (n, channels, samples) those of
    one channel after the other.

        d_k = (x_2k − x_2k+1) / 2,   x_k ← (x_2k + x_2k+1) / 2,   octave by octave

    The highest octave is left out: what it holds hangs on the recorder's anti-alias filter.
    Source: S. Mallat, A Wavelet Tour of Signal Processing (1999), §7.3.
    """
    rest = np.asarray(records, dtype=np.float64)
    rest = rest - rest.mean(axis=-1, keepdims=True)
    squares = [np.mean(rest**2, axis=-1)]
    for octave in range(octave_count(rest.shape[-1])):
        even, odd = rest[..., : rest.shape[-1] // 2 * 2 : 2], rest[..., 1::2]
        if octave > 0:
            squares.append(np.mean(((even - odd) / 2) ** 2, axis=-1))
        rest = (even + odd) / 2
    quantities = np.stack(squares, axis=-1).reshape(len(rest), -1)
    return 0.5 * np.log10(np.maximum(quantities, np.finfo(np.float64).tiny))


@dataclass(frozen=True, eq=False)
class Range:
    """Limits of the level and of each octave, beyond which a record is none of those that were taught.

        |q_j − q̄_j| > t_{g−1, 1−α/2m} s_j √(1 + 1/g) + MARGIN,      j = 1 … m

    q are the logarithms of `octaves`, q̄ and s their mean and standard deviation over the calibration and control
    records, of which those of one file share the weight of one, g the number of files: the prediction interval of one
    more record, shared out over the m quantities (Bonferroni). It needs no network and no spectrum, and holds for few
    records.
    Source: G. J. Hahn, W. Q. Meeker, Statistical Intervals (1991), §4.2 (prediction of a future observation).

    samples  of a record
    middle   (m,) q̄ [decades of the unit], of all channels
    reach    (m,) half the width of the interval [decades]

    Raises ParameterError.
    """

    kind: ClassVar[str] = "range"

    samples: int
    middle: np.ndarray
    reach: np.ndarray

    def __post_init__(self) -> None:
        check_number("Range", "samples", self.samples, low=1.0)
        for name in ("middle", "reach"):
            shape, each = getattr(self, name).shape, octave_count(self.samples)
            if len(shape) != 1 or shape[0] % each or not shape[0]:
                raise refuse("Range", name, f"one number for the level and each octave, {each} a channel", shape)
        if not (self.reach > 0).all():
            raise refuse("Range", "reach", "> 0 decades", float(self.reach.min()))

    @classmethod
    def fit(cls, dataset: Dataset, features: np.ndarray, outputs: np.ndarray, seed: int) -> Range:
        """Fitted to the calibration and control records. Raises NotAvailable where they are too few."""
        rows = np.isin(dataset.subsets, ("calibration", "control"))
        labels = independent(dataset, rows)
        sizes = np.bincount(labels)
        count = int(np.count_nonzero(sizes))
        need("independent records of calibration and control", LEAST, count)
        found, weights = octaves(dataset.records[rows]), 1.0 / sizes[labels]
        middle = np.average(found, axis=0, weights=weights)
        scatter = np.sqrt(np.average((found - middle) ** 2, axis=0, weights=weights) * count / (count - 1))
        widths = stats.t.ppf(1.0 - REFUSED / (2 * found.shape[1]), count - 1) * np.sqrt(1.0 + 1.0 / count)
        return cls(dataset.records.shape[-1], middle, widths * scatter + MARGIN)

    def assess(self, features: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """What it says of records (n, samples):

        level       (n,) root mean square of the first channel over the middle one of the training records [-]
        range       (n,) the farthest of their quantities from the middle, over its limit [-]
        is_outside  (n,) whether that is above 1
        """
        apart = octaves(records) - self.middle
        farthest = np.max(np.abs(apart) / self.reach, axis=1)
        return {"level": 10.0 ** apart[:, 0], "range": farthest, OUTSIDE: farthest > 1.0}

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Range:
        """The part that gave this body and these arrays."""
        return cls(body["samples"], arrays["middle"], arrays["reach"])

    def body(self) -> dict[str, Any]:
        """All of it that is no array."""
        return {"samples": self.samples}

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        return {"middle": self.middle, "reach": self.reach}
