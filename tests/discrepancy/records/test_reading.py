"""Files and their table become records, however they are named."""

from pathlib import Path

import numpy as np
import pytest

from discrepancy.records.reading import Record, read_records
from indexer_env.errors import ParameterError, SignalError
from indexer_records.conditions import Pulse

KNOWN = {"motor_speed_rpm": 1500.0, "load_torque": 2.0}


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Two records of 2 s at 100 Hz, the pulse high from 0.5 s and from 1.5 s on for 0.1 s; and a table."""
    time = np.arange(200) / 100.0
    pulse = ((time % 1.0 >= 0.5) & (time % 1.0 < 0.6)).astype(float)
    for name, phase in (("a.csv", 0.0), ("b.csv", 1.0)):
        columns = np.column_stack([time, np.sin(9.0 * time + phase), pulse])
        header = "time [s],acc [rad/s^2],pulse"
        np.savetxt(tmp_path / name, columns, delimiter=",", header=header, comments="", fmt="%.6f")
    (tmp_path / "records.csv").write_text("file,motor_speed_rpm,load_torque\na.csv,1500,2\nb.csv,1200,5\n")
    return tmp_path


def loads(records: list[Record]) -> dict[str, float]:
    return {record.name: record.conditions.load_torque for record in records}


def test_a_folder_a_pattern_and_a_list_name_the_same(bench: Path) -> None:
    named = str(bench), f"{bench}/*.csv", [f"{bench}/b.csv", f"{bench}/a.csv"]
    found = [loads(read_records(measured, None, {}, Pulse(), [])) for measured in named]
    assert found == [{"a.csv": 2.0, "b.csv": 5.0}] * 3


def test_without_a_table_what_is_known_holds_for_all(bench: Path) -> None:
    (bench / "records.csv").unlink()
    assert loads(read_records(str(bench), None, KNOWN, Pulse(), [])) == {"a.csv": 2.0, "b.csv": 2.0}
    with pytest.raises(SignalError, match=r"a\.csv lacks motor_speed, load_torque"):
        read_records(str(bench), None, {}, Pulse(), [])


def test_pulses_are_read_with_the_record(bench: Path) -> None:
    records = read_records(str(bench), None, {}, Pulse(column="pulse"), [])
    for record in records:
        assert record.pulses == pytest.approx([0.495, 1.495])
    assert read_records(str(bench), None, {}, Pulse(), [])[0].pulses is None


def test_an_angle_of_no_pulse_is_refused(bench: Path) -> None:
    with pytest.raises(SignalError, match=r"^a\.csv: pulse_angle must be left out where no .* got 0\.5 rad; name"):
        read_records(str(bench), None, {"pulse_angle": 0.5}, Pulse(), [])
    assert read_records(str(bench), None, {"pulse_angle": 0.5}, Pulse(column="pulse"), [])


@pytest.mark.parametrize("heading", ["time [s],acc [rad/s^2],pulse", "t [s],acc [rad/s^2],index"])
def test_a_copy_is_no_new_evidence(bench: Path, heading: str) -> None:
    """The same samples in another file, its own row and headings notwithstanding."""
    text = (bench / "a.csv").read_text().partition("\n")[2]
    (bench / "c.csv").write_text(f"{heading}\n{text}")
    (bench / "records.csv").write_text((bench / "records.csv").read_text() + "c.csv,1500,2\n")
    with pytest.raises(SignalError, match=r"c\.csv must differ .* same samples as a\.csv; remove the copy and its row"):
        read_records(str(bench), None, {}, Pulse(), [])
    assert len(read_records([f"{bench}/c.csv", f"{bench}/b.csv"], None, {}, Pulse(), [])) == 2


def test_files_to_hold_out_are_named(bench: Path) -> None:
    records = read_records(str(bench), None, {}, Pulse(), ["b.csv"])
    assert [record.conditions.held_out for record in records] == [False, True]
    with pytest.raises(ParameterError, match=r"held_out must be files among a\.csv, b\.csv, got 'c\.csv'"):
        read_records(str(bench), None, {}, Pulse(), ["c.csv"])


def test_noise_is_in_the_numbers_of_the_file(bench: Path) -> None:
    """Two files in g, one of them in volts of an amplifier that is mounted the wrong way round."""
    for name in ("a.csv", "b.csv"):
        text = (bench / name).read_text().replace("[rad/s^2]", "")
        (bench / name).write_text(text)
    (bench / "records.csv").write_text(
        "file,motor_speed_rpm,load_torque,unit,scale,noise\na.csv,1500,2,g,,0.1\nb.csv,1200,5,g,-2,0.1\n"
    )
    found = {record.name: record.conditions.noise for record in read_records(str(bench), None, {}, Pulse(), [])}
    assert found == {"a.csv": pytest.approx(0.980665), "b.csv": pytest.approx(2.0 * 0.980665)}


def test_files_of_one_name_are_told_apart_by_their_folders(bench: Path) -> None:
    (bench / "day").mkdir()
    (bench / "day" / "a.csv").write_text((bench / "a.csv").read_text().replace("\n0.000000,0.0", "\n0.000000,0.1"))
    rows = "file,motor_speed_rpm,load_torque\na.csv,1500,2\nb.csv,1200,5\n"
    (bench / "records.csv").write_text(rows + "day/a.csv,1500,40\n")
    files = [str(bench / name) for name in ("a.csv", "b.csv", "day/a.csv")]
    assert loads(read_records(files, None, {}, Pulse(), [])) == {"a.csv": 2.0, "b.csv": 5.0, "day/a.csv": 40.0}
    for wanted, kept in (("day/a.csv", ["day/a.csv"]), ("a.csv", ["a.csv"])):
        records = read_records(files, None, {}, Pulse(), [wanted])
        assert [record.name for record in records if record.conditions.held_out] == kept


def test_two_tables_are_not_guessed_from(bench: Path) -> None:
    (bench / "day").mkdir()
    (bench / "day" / "a.csv").write_text((bench / "a.csv").read_text())
    (bench / "day" / "records.csv").write_text("file,motor_speed_rpm,load_torque\na.csv,1500,40\n")
    files = [str(bench / name) for name in ("a.csv", "day/a.csv")]
    with pytest.raises(ParameterError, match=r"records must be one table for all files.*put their rows into one"):
        read_records(files, None, {}, Pulse(), [])
