"""Every format gives the record that was written, and its damage in one sentence."""

from __future__ import annotations

import struct

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import pyuff
import scipy.io
import soundfile
from nptdms import ChannelObject, TdmsWriter

from indexer_env.errors import ParameterError, SignalError
from indexer_records.acceleration_units import STANDARD_GRAVITY
from indexer_records.formats import FORMATS, SUFFIXES, read_table
from indexer_records.measured import Reading, read_recording, read_signal
from tests.indexer_records.formats.samples import FULL_SCALE, OPTIONS, PULSE, WRITERS, written

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


@pytest.mark.parametrize("kind", sorted(set(WRITERS) - {"csv"}))
def test_a_file_cut_anywhere_is_refused(kind, tmp_path, values, pulse):
    path = written(kind, tmp_path, values, pulse, RATE)
    content = path.read_bytes()
    for share in (0.1, 0.49, 0.9, 0.99):
        path.write_bytes(content[: int(share * len(content))])
        refusal(path, **OPTIONS.get(kind, {}))


def test_a_csv_cut_within_a_row_is_refused_with_its_line(tmp_path, values, pulse):
    """But for a cut in or behind the last number, which the text does not show; the cells before it are whole."""
    path = written("csv", tmp_path, values, pulse, RATE)
    content = path.read_bytes()
    row = content.rindex(b"\n", 0, -1) + 1
    last_cell = content.rindex(b",") + 1
    for end in range(row, len(content) + 1):
        path.write_bytes(content[:end])
        if end == row:
            np.testing.assert_array_equal(read_signal(path).values, values[:-1])
        elif end < last_cell:
            assert "line 501" in refusal(path), content[row:end]
        else:
            np.testing.assert_array_equal(read_signal(path).values, values)


def test_tdms_of_several_segments_and_texts(tmp_path, values):
    path = tmp_path / "a.tdms"
    stated = {"wf_increment": 1e-3, "unit_string": "g"}
    with TdmsWriter(path) as writer:
        for piece in np.split(values, 5):
            writer.write_segment([ChannelObject("run", "acc", piece, properties=stated)])
        writer.write_segment([ChannelObject("run", "notes", ["a", "bc"])])
    signal = read_signal(path)
    np.testing.assert_array_equal(signal.values, values * STANDARD_GRAVITY)


def test_big_endian_mat(tmp_path, values):
    def element(kind: int, data: bytes) -> bytes:
        return struct.pack(">II", kind, len(data)) + data + bytes(-len(data) % 8)

    parts = element(6, struct.pack(">II", 6, 0)) + element(5, struct.pack(">ii", 1, 500)) + element(1, b"acc")
    path = tmp_path / "a.mat"
    path.write_bytes(b" " * 124 + b"\x01\x00MI" + element(14, parts + element(9, values.astype(">f8").tobytes())))
    np.testing.assert_array_equal(read_signal(path, sample_rate=1e3, unit="m/s^2").values, values)


