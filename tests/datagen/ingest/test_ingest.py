"""Measured files of every format become one data set, and what is refused is a row with its reason."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from datagen.check import check
from datagen.ingest.publish import ingest
from datagen.ingest.settings import Settings
from datagen.ingest.sources import sources_of
from datagen.shard import iterate_shards, read_shards
from datagen.store import REJECTED, StoreError
from indexer_env.errors import ParameterError, SignalError
from indexer_env.units import RPM
from indexer_records.conditions import Pulse, RecordConditions
from indexer_records.measured import Reading
from tests.indexer_records.formats.samples import OPTIONS, PULSE, WRITERS, written

RATE, PERIOD = 2000.0, 0.5
SETTINGS = Settings(
    sample_rate=1000.0,
    period=PERIOD,
    pulse=Pulse(column="pulse"),
    read=Reading(signal_column="acc"),
    known=RecordConditions(load_torque=2.0),
)
STATED = ("csv", "parquet", "hdf5", "tdms", "uff", "uff_binary")
"""Formats whose files say their unit."""

EMPS = Path(__file__).parents[4] / "shared" / "data" / "emps" / "DATA_EMPS.mat"


def measurement(
    seed: int, turns: int = 4, tone: float = 30.0, missed: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """A tone locked to the turn and noise; pulses about every half second, one of them left out where asked."""
    rng = np.random.default_rng(seed)
    begins = 0.2 + np.concatenate(([0.0], np.cumsum(PERIOD * (1.0 + 0.004 * rng.normal(size=turns)))))
    times = np.arange(round((begins[-1] + 0.3) * RATE)) / RATE
    angle = np.interp(times, begins, np.arange(turns + 1))
    pulse = np.zeros_like(times)
    for number, begin in enumerate(begins):
        if number != missed:
            pulse[(times >= begin) & (times < begin + 0.02)] = 5.0
    return np.sin(2.0 * np.pi * tone * PERIOD * angle) + 1e-3 * rng.normal(size=times.size), pulse


def bench(folder: Path, kinds: tuple[str, ...] = STATED, **changes: int) -> Path:
    for number, kind in enumerate(kinds):
        for place, name in enumerate(("healthy", "worn")):
            (folder / name / kind).mkdir(parents=True, exist_ok=True)
            values, pulse = measurement(2 * number + place, tone=30.0 + 40.0 * place, **changes)
            path = written(kind, folder / name / kind, values, pulse, RATE)
            path.rename(folder / name / f"{kind}{path.suffix}")
            (folder / name / kind).rmdir()
    return folder


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("ingest")
    ingest(sources_of(str(bench(folder / "files")), None), SETTINGS, folder / "set")
    return folder / "set"


def test_a_files_own_conditions_win_over_those_of_all(tmp_path) -> None:
    """A speed in the table of labels, in rpm, beside a load that all files share."""
    files = bench(tmp_path / "files", ("csv",))
    table = files / "labels.csv"
    table.write_text("file,class,motor_speed_rpm\nhealthy/csv.csv,healthy,1500\nworn/csv.csv,worn,\n", encoding="utf-8")
    settings = replace(SETTINGS, known=RecordConditions(load_torque=2.0, motor_speed=1200.0 * RPM))
    ingest(sources_of(str(files), table), settings, tmp_path / "set")
    rows = [row for shard in iterate_shards(tmp_path / "set") for row in shard.to_pylist()]
    speeds = {row["source"]: round(row["motor_speed"] / RPM) for row in rows}
    assert speeds == {"healthy/csv.csv": 1500, "worn/csv.csv": 1200}
    assert {row["load_torque"] for row in rows} == {2.0}


def test_a_file_of_another_speed_is_not_cut_by_that_of_all(tmp_path) -> None:
    files = bench(tmp_path / "files", ("csv",))
    table = files / "labels.csv"
    table.write_text("file,class,motor_speed_rpm\nhealthy/csv.csv,healthy,1200\nworn/csv.csv,worn,\n", encoding="utf-8")
    known = RecordConditions(motor_speed=1500.0 * RPM)
    settings = replace(SETTINGS, period=None, motor_turns=12.5, pulse=Pulse(), known=known)
    ingest(sources_of(str(files), table), settings, tmp_path / "set")
    (row,) = rejected(tmp_path / "set")
    assert (
        "must be of 1500 rpm (known.motor_speed_rpm), by which turns are cut, got 1200 rpm in the labels"
        in row["reason"]
    )


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def rejected(folder: Path) -> list[dict]:
    return pq.read_table(folder / REJECTED).to_pylist()


def test_every_whole_turn_of_every_format_is_a_row(dataset):
    data = read_shards(dataset)
    assert data.records.shape == (len(STATED) * 2 * 4, 500)
    assert data.manifest["partial_turns"] == len(STATED) * 2 * 2
    assert data.manifest["classes"] == {"healthy": 24, "worn": 24}
    assert rejected(dataset) == []
    row = data.row(0)
    assert (row["kind"], row["source"], row["source_channel"], row["source_rate"]) == (
        "measured", "healthy/csv.csv", "acc", RATE,
    )  # fmt: skip
    assert (row["sample_rate"], row["unit"], row["load_torque"], row["motor_speed"]) == (1000.0, "m/s^2", 2.0, None)
    assert row["source_start"] == pytest.approx(0.2, abs=1e-3)
    assert row["source_duration"] == pytest.approx(PERIOD, rel=0.02)


def test_records_lie_at_the_same_angle_whatever_the_speed(dataset):
    """The tone is locked to the turn, so every record of a class is the same sine but for noise and the pulse's edge,
    found to half a sample of 2 kHz."""
    data = read_shards(dataset)
    for name, tone in (("healthy", 30.0), ("worn", 70.0)):
        chosen = data.records[[value == name for value in data.table.column("class_name").to_pylist()]]
        wanted = np.sin(2.0 * np.pi * tone * PERIOD * np.arange(500) / 500)
        assert np.abs(chosen - wanted).max() < 2.0 * np.pi * tone / RATE * 1.1 + 0.01


def test_the_same_files_give_the_same_bytes_wherever_they_lie(dataset, tmp_path):
    moved = shutil.copytree(dataset.parent / "files", tmp_path / "moved")
    ingest(sources_of(str(moved), None), SETTINGS, tmp_path / "again")
    assert contents(tmp_path / "again") == contents(dataset)


def test_shards_and_items_go_on_across_files(dataset, tmp_path):
    ingest(sources_of(str(dataset.parent / "files"), None), replace(SETTINGS, shard_items=7), tmp_path / "set")
    small, large = read_shards(tmp_path / "set"), read_shards(dataset)
    assert len(small.manifest["shards"]) == 7
    np.testing.assert_array_equal(small.records, large.records)
    assert small.table.column("item").to_pylist() == list(range(48))


def test_a_missed_pulse_costs_its_turn_only(tmp_path):
    bench(tmp_path / "files", ("csv",), missed=2)
    manifest = ingest(sources_of(str(tmp_path / "files"), None), SETTINGS, tmp_path / "set")
    assert (manifest["records"], manifest["rejected"]) == (4, 2)
    row = rejected(tmp_path / "set")[0]
    assert (
        row["stage"] == "turn" and "1 pulse was missed" in row["reason"] and row["reason"].startswith("healthy/csv.csv")
    )
    assert json.loads(row["draws"])["source_start"] == pytest.approx(0.7, abs=0.01)


def test_a_bad_file_is_a_row_with_its_reason(dataset, tmp_path):
    files = shutil.copytree(dataset.parent / "files", tmp_path / "files")
    damaged = files / "worn" / "tdms.tdms"
    damaged.write_bytes(damaged.read_bytes()[:-100])
    text = (files / "worn" / "csv.csv").read_text().splitlines()
    text[40] = text[40].rpartition(",")[0].rpartition(",")[0] + ",nan,0"
    (files / "worn" / "csv.csv").write_text("\n".join(text))
    shutil.copy(files / "healthy" / "hdf5.h5", files / "worn" / "copy.h5")
    manifest = ingest(sources_of(str(files), None), SETTINGS, tmp_path / "set")
    reasons = {json.loads(row["draws"])["source"]: row["reason"] for row in rejected(tmp_path / "set")}
    assert manifest["rejected"] == 3 and manifest["records"] == 40
    assert "damaged TDMS" in reasons["worn/tdms.tdms"]
    assert "line 41, column 'acc': no value ('nan')" in reasons["worn/csv.csv"]
    assert "the same bytes as healthy/hdf5.h5" in reasons["worn/copy.h5"]
    assert not any(str(tmp_path) in reason for reason in reasons.values())


def test_dead_turns_are_rejected_and_clipped_ones_marked(tmp_path):
    """Quality is that of the file's own samples: after the filter no flat top is flat."""
    (tmp_path / "files").mkdir()
    values, pulse = measurement(0)
    values = np.clip(values, -0.5, 0.5)
    values[round(0.6 * RATE) : round(1.3 * RATE)] = 0.25
    written("csv", tmp_path / "files", values, pulse, RATE)
    ingest(sources_of(str(tmp_path / "files"), None), SETTINGS, tmp_path / "set")
    (row,) = rejected(tmp_path / "set")
    assert row["item"] == 1 and "must vary, got one value throughout" in row["reason"]
    table = read_shards(tmp_path / "set").table
    assert table.column("item").to_pylist() == [0, 2, 3]
    assert min(table.column("clipped_share").to_pylist()) > 0.3
    assert table.column("constant_share").to_pylist()[0] == pytest.approx(0.2, abs=0.03)


