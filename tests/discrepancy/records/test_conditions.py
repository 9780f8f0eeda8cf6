"""What was known of each file: from CSV, YAML or the command line, and each mistake in one sentence."""

import math
from pathlib import Path

import pytest

from discrepancy.records.conditions import Conditions, conditions_of, grouped, table_beside
from indexer_env.errors import ParameterError, SignalError

NAMES = ("a.csv", "b/c.csv")


def table(folder: Path, text: str, name: str = "records.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_csv_and_yaml_say_the_same(tmp_path: Path) -> None:
    csv = "file;motor_speed_rpm;load_torque;start_angle_deg;held_out;unit\n"
    csv += "a.csv;1500;2,0;90;no;\nc.csv;1,2e3;3;;yes;m/s^2\n"
    yaml = (
        "a.csv: {motor_speed_rpm: 1500, load_torque: 2, start_angle_deg: 90}\n"
        "b/c.csv: {motor_speed_rpm: 1200, load_torque: 3, held_out: true, unit: m/s^2}\n"
    )
    found = conditions_of(NAMES, table(tmp_path, csv), {})
    assert found == conditions_of(NAMES, table(tmp_path, yaml, "records.yaml"), {})
    listed = "- {file: a.csv, motor_speed_rpm: 1500, load_torque: 2, start_angle_deg: 90}\n"
    listed += "- {file: c.csv, motor_speed_rpm: 1200, load_torque: 3, held_out: true, unit: m/s^2}\n"
    assert found == conditions_of(NAMES, table(tmp_path, listed, "list.yaml"), {})
    assert found["a.csv"] == Conditions(1500.0 * 2.0 * math.pi / 60.0, 2.0, start_angle=math.pi / 2.0)
    assert found["b/c.csv"].held_out and found["b/c.csv"].unit == "m/s^2"


def test_a_cell_goes_before_what_is_known_of_all_files(tmp_path: Path) -> None:
    path = table(tmp_path, "file,motor_speed\na.csv,100\nc.csv,\n")
    found = conditions_of(NAMES, path, {"motor_speed_rpm": 1500, "load_torque": 2.0, "noise": None})
    assert found["a.csv"].motor_speed == 100.0
    assert found["b/c.csv"].motor_speed == pytest.approx(157.0796)
    assert conditions_of(["x"], None, {"motor_speed": 1.0, "load_torque": 0.0})["x"].noise is None


@pytest.mark.parametrize(("speed", "load", "name"), [(None, 2.0, "motor_speed"), (157.0, None, "load_torque")])
def test_speed_and_load_are_needed_here(speed, load, name: str) -> None:
    with pytest.raises(ParameterError, match=rf"Conditions\.{name} must be a finite number .* got None"):
        Conditions(speed, load)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file,motor_speed_rpm,load_torque\na.csv,1500,2\n", r"must have one row for b/c\.csv, got none"),
        ("file,motor_speed_rpm\na.csv,fast\nc.csv,1\n", r"line 2: motor_speed_rpm must be a number, got 'fast'"),
        ("file,motor_speed_rpm\na.csv,1500\nc.csv,1500\n", r"a\.csv lacks load_torque"),
        (
            "file,moter_speed,load_torque\na.csv,1,2\nc.csv,1,2\n",
            r"column 'moter_speed' is not known; did you mean 'motor_speed_rpm', or 'motor_speed' in rad/s",
        ),
        ("file,Speed,load_torque\na.csv,1500,2\nc.csv,1500,2\n", r"column 'Speed' is not known; .* 'motor_speed_rpm'"),
        (
            "file,motion\na.csv,there\nc.csv,back\n",
            r"records\.csv: column 'motion' is not known; known are motor_speed",
        ),
        ("file,motor_speed,load_torque,held_out\na.csv,1,2,perhaps\nc.csv,1,2,no\n", r"held_out must be yes or no"),
        ("file,motor_speed,load_torque\na.csv,-1,2\nc.csv,1,2\n", r"a\.csv\.motor_speed must be .* > 0 rad/s, got -1"),
        ("file,motor_speed_rpm,load_torque\na.csv,-9,2\nc.csv,1,2\n", r"a\.csv\.motor_speed_rpm must .* 0 rpm, got -9"),
        (
            "file,motor_speed,load_torque,speed_uncertainty\na.csv,1,2,2\nc.csv,1,2,\n",
            r"a\.csv\.speed_uncertainty must be .* > 0 and <= 0\.1, got 2",
        ),
        ("file,motor_speed_hz,load_torque\na.csv,25,2\nc.csv,1,2\n", r"'motor_speed', .* SI units, .* _rpm for"),
        (
            "file,motor_speed,load_torque,machine\na.csv,1,2,M1\nc.csv,1,2,M2\n",
            r"machine must be the same .* got M1, M2;",
        ),
        ("motor_speed\n1\n", r"table of records .* must have one column 'file'"),
        ("file,motor_speed\na.csv,1\na.csv,2\n", r"line 3: a file must have one row, got a second for a\.csv"),
    ],
)
def test_a_mistake_is_one_sentence(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(SignalError, match=said) as caught:
        conditions_of(NAMES, table(tmp_path, text), {})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("- {file: [a.csv], load_torque: 2}\n", r"a mapping of its conditions by name, got .* for \['a\.csv'\]"),
        ("a.csv: {on: 3}\n", r"got \{True: 3\} for 'a\.csv'; put names that YAML takes for something else in quotes"),
        ("- {file: a.csv, load_torque: 2}\n- {file: ./a.csv, load_torque: 20}\n", r"got a second for a\.csv; keep one"),
        (
            "a.csv: {motor_sped_rpm: 1500, load_torque: 2}\n",
            r"a\.csv: key 'motor_sped_rpm' .* did you mean 'motor_speed_rpm'",
        ),
        ("a.csv: {motor_speed_rpm: 1500, load_torque: 2, unit: 5}\n", r"a\.csv\.unit must be a text or null, got 5"),
        ("a.csv: {motor_speed_rpm: 1500, load_torque: 2, scale: 5}\n", r"a\.csv\.unit must be one of .* where a scale"),
    ],
)
def test_a_mistake_in_yaml_is_one_sentence(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(SignalError, match=said) as caught:
        conditions_of(["a.csv"], table(tmp_path, text, "records.yaml"), {})
    assert "\n" not in str(caught.value)


def test_yaml_takes_numbers_as_people_write_them(tmp_path: Path) -> None:
    path = table(tmp_path, "./a.csv: {motor_speed: 1.5e2, load_torque: 2}\n", "records.yaml")
    assert conditions_of(["a.csv"], path, {})["a.csv"].motor_speed == 150.0


def test_a_row_is_that_of_one_file(tmp_path: Path) -> None:
    rows = table(tmp_path, "file,motor_speed_rpm,load_torque\nrun.csv,1500,20\n")
    assert conditions_of(["day1/run.csv"], rows, {})["day1/run.csv"].load_torque == 20.0
    said = r"a row for each file, got run\.csv for day1/run\.csv and day2/run\.csv; name them by their folders"
    with pytest.raises(SignalError, match=said):
        conditions_of(["day1/run.csv", "day2/run.csv"], rows, {})


def test_a_table_in_the_folder_above_is_found(tmp_path: Path) -> None:
    (tmp_path / "day").mkdir()
    measured = table(tmp_path / "day", "0\n", "a.csv")
    assert table_beside([measured], tmp_path) is None
    above = table(tmp_path, "a.csv: {}\n", "records.yaml")
    assert table_beside([measured], tmp_path) == above
    (tmp_path / "day" / "run").mkdir()
    below = [tmp_path / "day" / "run" / "a.csv"]
    assert table_beside(below, tmp_path) == above
    beside = table(tmp_path / "day", "a.csv: {}\n", "records.yaml")
    assert table_beside([measured], tmp_path) == table_beside(below, tmp_path) == beside
    table(tmp_path / "day", "file\n", "records.csv")
    with pytest.raises(ParameterError, match=r"one table in a folder, .*records\.csv and .*records\.yaml'; keep one"):
        table_beside([measured], tmp_path)


def test_nothing_in_yaml_is_an_empty_cell(tmp_path: Path) -> None:
    path = table(tmp_path, "a.csv: {motor_speed_rpm: 1500, load_torque: null}\nb/c.csv: {}\n", "records.yaml")
    found = conditions_of(NAMES, path, {"motor_speed_rpm": 1200, "load_torque": 2.0})
    assert [one.load_torque for one in found.values()] == [2.0, 2.0] and found["a.csv"].motor_speed > 150.0


def test_yaml_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SignalError, match="must hold, for each file, a mapping"):
        conditions_of(NAMES, table(tmp_path, "- a.csv\n", "records.yaml"), {})
    with pytest.raises(SignalError, match="cannot be read"):
        conditions_of(NAMES, table(tmp_path, "{", "records.yaml"), {})


@pytest.mark.parametrize(
    ("values", "number", "middles"),
    [
        ([1500.6, 1200.0, 1499.4], [1, 0, 1], [1200.0, 1500.0]),
        ([100.0, 100.8, 101.6], [0, 0, 1], [100.4, 101.6]),
        ([-20.0, 0.0, 0.1, -20.1], [0, 1, 1, 0], [-20.05, 0.05]),
        ([0.0, 0.0], [0, 0], [0.0]),
    ],
)
def test_speeds_and_loads_within_a_hundredth_are_one(values: list, number: list, middles: list) -> None:
    found, means = grouped(values)
    assert found == number and means == pytest.approx(middles)
