"""Signals of the drive stand beside the record, are made again bit for bit, and are audited."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.audit.records import record_faults
from datagen.batches import RecordStream
from datagen.check import check
from datagen.generate import generate
from datagen.recipes import Recipe, order_of
from datagen.remake import differences, remake_all
from datagen.schema import RECORD, SAMPLED
from datagen.shard import read_shards
from indexer_env.drive_sensors import SIGNALS
from indexer_env.errors import ParameterError

ASKED = ("motor_current", "table_angle")
DRIVE = (
    "campaign=bench", "count=6", "run.samples=600", "run.warmup_turns=0", f"drive_sensors.signals=[{','.join(ASKED)}]",
    "drive_sensors.current_noise_density=0.001", "drive_sensors.table_counts=65536",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("drive") / "data"
    generate(order_of(Recipe("drive", DRIVE), 5), place)
    return place


def test_the_columns_are_those_of_the_model(folder) -> None:
    table = read_shards(folder).table
    assert set(SIGNALS) | {RECORD} == set(SAMPLED)
    for name in SIGNALS:
        assert table.column(name).null_count == (0 if name in ASKED else 6)
    current = np.array(table.column("motor_current").to_pylist())
    assert current.shape == (6, 600) and len({tuple(row[:5]) for row in current.tolist()}) == 6


def test_the_record_is_the_same_without_them(folder, tmp_path) -> None:
    plain = Recipe("plain", tuple(part for part in DRIVE if "drive_sensors" not in part))
    generate(order_of(plain, 5), tmp_path / "plain")
    np.testing.assert_array_equal(read_shards(folder).records, read_shards(tmp_path / "plain").records)


def test_they_are_made_again_bit_for_bit_and_the_check_looks_at_them(folder) -> None:
    data = read_shards(folder)
    row = data.row(3)
    made = remake_all(row)
    assert set(made) == {RECORD, *ASKED} and differences(made, row) == ""
    row["motor_current"] = [*row["motor_current"][:-1], 0.0]
    assert differences(made, row).startswith("motor_current with 1 of 600 samples apart")
    verdict = check(folder, 6, 0)
    assert verdict.faults == [] and verdict.remade == 6


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("table_angle", None, "table_angle must be given where drive_sensors lists it"),
        ("motor_angle", [0.0] * 600, "motor_angle must be given where drive_sensors lists it, and null elsewhere"),
        ("motor_current", [0.0] * 599, "motor_current must have the samples of its record, got 599"),
        ("motor_current", [0.0] * 599 + [float("nan")], "motor_current must hold finite samples"),
    ],
)
def test_what_is_wrong_with_a_signal_is_told(folder, name: str, value, sentence: str) -> None:
    table = pq.ParquetFile(next((folder / "data").iterdir())).read()
    values = table.column(name).to_pylist()
    values[2] = value
    place = table.schema.get_field_index(name)
    broken = table.set_column(place, table.schema.field(name), pa.array(values, table.schema.field(name).type))
    faults = list(record_faults("shard", broken, broken.column("item").to_numpy()))
    assert any(sentence in fault and "item 2" in fault for fault in faults)


def test_batches_hold_them_as_tensors(folder) -> None:
    batch = next(iter(RecordStream(folder, ("motor_current",), batch_size=4, window=4)))
    assert batch["motor_current"].shape == (4, 600)
    with pytest.raises(ParameterError, match="signals that every record has, got 'motor_torque'"):
        next(iter(RecordStream(folder, ("motor_torque",), batch_size=4, window=4)))


def test_model_a_and_another_rate_are_refused(tmp_path) -> None:
    with pytest.raises(ParameterError, match="which has no input joint"):
        generate(order_of(Recipe("a", (*DRIVE[2:], "campaign=grid", "count=1", "machine.model=A")), 0), tmp_path / "a")
    slow = (*DRIVE, "sensor.sample_rate=500", "sensor.lowpass_hz=200")
    with pytest.raises(ParameterError, match="must be empty where sensor"):
        order_of(Recipe("slow", slow), 0)
