"""How CSV files write their numbers and titles, and rounded times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from indexer_env.errors import SignalError
from indexer_records.measured import read_signal

COUNT = 3000
WAVE = np.round(np.sin(0.1 * np.arange(COUNT)), 4)


def refusal(path: Path, **options: object) -> str:
    with pytest.raises(SignalError) as caught:
        read_signal(path, **options)  # type: ignore[arg-type]
    text = str(caught.value)
    assert "\n" not in text and text.endswith(".")
    return text


def timed(path: Path, times: np.ndarray, digits: int) -> Path:
    rows = [f"{time:.{digits}f},{value}" for time, value in zip(times, WAVE, strict=False)]
    path.write_text("\n".join(["time [s],acc [m/s^2]", *rows]))
    return path


MISSED = [
    (1000.0, 3),
    (100.0, 2),
    (10000.0, 4),
    (625.0, 3),
    (400.0, 3),
    (700.0, 3),
    (800.0, 3),
    (900.0, 3),
    (6400.0, 4),
]


@pytest.mark.parametrize(("rate", "digits"), MISSED)
def test_one_missing_sample_is_found_in_times_of_few_digits(tmp_path, rate, digits):
    """Also where the last digit is a whole sampling step."""
    for missing in range(20, COUNT, COUNT // 20):
        times = np.delete(np.arange(COUNT) / rate, missing)
        said = refusal(timed(tmp_path / "a.csv", times, digits))
        assert "a gap, " in said and "missing" in said
        assert said.endswith("or raise the digits of the time column.") == (rate * 10.0**-digits > 0.5)


@pytest.mark.parametrize(("rate", "digits"), [(900.0, 3), (700.0, 3), (600.0, 3), (1024.0, 4), (333.0, 3)])
def test_steps_that_rounding_makes_unequal_are_no_gaps(tmp_path, rate, digits):
    path = timed(tmp_path / "a.csv", np.arange(COUNT) / rate, digits)
    assert read_signal(path).sample_rate == pytest.approx(rate, rel=1e-3)


@pytest.mark.parametrize(("rate", "jitter"), [(700.0, 0.1), (800.0, 0.1), (900.0, 0.04)])
def test_clocks_that_drift_and_jitter_have_no_gaps(tmp_path, rate, jitter):
    """By more than a sampling step over the record and a share of one from sample to sample; rounded or cut off."""
    place = np.arange(COUNT)
    drift = 1.5 * (2.0 * place / COUNT - 1.0) ** 2 + jitter * np.random.default_rng(0).uniform(-1.0, 1.0, COUNT)
    times = (place + drift) / rate
    for cut in (times, times - 0.4999e-3):
        assert read_signal(timed(tmp_path / "a.csv", cut, 3)).sample_rate == pytest.approx(rate, rel=1e-3)


def test_two_steps_of_which_none_is_usual_are_uneven(tmp_path):
    assert "an uneven step" in refusal(timed(tmp_path / "a.csv", np.array([0.0, 0.001, 0.05]), 3))


def test_a_comma_between_thousands_is_no_decimal_mark(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s];acc [m/s^2]\n" + "".join(f"{k / 1000:.3f};{1000 + k:,}\n" for k in range(200)))
    said = refusal(path)
    assert "must have one decimal mark, got '0.000' and '1,000'; export it without marks between thousands" in said


def test_a_comma_between_thousands_of_whole_numbers_is_no_decimal_mark(tmp_path):
    """Small values would stay and large ones be a thousandth."""
    path = tmp_path / "a.csv"
    counts = (12345, -567, 8901, 45, -2300, 999)
    path.write_text("time [ms];acc [mm/s^2]\n" + "".join(f"{k};{counts[k % 6]:,}\n" for k in range(200)))
    said = refusal(path)
    assert "no marks between thousands, got '12,345' and '-567' in one column; export it without marks" in said
    rows = "".join(f"{k};{counts[k % 6] / 1000:.3f}\n".replace(".", ",") for k in range(200))
    path.write_text("time [ms];acc [m/s^2]\n" + rows)
    assert read_signal(path).values[1] == -0.567


def test_a_delimiter_at_the_end_of_each_row_is_no_column(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s]\tacc [m/s^2]\n" + "".join(f"{k / 1000:.3f}\t{v}\t\n" for k, v in enumerate(WAVE)))
    signal = read_signal(path)
    assert signal.unit == "m/s^2"
    np.testing.assert_array_equal(signal.values, WAVE)


def test_points_that_are_no_decimal_marks_stand_beside_commas(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{k / 1000:.3f};{k}.5".replace(".", ",") + ";01.02.2026;12.30;1.234,5" for k in range(200)]
    path.write_text("\n".join(["Zeit [s];acc [m/s^2];Datum;Uhr;Zähler", *rows]), encoding="utf-8")
    np.testing.assert_array_equal(read_signal(path).values, np.arange(200) + 0.5)


def test_the_commented_header_of_savetxt_is_one(tmp_path):
    path = tmp_path / "a.csv"
    table = np.column_stack([np.arange(200) * 0.05, WAVE[:200]])
    np.savetxt(path, table, header="made by hand\ntime [ms],acc [m/s^2]", delimiter=",", fmt="%.4f")
    signal = read_signal(path)
    assert (signal.sample_rate, signal.unit) == (20000.0, "m/s^2")
    np.testing.assert_array_equal(signal.values, WAVE[:200])


@pytest.mark.parametrize("comment", ["made, by hand", "serial 7 (A), gain (dB), 5", "time [ms]"])
def test_a_comment_is_no_header(tmp_path, comment):
    path = tmp_path / "a.csv"
    path.write_text(f"# {comment}\n" + "".join(f"{k / 1000:.3f},{value}\n" for k, value in enumerate(WAVE)))
    assert read_signal(path, unit="m/s^2").sample_rate == 1000.0
