"""The schema says the unit of every number, holds every parameter, and DATA.md shows it as it is."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import datagen
from datagen.rows import JOINTS
from datagen.schema import COLUMNS, SCHEMA_VERSION, rejected_schema, schema, tree
from indexer_env.faults import Faults
from indexer_env.machine import Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor


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


def test_numbers_keep_all_their_bits():
    for name, column in COLUMNS.items():
        if name != "record" and pa.types.is_floating(column.type):
            assert column.type == pa.float64(), name


def test_data_md_shows_the_schema_as_it_is():
    page = Path(datagen.__file__).with_name("DATA.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```text\n(.*?)\n```", page, flags=re.DOTALL)
    assert tree() in blocks, "copy the output of `python -m datagen.schema` into DATA.md"
