"""Features: what the network sees of a record.

One class per kind of feature, found by its ``kind`` in FEATURES. Each is a frozen object that turns records
(n, samples) into features (n, count), record by record: no feature depends on another record. The scaling
that does depend on other records is `Scaling`, and it is fitted on the calibration subset alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np
import scipy.signal

from indexer_env.build import from_mapping
from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse

_CHUNK = 1024  # records at a time: bounds the memory of the windowed segments, 0.25 GiB for one-turn records


@dataclass(frozen=True)
class Psd:
    """One-sided power spectral density by Welch's averaged periodogram, from 0 Hz to maximum_hz inclusive.

        P(f_j) = 2 / (f_s Σ w²) · mean over segments of |Σ_t w_t (x_t − x̄) e^(−2πi j t / L)|²,   f_j = j
                                                                                                  f_s/L

    resolution_hz  wanted spacing of the frequencies [Hz]; the segment holds L = round(f_s / resolution_hz)
                   samples, so that the true spacing is f_s / L (equal to the wanted one wherever that divides
                   the rate)
    maximum_hz     last frequency kept [Hz], at most half the sample rate
    scale          "linear": the features are the densities P; "log": log10(P / 1 unit²/Hz)

    w is the periodic Hann window, neighbouring segments overlap by half, each segment loses its own mean x̄
    (constant detrend) so that a sensor's offset does not reach the network; samples after the last full
    segment are not used (200 of the 8200 of one turn at 1 Hz). The factor 2 is absent at 0 Hz and at half the
    sample rate.

    The paper says no more than "PSD, 1 Hz" and "all positive values" (§4.2, §4.3), hence linear; window,
    overlap and the limit of 100 Hz, which it names for the FFT, are choices made here.
    Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70–73.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "psd"

    resolution_hz: float = 1.0
    maximum_hz: float = 100.0
    scale: str = "linear"

    def __post_init__(self) -> None:
        check_number("Psd", "resolution_hz", self.resolution_hz, low=0.0, low_open=True, unit="Hz")
        check_number("Psd", "maximum_hz", self.maximum_hz, low=0.0, low_open=True, unit="Hz")
        check_choice("Psd", "scale", self.scale, ("linear", "log"))
        if self.resolution_hz > self.maximum_hz:
            raise refuse("Psd", "resolution_hz", f"<= maximum_hz = {self.maximum_hz:g} Hz", self.resolution_hz)

    def segment(self, sample_rate: float) -> int:
        """Samples in one segment at a sample rate [Hz]."""
        return round(sample_rate / self.resolution_hz)

    def frequencies(self, sample_rate: float) -> np.ndarray:
        """Frequencies (count,) [Hz] of the features at a sample rate [Hz]. Raises ParameterError above half
        the rate.
        """
        if self.maximum_hz > sample_rate / 2:
            raise refuse("Psd", "maximum_hz", f"<= half the sample rate = {sample_rate / 2:g} Hz", self.maximum_hz)
        frequencies = np.fft.rfftfreq(self.segment(sample_rate), 1 / sample_rate)
        return frequencies[frequencies <= self.maximum_hz * (1 + 1e-9)]

    def density(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Densities (n, count) [(unit of the record)²/Hz] of records (n, samples) at a sample rate [Hz].

        Raises ParameterError for records shorter than one segment.
        """
        count = len(self.frequencies(sample_rate))
        segment = self.segment(sample_rate)
        if records.shape[-1] < segment:
            duration = records.shape[-1] / sample_rate
            rule = f">= {1 / duration:g} Hz for records of {duration:g} s"
            raise refuse("Psd", "resolution_hz", rule, self.resolution_hz)
        densities = np.empty((len(records), count))
        for first in range(0, len(records), _CHUNK):
            chunk = np.asarray(records[first : first + _CHUNK], dtype=np.float64)
            _, density = scipy.signal.welch(
                chunk, sample_rate, window="hann", nperseg=segment, noverlap=segment // 2, detrend="constant"
            )
            densities[first : first + _CHUNK] = density[:, :count]
        return densities

    def compute(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Features (n, count) of records (n, samples): the densities, or their decimal logarithms.

        A density of exactly 0 counts as the smallest positive float64.

        Raises ParameterError as `density` does.
        """
        densities = self.density(records, sample_rate)
        if self.scale == "linear":
            return densities
        return np.log10(np.maximum(densities, np.finfo(np.float64).tiny))


FEATURES: dict[str, type[Psd]] = {Psd.kind: Psd}


def make_features(mapping: Mapping[str, Any]) -> Psd:
    """Features from a plain mapping ``{"kind": ..., parameters}``, as in conf/features. Raises
    ParameterError.
    """
    parameters = dict(mapping)
    kind = parameters.pop("kind", None)
    check_choice("features", "kind", kind, tuple(FEATURES))
    return from_mapping(FEATURES[kind], parameters, owner="features")


def describe_features(features: Psd) -> dict[str, Any]:
    """The mapping from which `make_features` makes these features again."""
    return {"kind": features.kind, **asdict(features)}


@dataclass(frozen=True)
class Scaling:
    """Linear map of each feature that takes the range of the calibration records to [0, 1].

        scaled = (feature − low) / (high − low)

    low, high  (count,) extremes over the calibration records; records of other subsets may fall outside [0,
               1]

    Positive inputs are the paper's (§4.2, code influence: "data used as input of the net, that are all
    positive values"). A feature that does not vary over the calibration records is given the value 0: it
    cannot be learnt from. Raises ParameterError.
    """

    low: np.ndarray
    high: np.ndarray

    def __post_init__(self) -> None:
        low, high = np.asarray(self.low, np.float64), np.asarray(self.high, np.float64)
        if low.ndim != 1 or low.shape != high.shape:
            raise refuse("Scaling", "low", "a vector as long as high", (low.shape, high.shape))
        if not (np.isfinite(low).all() and np.isfinite(high).all() and (low <= high).all()):
            raise refuse("Scaling", "low", "finite and <= high for each feature", "values that are not")
        for name, values in (("low", low), ("high", high)):
            frozen = values.copy()
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)

    @classmethod
    def fit(cls, features: np.ndarray) -> Scaling:
        """Scaling fitted to the features (n, count) of the calibration records."""
        return cls(features.min(axis=0), features.max(axis=0))

    def apply(self, features: np.ndarray) -> np.ndarray:
        """Scaled features (n, count)."""
        span = self.high - self.low
        flat = span == 0.0
        return np.where(flat, 0.0, (features - self.low) / np.where(flat, 1.0, span))
