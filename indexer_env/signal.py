"""The one gate for signals from outside, and what comes out of it.

Whatever reaches a diagnosis or a calibration - a simulated reading, a column of a file, an array typed by
hand - passes here once, so that nothing behind the gate has to ask again about type, length, rate or
missing samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from indexer_env.checks import check_choice, check_number
from indexer_env.errors import ParameterError, SignalError

MINIMUM_SAMPLES = 16
"""Fewest samples of a signal [-]; less than this shows no vibration whatever the rate."""

QUANTITY_UNITS: dict[str, tuple[str, ...]] = {"table_acceleration": ("rad/s^2", "m/s^2")}
"""Known quantities and the units each may carry: the table's angular acceleration φ̈, or R·φ̈ at a radius R."""


def samples_from(values: object, sample_rate: object, *, owner: str, axes: int = 1) -> np.ndarray:
    """Return `values` as float64 samples, or say in one sentence why they cannot be used.

    Parameters
    ----------
    values : array_like, shape (n,) for axes = 1, (rows, n) for axes = 2
        Real numbers (integers or floats; bool, complex, text and objects are refused), all finite and
        none masked.
    sample_rate : float
        Samples per second [Hz], > 0.
    owner : str
        Who is asking, e.g. "Signal"; the sentence begins with it.

    Returns
    -------
    numpy.ndarray, float64
        A view of `values` where no conversion was needed, a new array otherwise.

    Raises
    ------
    SignalError
        The first offending sample is named with its index and its time after the first sample [s].
    """
    rate = _rate(owner, sample_rate)
    name = f"{owner}.values"
    try:
        array = np.asanyarray(values)
    except ValueError as error:
        raise SignalError(
            f"{name} must be one rectangular array, got rows of unequal length; pick one column."
        ) from error
    if array.dtype.kind not in "iuf":
        raise SignalError(
            f"{name} must be real numbers, got an array of {array.dtype}; "
            "convert the samples to float64 and read text columns as numbers first."
        )
    if array.ndim != axes:
        shape = "one-dimensional (n,)" if axes == 1 else "two-dimensional (rows, n)"
        raise SignalError(f"{name} must be {shape}, got shape {array.shape}; pick one column or add the missing axis.")
    if array.shape[-1] < MINIMUM_SAMPLES:
        raise SignalError(
            f"{name} must hold at least {MINIMUM_SAMPLES} samples, got {array.shape[-1]}; record for longer."
        )
    _refuse_first(np.ma.getmaskarray(array), name, rate, "free of masked samples", "a masked one")
    # A long double beyond the range of float64 turns infinite here and is named below: no need to warn too.
    with np.errstate(over="ignore"):
        samples = np.asarray(array, dtype=np.float64)
    _refuse_first(~np.isfinite(samples), name, rate, "finite", samples)
    return samples


@dataclass(frozen=True, eq=False)
class Signal:
    """A uniformly sampled record of one quantity.

    Two signals are equal when every field is, sample by sample. A copied or unpickled signal has passed
    the gate again.

    Attributes
    ----------
    values : numpy.ndarray, shape (n,), float64, read-only
        The samples, in `unit`: a copy of what was given. n >= MINIMUM_SAMPLES.
    sample_rate : float
        Samples per second [Hz], > 0.
    quantity : str
        A key of QUANTITY_UNITS.
    unit : str
        One of the quantity's units; the angular acceleration [rad/s^2] unless stated.
    source : str
        Where the record comes from, for messages and reports: a file name, a simulation; may be empty.

    Raises
    ------
    SignalError
        One sentence: which field, the rule, what was got, and the first offending sample's index and time.
    """

    values: np.ndarray
    sample_rate: float
    quantity: str = "table_acceleration"
    unit: str = "rad/s^2"
    source: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.source, str):
            raise SignalError(f"Signal.source must be a text, got {self.source!r}; name the file or the simulation.")
        _check_choice("quantity", self.quantity, QUANTITY_UNITS)
        _check_choice(f"unit of {self.quantity}", self.unit, QUANTITY_UNITS[self.quantity])
        owner = f"Signal ({self.source})" if self.source else "Signal"
        values = samples_from(self.values, self.sample_rate, owner=owner).copy()
        values.flags.writeable = False
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "sample_rate", float(self.sample_rate))

    @property
    def duration(self) -> float:
        """Time the record stands for, n / sample_rate [s]: 8.2 s for 8200 samples at 1000 Hz."""
        return self.values.size / self.sample_rate

    @property
    def time(self) -> np.ndarray:
        """Time of each sample since the first, k / sample_rate, shape (n,) [s]."""
        return np.arange(self.values.size) / self.sample_rate

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Signal):
            return NotImplemented
        mine = (self.sample_rate, self.quantity, self.unit, self.source)
        theirs = (other.sample_rate, other.quantity, other.unit, other.source)
        return mine == theirs and np.array_equal(self.values, other.values)

    # Equal by value yet holding an array, a signal is as unhashable as the array.
    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __reduce__(self) -> tuple[object, ...]:
        # Unpickled arrays are writable; through the constructor they become read-only and checked again.
        return Signal, (np.array(self.values), self.sample_rate, self.quantity, self.unit, self.source)


def _rate(owner: str, sample_rate: object) -> float:
    try:
        check_number(owner, "sample_rate", sample_rate, low=0.0, low_open=True, unit="Hz")
    except ParameterError as error:
        raise SignalError(str(error)) from None
    return float(sample_rate)  # pyright: ignore[reportArgumentType]


def _check_choice(name: str, value: object, choices: object) -> None:
    try:
        check_choice("Signal", name, value, choices)  # pyright: ignore[reportArgumentType]
    except ParameterError as error:
        raise SignalError(str(error)) from None


def _refuse_first(bad: np.ndarray, name: str, rate: float, rule: str, got: object) -> None:
    if not bad.any():
        return
    first = np.unravel_index(int(np.argmax(bad)), bad.shape)
    what = f"{got[first]}" if isinstance(got, np.ndarray) else got
    row = f"row {first[0]}, " if bad.ndim == 2 else ""
    count = int(np.count_nonzero(bad))
    others = f" ({count} such samples in all)" if count > 1 else ""
    raise SignalError(
        f"{name} must be {rule}, got {what} at {row}sample {first[-1]} (t = {first[-1] / rate:g} s){others}; "
        "repair the gap or cut the record there."
    )
