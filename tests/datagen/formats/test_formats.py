"""Every format gives the record that was written, and its damage in one sentence."""

from __future__ import annotations

import numpy as np
import pytest

from datagen.formats import FORMATS, SUFFIXES, read_table
from datagen.measured import Reading, read_recording, read_signal
from indexer_env.errors import ParameterError, SignalError
from tests.datagen.formats.samples import FULL_SCALE, OPTIONS, PULSE, WRITERS, written

RATE = 2000.0
TOLERANCE = {"uff": 1e-11, "wav": 1e-14}
"""Relative, where a format does not keep a float64 to the last bit: 4E20.12; division by the full scale."""


@pytest.fixture
def values() -> np.ndarray:
    return np.random.default_rng(1).normal(scale=3.0, size=500)


@pytest.fixture
def pulse() -> np.ndarray:
    return np.where(np.arange(500) % 100 < 5, 5.0, 0.0)


@pytest.fixture(params=sorted(WRITERS))
def kind(request) -> str:
    return request.param


def refusal(path, **options) -> str:
    with pytest.raises(SignalError) as caught:
        read_signal(path, **options)
    text = str(caught.value)
    assert "\n" not in text and text.endswith(".") and str(path) in text
    return text


def test_the_record_that_was_written_is_read(kind, tmp_path, values, pulse):
    path = written(kind, tmp_path, values, pulse, RATE)
    reading = Reading(**OPTIONS.get(kind, {}))
    recording = read_recording(path, reading, PULSE.get(kind, "pulse"))
    assert recording.signal.sample_rate == pytest.approx(RATE, rel=1e-12)
    assert recording.signal.unit == "m/s^2"
    tolerance = TOLERANCE.get(kind, 0.0)
    np.testing.assert_allclose(recording.signal.values, values, rtol=tolerance, atol=0.0)
    assert recording.pulse is not None
    worth = FULL_SCALE if kind == "wav" else 1.0
    np.testing.assert_allclose(recording.pulse * worth, pulse, rtol=1e-12)


def test_every_channel_can_be_chosen(kind, tmp_path, values, pulse):
    path = written(kind, tmp_path, values, pulse, RATE)
    for column in read_table(path).columns:
        assert column.size == 500 and column.numbers().shape == (500,)
    name = PULSE.get(kind, "pulse")
    signal = read_signal(path, signal_column=name, scale=2.0, unit="g")
    assert signal.values.max() > 0.0
    assert "numeric column 'other'" in refusal(path, signal_column="other")


def test_a_file_cut_anywhere_is_refused(kind, tmp_path, values, pulse):
    path = written(kind, tmp_path, values, pulse, RATE)
    content = path.read_bytes()
    for share in (0.1, 0.49, 0.9, 0.99):
        path.write_bytes(content[: int(share * len(content))])
        if kind != "csv":
            refusal(path, **OPTIONS.get(kind, {}))


def test_an_ending_that_lies_is_refused(tmp_path, values, pulse):
    path = written("tdms", tmp_path, values, pulse, RATE)
    moved = path.rename(tmp_path / "a.wav")
    assert "damaged WAV" in refusal(moved)


def test_a_wav_needs_scale_and_unit(tmp_path, values, pulse):
    path = written("wav", tmp_path, values, pulse, RATE)
    assert "full scale" in refusal(path, signal_column="channel 1")
    with pytest.raises(ParameterError, match="unit"):
        read_signal(path, signal_column="channel 1", scale=2.0)
    with pytest.raises(ParameterError, match="other than 0"):
        read_signal(path, signal_column="channel 1", scale=0.0, unit="g")


def test_the_rate_comes_from_one_place(kind, tmp_path, values, pulse):
    path = written(kind, tmp_path, values, pulse, RATE)
    assert "leave sample_rate out" in refusal(path, **OPTIONS.get(kind, {}), sample_rate=100.0)


def test_the_package_docstring_lists_every_format():
    import datagen.formats

    for name in FORMATS:
        assert name in (datagen.formats.__doc__ or "")
    assert ".mat" in SUFFIXES and ".csv" in SUFFIXES
