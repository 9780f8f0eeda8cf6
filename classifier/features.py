"""Features: what the network sees of a record.

One class per kind of feature, found by its ``kind`` in FEATURES. Each is a frozen object that turns records
(n, samples) into features (n, count), record by record: no feature depends on another record. Records of several
channels (n, channels, samples) give (n, channels · count), one channel after the other. The scaling that does depend
on other records is `Scaling`, and it is fitted on the calibration subset alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal import get_window

from indexer_env.build import from_mapping
from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse

_CHUNK = 16
"""Records at a time: what their windowed segments take, 2 MiB for one-turn records, stays in the processor's cache."""


@dataclass(frozen=True)
class Features(ABC):
    """What every kind of feature offers; a member is a frozen dataclass of its numbers."""

    kind: ClassVar[str]

    @abstractmethod
    def frequencies(self, sample_rate: float) -> np.ndarray:
        """Frequencies (count,) [Hz] of the features at a sample rate [Hz]. Raises ParameterError above half
        the rate.
        """

    @abstractmethod
    def density(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Power spectral densities (n, count) [(unit of the record)²/Hz] at these frequencies, of records
        (n, samples) at a sample rate [Hz].

        Raises ParameterError for records that are too short.
        """

    @abstractmethod
    def compute(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Features (n, count) of records (n, samples). Raises ParameterError as `density` does."""


@dataclass(frozen=True)
class Psd(Features):
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
            raise refuse("Psd", "resolution_hz", f"<= Psd.maximum_hz = {self.maximum_hz:g} Hz", self.resolution_hz)

    def segment(self, sample_rate: float) -> int:
        """Samples in one segment at a sample rate [Hz]."""
        return round(sample_rate / self.resolution_hz)

    def frequencies(self, sample_rate: float) -> np.ndarray:
        """Frequencies (count,) [Hz] of the features at a sample rate [Hz]. Raises ParameterError above half
        the rate.
        """
        return _lines("Psd", self.segment(sample_rate), self.maximum_hz, sample_rate)

    def density(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Densities (n, count) [(unit of the record)²/Hz] of records (n, samples) at a sample rate [Hz].

        Raises ParameterError for records shorter than one segment.
        """
        if records.ndim == 3:
            return _by_channel(self.density, records, sample_rate)
        count = len(self.frequencies(sample_rate))
        segment = self.segment(sample_rate)
        if records.shape[-1] < segment:
            duration = records.shape[-1] / sample_rate
            rule = f">= {1 / duration:g} Hz for records of {duration:g} s"
            raise refuse("Psd", "resolution_hz", rule, self.resolution_hz)
        densities = np.empty((len(records), count))
        for first in range(0, len(records), _CHUNK):
            chunk = np.asarray(records[first : first + _CHUNK], dtype=np.float64)
            densities[first : first + _CHUNK] = _welch(chunk, sample_rate, segment)[:, :count]
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


@dataclass(frozen=True)
class Fft(Features):
    """Amplitudes of the lines of the whole record's spectrum, above 0 Hz up to maximum_hz inclusive.

        a_j = 2/N |Σ_t (x_t − x̄) e^(−2πi j t / N)|,   f_j = j f_s/N,   j = 1, 2 …

    maximum_hz  last frequency kept [Hz], at most half the sample rate: the paper's cut
    duration_s  part of the record that is transformed [s], N = round(duration_s · f_s) samples; the spacing of
                the lines is its inverse, 0.122 Hz for the paper's 8.2 s

    The window is rectangular: a record of one table turn is periodic but for what its play does. The mean x̄ is
    taken away as in `Psd`, samples after duration_s are not used. A line at half the sample rate counts twice.
    Source: the paper's §4.2, which prints no formula.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "fft"

    maximum_hz: float = 100.0
    duration_s: float = 8.2

    def __post_init__(self) -> None:
        check_number("Fft", "duration_s", self.duration_s, low=0.0, low_open=True, unit="s")
        check_number("Fft", "maximum_hz", self.maximum_hz, low=0.0, low_open=True, unit="Hz")
        if self.maximum_hz * self.duration_s < 1.0:
            raise refuse("Fft", "maximum_hz", f">= 1 / Fft.duration_s = {1 / self.duration_s:g} Hz", self.maximum_hz)

    def segment(self, sample_rate: float) -> int:
        """Samples that are transformed at a sample rate [Hz]."""
        return round(self.duration_s * sample_rate)

    def frequencies(self, sample_rate: float) -> np.ndarray:
        """Frequencies (count,) [Hz] of the lines at a sample rate [Hz]. Raises ParameterError above half the
        rate.
        """
        return _lines("Fft", self.segment(sample_rate), self.maximum_hz, sample_rate)[1:]

    def density(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Periodograms a² N / (2 f_s) (n, count), which say in the PSD's unit what the amplitudes say."""
        return self.compute(records, sample_rate) ** 2 * self.segment(sample_rate) / (2 * sample_rate)

    def compute(self, records: np.ndarray, sample_rate: float) -> np.ndarray:
        """Amplitudes a (n, count), in the unit of the records (n, samples).

        Raises ParameterError for records shorter than duration_s.
        """
        if records.ndim == 3:
            return _by_channel(self.compute, records, sample_rate)
        count, segment = len(self.frequencies(sample_rate)), self.segment(sample_rate)
        if records.shape[-1] < segment:
            duration = records.shape[-1] / sample_rate
            raise refuse("Fft", "duration_s", f"<= {duration:g} s, the duration of the records", self.duration_s)
        amplitudes = np.empty((len(records), count))
        for first in range(0, len(records), _CHUNK):
            chunk = np.asarray(records[first : first + _CHUNK, :segment], dtype=np.float64)
            spectrum = np.fft.rfft(chunk - chunk.mean(axis=1, keepdims=True))
            amplitudes[first : first + _CHUNK] = 2 / segment * np.abs(spectrum[:, 1 : count + 1])
        return amplitudes


def _by_channel(
    measure: Callable[[np.ndarray, float], np.ndarray], records: np.ndarray, sample_rate: float
) -> np.ndarray:
    """What `measure` gives of each channel of records (n, channels, samples), side by side (n, channels · count)."""
    flat = records.reshape(-1, records.shape[-1])
    return measure(flat, sample_rate).reshape(len(records), -1)


def _welch(records: np.ndarray, sample_rate: float, segment: int) -> np.ndarray:
    """Densities (n, segment // 2 + 1) as `Psd` defines them, of float64 records (n, samples).

    That of `scipy.signal.welch`, at a fifth of its cost for a single record.
    """
    window = _hann(segment)
    segments = sliding_window_view(records, segment, axis=1)[:, :: segment - segment // 2]
    spectrum = np.fft.rfft((segments - segments.mean(axis=2, keepdims=True)) * window)
    density = (spectrum.real**2 + spectrum.imag**2).mean(axis=1) * (2.0 / (sample_rate * (window @ window)))
    density[:, 0] /= 2.0
    if segment % 2 == 0:
        density[:, -1] /= 2.0
    return density


@cache
def _hann(samples: int) -> np.ndarray:
    """The periodic Hann window (samples,)."""
    window = np.asarray(get_window("hann", samples))
    window.flags.writeable = False
    return window


def _lines(owner: str, samples: int, maximum_hz: float, sample_rate: float) -> np.ndarray:
    """Frequencies [Hz] of a transform of so many samples, from 0 to maximum_hz inclusive."""
    if maximum_hz > sample_rate / 2:
        raise refuse(owner, "maximum_hz", f"<= half the sample rate = {sample_rate / 2:g} Hz", maximum_hz)
    frequencies = np.fft.rfftfreq(samples, 1 / sample_rate)
    return frequencies[frequencies <= maximum_hz * (1 + 1e-9)]


FEATURES: dict[str, type[Features]] = {kind.kind: kind for kind in (Psd, Fft)}


def make_features(mapping: Mapping[str, Any], kinds: Sequence[str] = tuple(FEATURES)) -> Features:
    """Features from a plain mapping ``{"kind": ..., parameters}``; `kinds` are those a refusal names. Raises
    ParameterError.
    """
    parameters = dict(mapping)
    kind = parameters.pop("kind", None)
    check_choice("features", "kind", kind, kinds)
    return from_mapping(FEATURES[kind], parameters, owner="features")


def describe_features(features: Features) -> dict[str, Any]:
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