def test_matlab_objects_beside_the_record_do_no_harm(tmp_path, values):
    """An opaque object (class 17: tables, dates, functions) is flags, three texts and a matrix, without dimensions."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"acc": values}, do_compression=False)
    struct_of = {"f": np.arange(3.0)}
    scipy.io.savemat(tmp_path / "b.mat", {"f": struct_of}, do_compression=False)
    inner = (tmp_path / "b.mat").read_bytes()[128:]
    texts = b"".join(element(1, text) for text in (b"variable", b"MCOSabcd", b"tabletab"))
    handle = element(14, element(6, struct.pack("<II", 17, 0)) + texts + inner)
    path.write_bytes(path.read_bytes() + handle)
    np.testing.assert_array_equal(read_signal(path, signal_column="acc", sample_rate=1e3, unit="m/s^2").values, values)


def test_uneven_uff_gives_a_column_of_time(tmp_path, values):
    path = tmp_path / "a.uff"
    history = pyuff.prepare_58(
        func_type=1, id1="acc", rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1, data=values[:100].copy(),
        x=np.arange(100) / 100.0, abscissa_spacing=0, abscissa_min=0.0, abscissa_inc=0.0, num_pts=100, ord_data_type=4,
        abscissa_spec_data_type=17, ordinate_spec_data_type=12, orddenom_spec_data_type=0,
        ordinate_axis_units_lab="g", abscissa_axis_units_lab="s",
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets(history, mode="overwrite")
    signal = read_signal(path)
    assert signal.sample_rate == pytest.approx(100.0)
    np.testing.assert_allclose(signal.values, values[:100] * STANDARD_GRAVITY, rtol=1e-11)


def test_integers_of_a_wav_are_shares_of_the_full_scale(tmp_path):
    path = tmp_path / "a.wav"
    soundfile.write(path, np.linspace(-0.5, 0.5, 100), 1000, subtype="PCM_24")
    signal = read_signal(path, scale=20.0, unit="g")
    np.testing.assert_allclose(signal.values, np.linspace(-10, 10, 100) * STANDARD_GRAVITY, atol=200 * 2.0**-23)


def test_an_ending_that_lies_is_refused(tmp_path, values, pulse):
    path = written("tdms", tmp_path, values, pulse, RATE)
    moved = path.rename(tmp_path / "a.wav")
    assert "damaged WAV" in refusal(moved)


def packed(path, values, **attributes):
    with h5py.File(path, "w") as file:
        file.create_dataset("acc", data=values).attrs.update({"unit": "m/s^2", "fs": 1e3, **attributes})
    return path


def test_packed_samples_of_an_hdf5_are_unpacked(tmp_path):
    counts = np.arange(-50, 50, dtype="i2")
    signal = read_signal(packed(tmp_path / "a.h5", counts, scale_factor=np.float32(0.25), add_offset=2.0))
    np.testing.assert_array_equal(signal.values, 0.25 * counts + 2.0)
    assert "scale_factor of /acc must be one number, got 'x'" in refusal(
        packed(tmp_path / "a.h5", counts, scale_factor="x")
    )


def test_the_rate_of_an_hdf5_may_be_a_text(tmp_path):
    assert read_signal(packed(tmp_path / "a.h5", np.arange(90.0), fs="1000.5")).sample_rate == 1000.5
    for rate, got in (("1 kHz", "1 kHz"), ([1000.0, 2000.0], "[1000. 2000.]")):
        said = refusal(packed(tmp_path / "a.h5", np.arange(90.0), fs=rate))
        assert f"fs of /acc must be one number, got '{got}'; correct it" in said and "damaged" not in said


def test_a_wav_needs_scale_and_unit(tmp_path, values, pulse):
    path = written("wav", tmp_path, values, pulse, RATE)
    assert "full scale" in refusal(path, signal_column="channel 1")
    with pytest.raises(ParameterError, match="unit"):
        read_signal(path, signal_column="channel 1", scale=2.0)
    with pytest.raises(ParameterError, match="other than 0"):
        read_signal(path, signal_column="channel 1", scale=0.0, unit="g")


def test_the_rate_comes_from_one_place(kind, tmp_path, values, pulse):
    path = written(kind, tmp_path, values, pulse, RATE)
    assert "leave read.sample_rate out" in refusal(path, **OPTIONS.get(kind, {}), sample_rate=100.0)


def test_the_package_docstring_lists_every_format():
    import indexer_records.formats

    for name in FORMATS:
        assert name in (indexer_records.formats.__doc__ or "")
    assert ".mat" in SUFFIXES and ".csv" in SUFFIXES


def test_a_relative_path_is_that_of_the_folder_the_process_is_in_now(tmp_path, monkeypatch, values, pulse):
    """The worker that reads the files begins in the folder of the first."""
    for name, factor in (("one", 1.0), ("two", 2.0)):
        (tmp_path / name).mkdir()
        written("parquet", tmp_path / name, factor * values, pulse, RATE).rename(tmp_path / name / "a.parquet")
    for name, factor in (("one", 1.0), ("two", 2.0)):
        monkeypatch.chdir(tmp_path / name)
        np.testing.assert_array_equal(read_signal("a.parquet", signal_column="acc").values, factor * values)


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
@pytest.mark.parametrize("clock", [pa.timestamp, pa.duration])
def test_timestamps_of_a_parquet_file_are_time(tmp_path, values, unit, clock):
    ticks = {"ms": 1, "us": 10**3, "ns": 10**6}[unit]
    times = pa.array(range(1_790_000_000_000 * ticks, (1_790_000_000_000 + 500) * ticks, ticks), clock(unit))
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"a [g]": values, "__index_level_0__": times}), path)
    signal = read_signal(path)
    assert signal.sample_rate == 1000.0 and signal.unit == "m/s^2"
    # a rate that is given, and a column of time in numbers, stand above a clock
    assert read_signal(path, sample_rate=500.0).sample_rate == 500.0
    pq.write_table(pa.table({"a": values, "clock": times, "time [s]": np.arange(500) / 2000.0}), path)
    assert read_signal(path, unit="g").sample_rate == pytest.approx(2000.0)
    assert read_signal(path, unit="g", time_column="clock", signal_column="a").sample_rate == 1000.0


def test_a_null_among_timestamps_is_named_by_its_row(tmp_path, values):
    path = tmp_path / "a.parquet"
    for place in (0, 7):
        times = [None if k == place else k for k in range(500)]
        pq.write_table(pa.table({"a [g]": values, "clock": pa.array(times, pa.timestamp("ms"))}), path)
        assert f"row {place}, column 'clock': nan where a finite number must be" in refusal(path)
