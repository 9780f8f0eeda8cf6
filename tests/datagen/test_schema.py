"""The schema says the unit of every number, holds every parameter, and DATA.md shows it as it is."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import datagen
from datagen.quantities import JOINTS
from datagen.schema import COLUMNS, SCHEMA_VERSION, rejected_schema, schema, tree
from datagen.shard import iterate_shards, to_table
from indexer_env.faults import Faults
from indexer_env.machine import Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_records.quality import quality_columns


@pytest.mark.parametrize("layout", [schema(), rejected_schema()], ids=["records", "rejected"])
def test_every_column_has_a_sentence_and_every_number_a_unit(layout):
    for field in layout:
        assert len(field.metadata[b"description"]) > 5
        is_number = not (pa.types.is_string(field.type) or pa.types.is_boolean(field.type))
        assert bool(field.metadata[b"unit"]) == is_number, field.name


def test_units_and_version_survive_in_the_file(dataset):
    written = pq.read_schema(dataset / "data" / "shard-00000.parquet")
    assert written.equals(schema(), check_metadata=True)
    assert written.metadata[b"schema_version"] == str(SCHEMA_VERSION).encode()
    assert written.field("output_joint_stiffness").metadata[b"unit"] == b"N m/rad"


def test_every_parameter_has_a_column():
    expected = {field.name for field in dataclasses.fields(Machine)} - {"name", *JOINTS} | {"machine_name"}
    expected |= {f"{joint}_{field.name}" for joint in JOINTS for field in dataclasses.fields(Joint)}
    expected |= {field.name for field in dataclasses.fields(OperatingPoint)}
    expected |= {f"sensor_{field.name}" for field in dataclasses.fields(Sensor)}
    expected |= {f"fault_{field.name}" for field in dataclasses.fields(Faults)}
    assert expected <= set(COLUMNS)


def test_a_column_may_be_null_where_its_rows_allow_it(dataset):
    draw, source, step = COLUMNS["remaining_turns"], COLUMNS["source"], COLUMNS["warmup_tolerance"]
    assert draw.may_be_null("simulated") and draw.may_be_null("measured")
    assert source.may_be_null("simulated") and not source.may_be_null("measured")
    assert step.may_be_null("measured") and not step.may_be_null("simulated")
    with pq.ParquetFile(dataset / "data" / "shard-00000.parquet") as file:
        table = file.read()
    null = {name for name in table.column_names if table.column(name).null_count}
    assert null and all(COLUMNS[name].may_be_null("simulated") for name in null)
    measured = {name for name, column in COLUMNS.items() if column.of == "measured"}
    assert all(table.column(name).null_count == len(table) for name in measured)


def test_a_row_without_a_column_it_must_have_is_no_row(dataset):
    row = next(iterate_shards(dataset)).slice(0, 1).to_pylist()[0]
    record = np.array([row.pop("record")])
    assert to_table([row], record).num_rows == 1
    del row["warmup_tolerance"]
    with pytest.raises(KeyError, match="warmup_tolerance"):
        to_table([row], record)


def test_flat_tops_and_dead_stretches_are_shares_of_the_record():
    wave = np.sin(2 * np.pi * np.arange(1000) / 97.3)
    flat = np.clip(wave, -0.8, 0.8)
    stuck = wave.copy()
    stuck[200:700] = wave[200]
    held = np.clip(wave, -2.0, 0.8)
    columns = quality_columns(np.array([wave, flat, stuck, np.zeros(1000), held]))
    beyond = int((np.abs(wave) >= 0.8).sum()), int((wave >= 0.8).sum())
    assert columns[0] == {"clipped_share": 0.0, "constant_share": 0.0}
    assert columns[1]["clipped_share"] == beyond[0] / 1000
    assert columns[2] == {"clipped_share": 0.0, "constant_share": 0.5}
    assert columns[3] == {"clipped_share": 1.0, "constant_share": 1.0}
    assert columns[4]["clipped_share"] == beyond[1] / 1000


def test_numbers_keep_all_their_bits():
    for name, column in COLUMNS.items():
        if name != "record" and pa.types.is_floating(column.type):
            assert column.type == pa.float64(), name


def test_data_md_shows_the_schema_as_it_is():
    page = Path(datagen.__file__).with_name("DATA.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```text\n(.*?)\n```", page, flags=re.DOTALL)
    assert tree() in blocks, "copy the output of `python -m datagen.schema` into DATA.md"