def test_turns_by_the_period_come_through_bit_for_bit(tmp_path):
    (tmp_path / "files").mkdir()
    values, pulse = measurement(0, turns=5)
    written("parquet", tmp_path / "files", values, pulse, RATE)
    settings = Settings(sample_rate=RATE, period=PERIOD, read=Reading(signal_column="acc"))
    ingest(sources_of(str(tmp_path / "files"), None), settings, tmp_path / "set")
    records = read_shards(tmp_path / "set").records
    np.testing.assert_array_equal(records.ravel(), values[: records.size].astype(np.float32))


def test_nothing_good_leaves_nothing(tmp_path):
    bench(tmp_path / "files", ("csv",))
    settings = Settings(period=3.0, pulse=Pulse(column="pulse"), read=Reading(signal_column="acc"))
    with pytest.raises(SignalError, match=r"got none in 2; the first: healthy/csv\.csv: the turn"):
        ingest(sources_of(str(tmp_path / "files"), None), settings, tmp_path / "set")
    assert not (tmp_path / "set").exists()


def test_a_folder_is_not_read_and_replaced_at_once(dataset):
    with pytest.raises(ParameterError, match=r"out must be a folder without measured files.*shard-00000\.parquet lies"):
        ingest(sources_of(f"{dataset}/data/*.parquet", None), SETTINGS, dataset, overwrite=True)
    assert (dataset / REJECTED).exists()


