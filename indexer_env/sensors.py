"""The sensor chain: from the table's true acceleration to the record that a data logger would keep.

One line of arithmetic, read from the inside out, in the order of a real chain:

    y = Q( clip( ↓ LP( HP( BR( gain · R φ̈ ) ) ) + b + d t + h(t) + n ) )        (gain · φ̈ without a radius)

BR is the bracket's resonance, HP the AC coupling, LP the anti-alias low-pass, ↓ keeps every m-th sample, b is the
offset, d its drift, h the mains hum, n the noise, clip the range and Q the quantiser. Offset, drift, hum and noise come
behind the filters: their numbers are those read off a record (its level, the height of its 50 Hz line, its noise
floor), whatever the filters do. Every stage has a null value; a stage at its null value hands on the very same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env.checks import check_integer, check_number
from indexer_env.errors import SignalError, refuse
from indexer_env.filters import (
    BRACKET_LIMIT,
    bracket_sections,
    check_lowest,
    filtered,
    highpass_sections,
    lowpass_sections,
)
from indexer_env.sensor_noise import checked_generators, noise_sigmas
from indexer_env.signal import MINIMUM_SAMPLES, Signal, samples_from


@dataclass(frozen=True)
class Sensor:
    """An accelerometer with its bracket, amplifier and data logger; the default one reads φ̈ as it is.

    "unit" is that of the record: m/s² with a radius, rad/s² without. t = 0 is the first sample.

    Attributes
    ----------
    radius : float or None
        R [m], > 0: reads the tangential acceleration R·φ̈; None reads φ̈ itself.
    gain : float
        Reading over truth [-], not 0; negative when mounted the wrong way round. Null value 1.
    bracket_hz, bracket_damping : float or None, float
        Undamped natural frequency [Hz] and damping ratio [-] of the mounting bracket
        (`filters.bracket_sections`): 1e-6 to below 0.45 of the rate of the acceleration given to `read`; ratio
        in (0, 0.3]. Null value bracket_hz None.
    highpass_hz : float or None
        AC coupling of a piezoelectric sensor (`filters.highpass_sections`): -3.01 dB frequency [Hz], 1e-6 of that rate
        or more and below half the record's. Null value None.
    lowpass_hz, lowpass_order : float or None, int
        Anti-alias Butterworth filter (`filters.lowpass_sections`): -3.01 dB frequency [Hz], 1e-6 of that rate or
        more and below half the record's, and order, 1 to 12. Null value lowpass_hz None.
    sample_rate : float or None
        Rate of the record [Hz], the input's divided by a whole number m; m > 1 needs the low-pass.
        Null value None, which is m = 1.
    offset, offset_drift : float
        Reading at rest at t = 0 [unit] and its drift [unit/s]. Null value 0.
    hum_amplitude, hum_hz, hum_phase, hum_third : float
        Mains hum A (sin(2π f t + p) + q sin 3(2π f t + p)): amplitude A >= 0 [unit], frequency f [Hz], phase p [rad],
        third harmonic over fundamental q >= 0 [-]; lines below half the record's rate. Null value hum_amplitude 0.
    noise_snr_db : float or None
        White Gaussian noise by its signal-to-noise ratio 10 log10(s² / σ²) >= -300 [dB]: s² is the variance of
        what leaves the filters over this record (offset, drift and hum not counted), σ² that of the
        noise. Null value None.
    noise_density : float
        White Gaussian noise by its one-sided density [unit/√Hz]: σ² = density² · (record's rate) / 2.
        Null value 0; only one of the two noises may be set.
    full_scale : float or None
        Range ±full_scale [unit], > 0; readings beyond are clipped. Null value None.
    bits : int or None
        Two's-complement quantiser over the range, 2 to 32 bits: step 2·full_scale / 2^bits, rounded to
        nearest, the highest reading one step below full_scale. Null value None.

    Raises
    ------
    ParameterError
        One sentence, at construction or, for what depends on the rate of the acceleration, on reading.
    """

    radius: float | None = None
    gain: float = 1.0
    bracket_hz: float | None = None
    bracket_damping: float = 0.02
    highpass_hz: float | None = None
    lowpass_hz: float | None = None
    lowpass_order: int = 4
    sample_rate: float | None = None
    offset: float = 0.0
    offset_drift: float = 0.0
    hum_amplitude: float = 0.0
    hum_hz: float = 50.0
    hum_phase: float = 0.0
    hum_third: float = 0.0
    noise_snr_db: float | None = None
    noise_density: float = 0.0
    full_scale: float | None = None
    bits: int | None = None

    def __post_init__(self) -> None:
        self._check_positive("hum_hz", "Hz")
        frequencies = dict.fromkeys(("bracket_hz", "highpass_hz", "lowpass_hz", "sample_rate"), "Hz")
        for name, unit in {"radius": "m", **frequencies, "full_scale": self.unit}.items():
            if getattr(self, name) is not None:
                self._check_positive(name, unit, "leave it out (null) to switch it off")
        for name, unit in (("offset", self.unit), ("offset_drift", f"{self.unit}/s"), ("hum_phase", "rad")):
            check_number("Sensor", name, getattr(self, name), unit=unit)
        density = f"{self.unit}/sqrt(Hz)"
        for name, unit in (("hum_amplitude", self.unit), ("hum_third", "-"), ("noise_density", density)):
            check_number("Sensor", name, getattr(self, name), low=0.0, unit=unit)
        check_number("Sensor", "gain", self.gain, remedy="use 1 for a true reading")
        if self.gain == 0.0:
            raise refuse("Sensor", "gain", "other than 0", self.gain, "use -1 for a reversed mounting")
        self._check_positive("bracket_damping", "-", "brackets have about 0.005 to 0.1", high=0.3)
        check_integer("Sensor", "lowpass_order", self.lowpass_order, low=1, high=12)
        if self.noise_snr_db is not None:
            check_number("Sensor", "noise_snr_db", self.noise_snr_db, low=-300.0, unit="dB")
            if self.noise_density > 0.0:
                rule = "0 where noise_snr_db is set"
                raise refuse("Sensor", "noise_density", rule, self.noise_density, "keep one of the two")
        if self.bits is not None:
            check_integer("Sensor", "bits", self.bits, low=2, high=32)
            if self.full_scale is None:
                rule = f"a finite number > 0 {self.unit} where bits is set"
                raise refuse("Sensor", "full_scale", rule, None, "state the range that the bits divide")
        if self.sample_rate is not None:
            self._check_below_half(self.sample_rate)

    @property
    def unit(self) -> str:
        """Unit of the record: "m/s^2" with a radius, "rad/s^2" without."""
        return "rad/s^2" if self.radius is None else "m/s^2"

    @property
    def noisy(self) -> bool:
        """True where a reading needs a random generator."""
        return self.noise_snr_db is not None or self.noise_density > 0.0

    def record_rate(self, sample_rate: float) -> float:
        """Rate [Hz] of the record that is read from an acceleration given at `sample_rate` [Hz]."""
        return float(sample_rate) / self._every(sample_rate)

    def record_samples(self, samples: int, sample_rate: float) -> int:
        """Samples of the record that is read from so many of an acceleration given at `sample_rate` [Hz]."""
        return -(-samples // self._every(sample_rate))

    def read(self, acceleration: np.ndarray, sample_rate: float, rng: np.random.Generator | None = None) -> Signal:
        """Read one record.

        Parameters
        ----------
        acceleration : array_like, shape (n,)
            True angular acceleration of the table φ̈ [rad/s²].
        sample_rate : float
            Its samples per second [Hz].
        rng : numpy.random.Generator or None
            Source of the noise: one standard normal is drawn per sample of the record, none without noise.

        Returns
        -------
        Signal
            "table_acceleration" in `unit`: n samples, or ceil(n / m) at 1 / m of the rate.

        Raises
        ------
        SignalError
            The acceleration does not pass the gate, or noise_snr_db meets a record that does not vary.
        ParameterError
            The rate does not suit the sensor, or the noise has no generator.
        """
        rows = samples_from(acceleration, sample_rate, owner="Sensor.read")[np.newaxis]
        record = self._chain(rows, sample_rate, None if rng is None else [rng])[0]
        return Signal(record, self.record_rate(sample_rate), unit=self.unit, source="simulated sensor")

    def read_batch(
        self,
        accelerations: np.ndarray,
        sample_rate: float,
        rngs: Sequence[np.random.Generator] | None = None,
    ) -> np.ndarray:
        """Read many records; row i has the very bits that `read` gives alone.

        accelerations (rows, n) [rad/s²], rngs one generator per row (None without noise). Returns a new
        array (rows, n) or (rows, ceil(n / m)) in `unit` at `record_rate(sample_rate)`. Raises as `read`,
        naming the row; take rows that a simulation rejected (NaN) out first.
        """
        rows = samples_from(accelerations, sample_rate, owner="Sensor.read_batch", axes=2)
        return self._chain(rows, sample_rate, rngs)

    def _chain(self, rows: np.ndarray, sample_rate: float, rngs: Sequence[np.random.Generator] | None) -> np.ndarray:
        every = self._every(sample_rate)
        rate = float(sample_rate) / every
        sections = self.sections(sample_rate)
        generators = checked_generators(rngs, len(rows)) if self.noisy else ()
        y = rows * self.scale
        for section in sections:
            y = filtered(section, y)
        y = np.ascontiguousarray(y[:, ::every])
        if y.shape[1] < MINIMUM_SAMPLES:
            rule = f"at least {MINIMUM_SAMPLES} samples at {rate:g} Hz"
            raise SignalError(f"A sensor's record must hold {rule}, got {y.shape[1]}; simulate for longer.")
        # The noise is sized before the background, which is no part of the signal, is added.
        sigmas = noise_sigmas(self.noise_snr_db, self.noise_density, y, rate) if self.noisy else []
        y = self.with_background(y, np.arange(y.shape[1]) / rate)
        for row, sigma, generator in zip(y, sigmas, generators, strict=False):
            row += sigma * generator.standard_normal(row.size)
        return self.recorded(y)

    @property
    def scale(self) -> float:
        """Reading per true acceleration: gain · R [m], or gain without a radius [-]."""
        return self.gain if self.radius is None else self.gain * self.radius

    def sections(self, sample_rate: float) -> list[np.ndarray]:
        """The chain's filters in their order, as second-order sections; ParameterError where the rate does not suit."""
        self._check_below_half(float(sample_rate) / self._every(sample_rate))
        check_lowest(sample_rate, bracket_hz=self.bracket_hz, highpass_hz=self.highpass_hz, lowpass_hz=self.lowpass_hz)
        limit = BRACKET_LIMIT * sample_rate
        if self.bracket_hz is not None and self.bracket_hz >= limit:
            rule = f"below {limit:g} Hz ({BRACKET_LIMIT:g} of the {sample_rate:g} Hz that it reads at)"
            raise refuse("Sensor", "bracket_hz", rule, self.bracket_hz, "lower it or simulate at a higher rate")
        filters = []
        if self.bracket_hz is not None:
            filters.append(bracket_sections(self.bracket_hz, self.bracket_damping, sample_rate))
        if self.highpass_hz is not None:
            filters.append(highpass_sections(self.highpass_hz, sample_rate))
        if self.lowpass_hz is not None:
            filters.append(lowpass_sections(self.lowpass_hz, self.lowpass_order, sample_rate))
        return filters

    def with_background(self, y: Any, time: Any, sine: Callable[[Any], Any] = np.sin) -> Any:
        """Readings (rows, n) with offset, drift and hum added; time (n,) or (rows, n) since the first sample [s]."""
        # Adding 0 would turn -0.0 into 0.0, hence no unconditional sums.
        if self.offset != 0.0:
            y = y + self.offset
        if self.offset_drift != 0.0:
            y = y + self.offset_drift * time
        if self.hum_amplitude != 0.0:
            angle = 2.0 * math.pi * self.hum_hz * time + self.hum_phase
            y = y + self.hum_amplitude * (sine(angle) + self.hum_third * sine(3.0 * angle))
        return y

    def recorded(self, y: Any) -> Any:
        """Readings (rows, n), an array or a tensor, clipped to the range and quantised."""
        if self.full_scale is None:
            return y
        y = y.clip(-self.full_scale, self.full_scale)
        if self.bits is None:
            return y
        half = 2 ** (self.bits - 1)
        step = self.full_scale / half
        return (y / step).round().clip(-half, half - 1) * step

    def _check_positive(self, name: str, unit: str, remedy: str = "", high: float | None = None) -> None:
        value = getattr(self, name)
        check_number("Sensor", name, value, low=0.0, low_open=True, high=high, unit=unit, remedy=remedy)

    def _every(self, sample_rate: float) -> int:
        check_number("Sensor.read", "sample_rate", sample_rate, low=0.0, low_open=True, unit="Hz")
        if self.sample_rate is None:
            return 1
        ratio = sample_rate / self.sample_rate
        every = round(ratio)
        if every < 1 or abs(ratio - every) > 1e-9 * ratio:
            rule = f"the input's rate of {sample_rate:g} Hz divided by a whole number"
            raise refuse("Sensor", "sample_rate", rule, self.sample_rate, "simulate at a whole multiple of it")
        if every > 1 and self.lowpass_hz is None:
            remedy = f"choose a cut-off below {self.sample_rate / 2:g} Hz"
            raise refuse("Sensor", "lowpass_hz", f"set where 1 of {every} samples is kept", None, remedy)
        return every

    def _check_below_half(self, rate: float) -> None:
        rule = f"below {rate / 2:g} Hz (half the record's rate of {rate:g} Hz)"
        for name in ("highpass_hz", "lowpass_hz"):
            if getattr(self, name) is not None and getattr(self, name) >= rate / 2:
                raise refuse("Sensor", name, rule, getattr(self, name), "leave it out (null) to switch it off")
        if self.hum_amplitude > 0.0:
            if self.hum_hz >= rate / 2:
                raise refuse("Sensor", "hum_hz", rule, self.hum_hz, "set hum_amplitude to 0 to switch it off")
            if self.hum_third > 0.0 and 3.0 * self.hum_hz >= rate / 2:
                rule = f"0 where its line at {3 * self.hum_hz:g} Hz is not {rule}"
                raise refuse("Sensor", "hum_third", rule, self.hum_third)
