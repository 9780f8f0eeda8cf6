"""Measured files become Signals, and every bad one is refused in one sentence that says where."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from indexer_env.errors import SignalError
from indexer_records.acceleration_units import STANDARD_GRAVITY
from indexer_records.measured import read_signal

RATE = 1000.0
COUNT = 200


@pytest.fixture
def wave() -> np.ndarray:
    return np.round(np.sin(2 * np.pi * 12.5 * np.arange(COUNT) / RATE), 6)


def write(path, values, *, header="time [s],acceleration [m/s^2]", delimiter=",", decimal=".", times=None, digits=3):
    times = np.arange(len(values)) / RATE if times is None else times
    rows = [f"{t:.{digits}f}{delimiter}{v:.6f}" for t, v in zip(times, values, strict=True)]
    lines = [header.replace(",", delimiter)] if header else []
    text = "\n".join(lines + [row.replace(".", decimal) for row in rows]) + "\n"
    path.write_text(text, encoding="utf-8")
    return path


def edit(path, line: int, text: str):
    """Replace a line (from 1)."""
    lines = path.read_text().splitlines()
    lines[line - 1] = text
    path.write_text("\n".join(lines) + "\n")
    return path


def refusal(path, **options) -> str:
    with pytest.raises(SignalError) as caught:
        read_signal(path, **options)
    text = str(caught.value)
    assert "\n" not in text and text.endswith(".")
    return text


@pytest.mark.parametrize(("delimiter", "decimal"), [(",", "."), (";", "."), ("\t", "."), (";", ","), ("\t", ",")])
def test_delimiters_and_decimal_marks(tmp_path, wave, delimiter, decimal):
    signal = read_signal(write(tmp_path / "a.csv", wave, delimiter=delimiter, decimal=decimal), unit=None)
    np.testing.assert_allclose(signal.values, wave, rtol=0, atol=1e-12)
    assert (signal.sample_rate, signal.unit) == (RATE, "m/s^2")


@pytest.mark.parametrize(
    ("written", "unit", "factor"),
    [
        ("rad/s^2", "rad/s^2", 1.0),
        ("rad/s²", "rad/s^2", 1.0),
        ("rad/s2", "rad/s^2", 1.0),
        ("rad/s**2", "rad/s^2", 1.0),
        ("m/s2", "m/s^2", 1.0),
        ("m/s/s", "m/s^2", 1.0),
        ("mm/s^2", "m/s^2", 1e-3),
        ("g", "m/s^2", STANDARD_GRAVITY),
        ("deg/s^2", "rad/s^2", np.pi / 180),
    ],
)
@pytest.mark.parametrize("brackets", ["[]", "()"])
def test_header_units(tmp_path, wave, written, unit, factor, brackets):
    header = f"Time (s),acc {brackets[0]}{written}{brackets[1]}"
    signal = read_signal(write(tmp_path / "a.csv", wave, header=header))
    assert signal.unit == unit
    np.testing.assert_allclose(signal.values, wave * factor, rtol=1e-12)


def test_time_in_milliseconds_with_preamble_units_row_bom_and_windows_ends(tmp_path, wave):
    rows = [f"{k};{v:.6f};ok" for k, v in enumerate(wave)]
    text = "\r\n".join(["Logger 7", "Date;2026-11-02", "", "Time;Acceleration;Note", "ms;m/s²;", *rows, ""])
    path = tmp_path / "logger.txt"
    path.write_bytes(text.encode("utf-8-sig"))
    signal = read_signal(path)
    assert signal.sample_rate == RATE
    np.testing.assert_allclose(signal.values, wave, atol=1e-12)
    path.write_bytes(text.encode("cp1252"))
    assert read_signal(path).unit == "m/s^2"
    path.write_bytes(text.encode("utf-16"))
    assert read_signal(path).unit == "m/s^2"


def test_printed_digits_of_time_do_not_blur_the_rate(tmp_path, wave):
    times = np.arange(COUNT) / 1024.0
    assert read_signal(write(tmp_path / "a.csv", wave, times=times, digits=4)).sample_rate == 1024.0


def test_no_header_takes_time_first_and_needs_the_unit(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave, header="")
    assert read_signal(path, unit="g").values[1] == pytest.approx(wave[1] * STANDARD_GRAVITY)
    assert "no unit" in refusal(path)


def test_no_time_column_needs_the_rate(tmp_path, wave):
    path = tmp_path / "a.csv"
    path.write_text("acceleration [g]\n" + "\n".join(f"{v:.6f}" for v in wave))
    assert read_signal(path, sample_rate=500.0).sample_rate == 500.0
    assert "no time column" in refusal(path)


def test_parquet_units_from_metadata_or_name(tmp_path, wave):
    path = tmp_path / "a.parquet"
    fields = [pa.field("time [s]", pa.float64()), pa.field("a", pa.float32(), metadata={b"unit": b"rad/s^2"})]
    arrays = [pa.array(np.arange(COUNT) / RATE), pa.array(wave.astype(np.float32))]
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), path)
    signal = read_signal(path, expected_rate=1000.0)
    assert (signal.unit, signal.sample_rate) == ("rad/s^2", RATE)
    np.testing.assert_array_equal(signal.values, wave.astype(np.float32).astype(np.float64))


def test_parquet_null_and_nan_are_named_by_row(tmp_path, wave):
    path = tmp_path / "a.parquet"
    for bad in (None, float("nan")):
        cells = [*wave[:5].tolist(), bad, *wave[6:].tolist()]
        pq.write_table(pa.table({"time [s]": np.arange(COUNT) / RATE, "acc [g]": cells}), path)
        assert "row 5" in refusal(path)


def test_missing_folder_empty_binary(tmp_path):
    assert "does not exist" in refusal(tmp_path / "none.csv")
    assert "is a folder" in refusal(tmp_path)
    path = tmp_path / "a.csv"
    for content in (b"", b" \n\n"):
        path.write_bytes(content)
        assert "is empty" in refusal(path)
    path.write_bytes(b"PK\x03\x04\0\0\0\0")
    assert "binary" in refusal(path)
    path.write_bytes(b"PAR1 and no more")
    assert "damaged Parquet" in refusal(path)
    path.write_bytes(b"\xff\xfe\x00\xd8")
    assert "readable text" in refusal(path)


def test_no_numeric_column(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("a,b\nred,blue\n" * 30)
    assert "no numeric column" in refusal(path)
    pq.write_table(pa.table({"name": ["x", "y"]}), tmp_path / "a.parquet")
    assert "no numeric column" in refusal(tmp_path / "a.parquet")


def test_a_file_that_cannot_be_read(tmp_path, wave, monkeypatch):
    def deny(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = write(tmp_path / "a.csv", wave)
    monkeypatch.setattr(type(path), "open", deny)
    assert "cannot be read (Permission denied)" in refusal(path)


def test_comments_before_the_header(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave)
    path.write_text("# made, by hand\n# a, b\n" + path.read_text())
    assert read_signal(path).values.size == COUNT


def test_a_title_line_of_two_cells_is_no_title_of_a_line_with_units(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave)
    path.write_text("Logger,7\n" + path.read_text())
    assert read_signal(path).unit == "m/s^2"


def test_what_the_file_says_must_not_be_given_otherwise(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave)
    assert "leave read.sample_rate out" in refusal(path, sample_rate=500.0)
    assert "given once" in refusal(path, unit="g")
    assert read_signal(path, unit="m/s2").unit == "m/s^2"


def test_a_rate_that_changes_within_the_record(tmp_path, wave):
    steps = np.where(np.arange(COUNT) < COUNT // 2, 0.9, 1.1) / RATE
    assert "the rate must be one throughout" in refusal(
        write(tmp_path / "a.csv", wave, times=np.cumsum(steps), digits=6)
    )


def test_gap_in_time(tmp_path, wave):
    times = np.arange(COUNT) / RATE
    times[50:] += 0.004
    text = refusal(write(tmp_path / "a.csv", wave, times=times))
    assert "line 52" in text and "4 samples are missing" in text and "0.005 s" in text


def test_uneven_step(tmp_path, wave):
    times = np.arange(COUNT) / RATE
    times[50] += 0.0007
    assert "line 52" in refusal(write(tmp_path / "a.csv", wave, times=times, digits=6))


@pytest.mark.parametrize("time", ["0.040", "0.020"])
def test_time_that_stands_or_goes_back(tmp_path, wave, time):
    path = edit(write(tmp_path / "a.csv", wave), 43, f"{time},0.1")
    assert "line 43" in refusal(path) and "must ascend" in refusal(path)


@pytest.mark.parametrize("cell", ["nan", "NaN", "", "OVL", "1.2.3", "1e", "inf", "#DIV/0!"])
def test_cell_that_is_no_number(tmp_path, wave, cell):
    path = edit(write(tmp_path / "a.csv", wave), 17, f"0.015,{cell}")
    text = refusal(path)
    assert "line 17" in text and "'acceleration'" in text and repr(cell) in text


def test_bad_first_and_last_cells_are_found_too(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave)
    assert "line 2" in refusal(edit(path, 2, "0.000,nan"))
    path = write(tmp_path / "a.csv", wave)
    assert f"line {COUNT + 1}" in refusal(edit(path, COUNT + 1, "0.199,x"))


def test_a_quote_that_is_not_closed_swallows_no_rows(tmp_path, wave):
    path = edit(write(tmp_path / "a.csv", wave), 150, '0.148,"0.5')
    assert "close the quotation mark" in refusal(path)
    path = edit(write(tmp_path / "a.csv", wave), 150, '0.148,"0.5"')
    assert read_signal(path).values[148] == 0.5


@pytest.mark.parametrize("row", ["0.015", "0.015,1,2", ""])
def test_row_of_another_length(tmp_path, wave, row):
    text = refusal(edit(write(tmp_path / "a.csv", wave), 17, row))
    assert "line 17" in text


def test_decimal_comma_with_comma_delimiter(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave, delimiter=",", decimal=",")
    refusal(path)


def test_another_rate(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave)
    assert "1000 Hz where 2000 Hz" in refusal(path, expected_rate=2000.0)
    assert read_signal(path, expected_rate=1000.5).sample_rate == RATE


def test_a_wrong_unit_of_time(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave, times=np.arange(COUNT) * 60.0)
    assert "time step must lie between" in refusal(path)


def test_too_short(tmp_path, wave):
    path = write(tmp_path / "a.csv", wave)
    assert "0.2 s (200 samples)" in refusal(path, expected_duration=8.2)
    assert read_signal(path, expected_duration=0.2).duration == pytest.approx(0.2)
    path.write_text("time [s],acc [g]\n0.0,1.0\n")
    refusal(path)


@pytest.mark.parametrize("header", ["time [s],acceleration [m/s^2]", ""])
def test_swapped_columns(tmp_path, wave, header):
    times = np.arange(COUNT) / RATE
    path = write(tmp_path / "a.csv", times, header=header, times=wave, digits=6)
    assert "look swapped" in refusal(path, unit="g")


def test_choice_of_columns(tmp_path, wave):
    path = tmp_path / "a.csv"
    rows = [f"{k / RATE:.3f},{v:.6f},{2 * v:.6f}" for k, v in enumerate(wave)]
    path.write_text("time [s],acc x [g],acc y [g]\n" + "\n".join(rows))
    text = refusal(path)
    assert "'acc x', 'acc y'" in text
    assert read_signal(path, signal_column="acc y").values[1] == pytest.approx(2 * wave[1] * STANDARD_GRAVITY)
    assert "no numeric column 'acc z'" in refusal(path, signal_column="acc z")


def test_unknown_units(tmp_path, wave):
    assert "got 'V'" in refusal(write(tmp_path / "a.csv", wave, header="time [s],acceleration [V]"))
    assert "got 'h'" in refusal(write(tmp_path / "a.csv", wave, header="time [h],acceleration [g]"))
    assert "no acceleration column" in refusal_of_single(tmp_path)


def refusal_of_single(tmp_path) -> str:
    path = tmp_path / "single.csv"
    path.write_text("time [s]\n" + "\n".join(f"{k / RATE:.3f}" for k in range(COUNT)))
    return refusal(path)


def test_a_tab_behind_each_row_is_one_behind_the_last_too(tmp_path, wave):
    rows = [f"{k / RATE:.3f}\t{v:.6f}\t" for k, v in enumerate(wave)]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(["time [s]\tacceleration [m/s^2]\t", *rows]) + "\n\n  \n", encoding="utf-8")
    np.testing.assert_allclose(read_signal(path).values, wave, rtol=0, atol=1e-12)


@pytest.mark.parametrize("preamble", ["Serial;4711\n\n", "Serial;4711\n", "Logger;A7\n\n"])
def test_a_preamble_of_two_cells_is_no_line_of_titles(tmp_path, wave, preamble):
    path = write(tmp_path / "a.csv", wave, header="Time,Acc", delimiter=";")
    path.write_text(preamble + path.read_text())
    np.testing.assert_allclose(read_signal(path, unit="m/s^2").values, wave, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["time_ms", "Time ms", "time [ms]"])
def test_the_unit_of_time_may_stand_at_the_end_of_its_name(tmp_path, wave, name):
    path = write(tmp_path / "a.csv", wave, header=f"{name},acceleration [m/s^2]", times=np.arange(COUNT), digits=0)
    assert read_signal(path).sample_rate == RATE


@pytest.mark.parametrize(("name", "per_second"), [("time_ns", 1e9), ("time_minutes", 1 / 60), ("t [ns]", 1e9)])
def test_nanoseconds_and_minutes_are_units_of_time(tmp_path, wave, name, per_second):
    times, header = np.arange(COUNT) / RATE * per_second, f"{name},acceleration [m/s^2]"
    signal = read_signal(write(tmp_path / "a.csv", wave, header=header, times=times, digits=9))
    assert signal.sample_rate == pytest.approx(RATE)


@pytest.mark.parametrize("unit", ["h", "hours", "days", "d"])
def test_a_name_that_ends_in_another_unit_of_time_is_not_taken_for_seconds(tmp_path, wave, unit):
    times = np.arange(COUNT) / RATE
    path = write(tmp_path / "a.csv", wave, header=f"time_{unit},acceleration [m/s^2]", times=times)
    assert f"one of s, ms, us, ns, min, got {unit!r}" in refusal(path)


@pytest.mark.parametrize("times", [np.arange(COUNT) / RATE / 3600, np.arange(COUNT) / 51.2e3 / 60])
def test_hours_without_a_unit_are_not_taken_for_seconds(tmp_path, wave, times):
    path = write(tmp_path / "a.csv", wave, header="time,acceleration [m/s^2]", times=times, digits=12)
    assert "must lie between 1e-06 and 0.1 s" in refusal(path) and "as in 'time [ms]'" in refusal(path)


@pytest.mark.parametrize("name", ["timestamp", "t"])
def test_milliseconds_without_a_unit_are_not_taken_for_seconds(tmp_path, wave, name):
    path = write(tmp_path / "a.csv", wave, header=f"{name},acceleration [m/s^2]", times=np.arange(COUNT), digits=0)
    assert f"got 1; write its unit into the header, as in '{name} [ms]'" in refusal(path)