def test_a_folder_that_holds_something_is_refused(dataset):
    with pytest.raises(StoreError, match="overwrite=true"):
        ingest(sources_of(str(dataset.parent / "files"), None), SETTINGS, dataset)


@pytest.mark.parametrize("kind", sorted(set(WRITERS) - set(STATED)))
def test_formats_without_a_unit_take_it_from_the_command(kind, tmp_path):
    bench(tmp_path / "files", (kind,))
    settings = Settings(
        period=PERIOD, pulse=Pulse(column=PULSE.get(kind, "pulse")), read=Reading(**OPTIONS[kind])  # type: ignore[arg-type]
    )  # fmt: skip
    assert ingest(sources_of(str(tmp_path / "files"), None), settings, tmp_path / "set")["records"] == 8


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"pulse": Pulse(column="pulse")}, "period must be the duration of one turn"),
        ({"motor_turns": 205.0}, "motor_turns must be given with known.motor_speed_rpm"),
        ({"period": 0.0}, "period must be a finite number > 0 s"),
        ({"period": 1e-3, "sample_rate": 1000.0}, "long enough for 16 samples"),
        ({"period": 8.2, "motor_turns": 205.0}, "left out where a period is given"),
        ({"period": 8.2, "sample_rate": True}, "sample_rate must be"),
        ({"period": 8.2, "pulse": Pulse(threshold=2.0)}, r"pulse\.threshold must be left out where no pulse\.column"),
        ({"period": 8.2, "pulse": Pulse(edge="falling")}, r"pulse\.edge must be left out where no pulse\.column"),
        ({"period": 8.2, "sample_rate": 1000.0, "shard_items": 10**6}, "short enough"),
    ],
)
def test_settings_are_checked_first(changes, said):
    with pytest.raises(ParameterError, match=said):
        Settings(**changes)


