"""The gate for signals: what passes is a read-only float64 copy, what does not gets one sentence."""

import copy
import pickle
import re

import numpy as np
import pytest

from indexer_env.errors import SignalError
from indexer_env.signal import MINIMUM_SAMPLES, QUANTITY_UNITS, Signal, samples_from


def ramp(n: int = 100) -> np.ndarray:
    return np.linspace(-1.0, 1.0, n)


@pytest.mark.parametrize(
    "values",
    [ramp(), ramp().astype(np.float32), np.arange(100, dtype=np.int16), list(range(100)), ramp(200)[::2]],
    ids=["float64", "float32", "int16", "list", "strided"],
)
def test_values_become_a_read_only_float64_copy(values):
    signal = Signal(values, 1000)
    assert signal.values.dtype == np.float64
    assert signal.values.flags.c_contiguous
    np.testing.assert_array_equal(signal.values, values)
    assert not np.shares_memory(signal.values, values)
    with pytest.raises(ValueError, match="read-only"):
        signal.values[0] = 5.0


def test_a_later_change_of_the_source_array_does_not_reach_the_signal():
    source = ramp()
    signal = Signal(source, 1000.0)
    source[0] = 7.0
    assert signal.values[0] == -1.0


def test_one_turn_of_the_paper_lasts_8_2_seconds():
    signal = Signal(np.zeros(8200), 1000)
    assert isinstance(signal.sample_rate, float)
    assert signal.duration == 8.2
    np.testing.assert_allclose(signal.time[[0, 1, -1]], [0.0, 0.001, 8.199], rtol=1e-15)


def test_equality_is_by_value_and_label():
    signal = Signal(ramp(), 1000.0, unit="m/s^2", source="a.csv")
    assert signal == Signal(ramp(), 1000.0, unit="m/s^2", source="a.csv")
    others = [
        Signal(-ramp(), 1000.0, unit="m/s^2", source="a.csv"),
        Signal(ramp(), 500.0, unit="m/s^2", source="a.csv"),
        Signal(ramp(), 1000.0, unit="rad/s^2", source="a.csv"),
        Signal(ramp(), 1000.0, unit="m/s^2", source="b.csv"),
    ]
    assert all(signal != other for other in others)
    assert signal != "a.csv"
    with pytest.raises(TypeError, match="unhashable"):
        hash(signal)


@pytest.mark.parametrize("twin", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))])
def test_copies_are_equal_and_read_only_too(twin):
    signal = Signal(ramp(), 1000.0, unit="m/s^2", source="a.csv")
    other = twin(signal)
    assert other == signal
    assert not other.values.flags.writeable


@pytest.mark.parametrize(("quantity", "units"), QUANTITY_UNITS.items())
def test_every_known_pair_passes(quantity, units):
    for unit in units:
        assert Signal(ramp(), 1.0, quantity, unit).unit == unit


def with_values(position: int, value: float, n: int = 100) -> np.ndarray:
    values = ramp(n)
    values[position] = value
    return values


REFUSALS = {
    "nan": (
        {"values": with_values(3, np.nan)},
        "Signal.values must be finite, got nan at sample 3 (t = 0.003 s); repair the gap or cut the record there.",
    ),
    "two infinities": (
        {"values": np.where(np.arange(100) > 97, -np.inf, 0.0)},
        "Signal.values must be finite, got -inf at sample 98 (t = 0.098 s) (2 such samples in all); "
        "repair the gap or cut the record there.",
    ),
    "names the source": (
        {"values": with_values(0, np.inf), "source": "day1.csv"},
        "Signal (day1.csv).values must be finite, got inf at sample 0 (t = 0 s); "
        "repair the gap or cut the record there.",
    ),
    "masked": (
        {"values": np.ma.masked_array(ramp(), mask=np.arange(100) == 20)},
        "Signal.values must be free of masked samples, got a masked one at sample 20 (t = 0.02 s); "
        "repair the gap or cut the record there.",
    ),
    "text": (
        {"values": ["1,5"] * 100},
        "Signal.values must be real numbers, got an array of <U3; "
        "convert the samples to float64 and read text columns as numbers first.",
    ),
    "complex": (
        {"values": ramp() * 1j},
        "Signal.values must be real numbers, got an array of complex128; "
        "convert the samples to float64 and read text columns as numbers first.",
    ),
    "bool": (
        {"values": ramp() > 0},
        "Signal.values must be real numbers, got an array of bool; "
        "convert the samples to float64 and read text columns as numbers first.",
    ),
    "objects": (
        {"values": [None] * 100},
        "Signal.values must be real numbers, got an array of object; "
        "convert the samples to float64 and read text columns as numbers first.",
    ),
    "ragged": (
        {"values": [[1.0, 2.0], [1.0]]},
        "Signal.values must be one rectangular array, got rows of unequal length; pick one column.",
    ),
    "two columns": (
        {"values": np.zeros((100, 2))},
        "Signal.values must be one-dimensional (n,), got shape (100, 2); pick one column or add the missing axis.",
    ),
    "scalar": (
        {"values": 3.0},
        "Signal.values must be one-dimensional (n,), got shape (); pick one column or add the missing axis.",
    ),
    "too short": (
        {"values": np.zeros(MINIMUM_SAMPLES - 1)},
        "Signal.values must hold at least 16 samples, got 15; record for longer.",
    ),
    "zero rate": (
        {"sample_rate": 0.0},
        "Signal.sample_rate must be a finite number > 0 Hz, got 0.0.",
    ),
    "infinite rate": (
        {"sample_rate": np.inf},
        "Signal.sample_rate must be a finite number > 0 Hz, got inf.",
    ),
    "bool rate": (
        {"sample_rate": True},
        "Signal.sample_rate must be a finite number > 0 Hz, got True.",
    ),
    "text rate": (
        {"sample_rate": "1 kHz"},
        "Signal.sample_rate must be a finite number > 0 Hz, got '1 kHz'.",
    ),
    "unknown quantity": (
        {"quantity": "table_aceleration"},
        "Signal.quantity must be one of table_acceleration, got 'table_aceleration'; "
        "did you mean 'table_acceleration'.",
    ),
    "unit of another quantity": (
        {"unit": "mm/s^2"},
        "Signal.unit of table_acceleration must be one of rad/s^2, m/s^2, got 'mm/s^2'; did you mean 'm/s^2'.",
    ),
    "source": (
        {"source": 7},
        "Signal.source must be a text, got 7; name the file or the simulation.",
    ),
}


@pytest.mark.parametrize(("change", "sentence"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal_is_one_sentence(change, sentence):
    with pytest.raises(SignalError, match=f"^{re.escape(sentence)}$"):
        Signal(**({"values": ramp(), "sample_rate": 1000.0} | change))


@pytest.mark.skipif(np.finfo(np.longdouble).max <= np.finfo(np.float64).max, reason="long double is double")
def test_a_long_double_beyond_float64_is_named():
    with pytest.raises(SignalError, match="must be finite, got inf at sample 5"):
        Signal(np.where(np.arange(100) == 5, np.longdouble("1e4000"), 0.0), 1000.0)


def test_a_batch_names_row_and_sample():
    rows = np.zeros((3, 100))
    rows[1, 40] = np.nan
    sentence = (
        "batch.values must be finite, got nan at row 1, sample 40 (t = 0.08 s); repair the gap or cut the record there."
    )
    with pytest.raises(SignalError, match=f"^{re.escape(sentence)}$"):
        samples_from(rows, 500.0, owner="batch", axes=2)
    with pytest.raises(SignalError, match=re.escape("two-dimensional (rows, n), got shape (100,)")):
        samples_from(rows[0], 500.0, owner="batch", axes=2)