def test_the_period_follows_from_the_motor():
    settings = Settings(sample_rate=1000.0, motor_turns=205.0, known=RecordConditions(motor_speed=1500.0 * RPM))
    assert settings.turn_duration == pytest.approx(8.2) and settings.grid.samples == 8200


@pytest.mark.skipif(not EMPS.exists(), reason="the EMPS measurement (nonlinearbenchmark.org) is not here")
def test_a_real_measurement_is_ingested(tmp_path):
    """EMPS: drive force over the moving mass, 35.15 N/V and 95.1 kg, is the acceleration that the drive asks for."""
    (tmp_path / "emps").mkdir()
    shutil.copy(EMPS, tmp_path / "emps")
    reading = Reading(time_column="t", signal_column="vir", scale=35.15 / 95.1, unit="m/s^2")
    manifest = ingest(
        sources_of(str(tmp_path / "emps"), None),
        Settings(sample_rate=500.0, period=6.0, read=reading),
        tmp_path / "set",
    )
    assert (manifest["records"], manifest["rejected"], manifest["partial_turns"]) == (4, 0, 1)
    row = read_shards(tmp_path / "set").row(1)
    assert (row["source_rate"], row["source_channel"], row["record"].shape) == (1000.0, "vir", (3000,))
    assert 0.1 < np.std(row["record"]) < 10.0


def test_an_ingested_data_set_passes_the_check_and_has_its_card(dataset, tmp_path):
    verdict = check(dataset)
    assert verdict.faults == [] and verdict.records > 10
    card = (dataset / "README.md").read_text(encoding="utf-8")
    assert "license: unknown\n" in card and card.endswith("Not recorded.\n")
    files = bench(tmp_path / "files")
    (files / "healthy" / "broken.wav").write_bytes(b"RIFF")
    ingest(sources_of(str(files), None), SETTINGS, tmp_path / "set")
    assert check(tmp_path / "set").faults == []
    assert "1 of " in (tmp_path / "set" / "README.md").read_text(encoding="utf-8").split("## Rejected items")[1]


def test_a_file_of_another_unit_is_refused(tmp_path):
    """Metres per second squared beside rad per second squared: the first file with a record decides."""
    for name, unit in (("a/0", "m/s^2"), ("a/1", "m/s^2"), ("b/0", "rad/s^2"), ("b/1", "mm/s^2")):
        path = tmp_path / "files" / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = [f"{k / 1000:.3f},{value:.4f}" for k, value in enumerate(measurement(len(name) + ord(name[-1]))[0])]
        path.write_text("\n".join([f"time [s],acc [{unit}]", *rows]) + f"\n{len(rows) / 1000:.3f},{ord(name[0])}")
    manifest = ingest(sources_of(str(tmp_path / "files"), None), Settings(), tmp_path / "set")
    assert (manifest["records"], manifest["rejected"]) == (3, 1)
    assert rejected(tmp_path / "set")[0]["reason"] == (
        "b/0.csv must be in m/s^2 as a/0.csv, got rad/s^2; ingest files of other units by themselves."
    )
    assert check(tmp_path / "set").faults == []
