"""The check finds nothing in a sound data set and names every kind of damage."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.campaigns import make_campaign
from datagen.check import check
from datagen.generate import generate
from datagen.schema import rejected_schema
from datagen.shard import write_parquet

SHARD = "data/shard-00001.parquet"
"""The damaged one; it holds items 8 to 15."""

Damage = Callable[[Path], None]


@pytest.fixture
def copy(dataset, tmp_path):
    return shutil.copytree(dataset, tmp_path / "set")


def listed_anew(folder: Path, **changes: Any) -> None:
    """Make the manifest and the Croissant file agree with the damaged shard as a file, so that only its rows tell."""
    content = (folder / SHARD).read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    manifest = json.loads((folder / "manifest.json").read_text())
    old = manifest["shards"][1]["sha256"]
    manifest["shards"][1].update(bytes=len(content), sha256=digest, **changes)
    (folder / "manifest.json").write_text(json.dumps(manifest))
    croissant = folder / "croissant.json"
    croissant.write_text(croissant.read_text().replace(old, digest))


def rewritten(change: Callable[[pa.Table], pa.Table]) -> Damage:
    def damage(folder: Path) -> None:
        table = change(pq.ParquetFile(folder / SHARD).read())
        if "record" in table.column_names:
            write_parquet(table, folder / SHARD)
        else:
            pq.write_table(table, folder / SHARD)
        listed_anew(folder)

    return damage


def put(name: str, value: Any, rows: tuple[int, ...] = (2,)) -> Damage:
    """Other values in one column of some rows of the shard; row 2 is item 10."""

    def change(table: pa.Table) -> pa.Table:
        values = table.column(name).to_pylist()
        for row in rows:
            values[row] = value(values[row]) if callable(value) else value
        field = table.schema.field(name)
        return table.set_column(table.column_names.index(name), field, pa.array(values, field.type))

    return rewritten(change)


def text(name: str, old: str, new: str) -> Damage:
    def damage(folder: Path) -> None:
        content = (folder / name).read_text()
        assert old in content
        (folder / name).write_text(content.replace(old, new, 1))

    return damage


def manifest(**changes: Any) -> Damage:
    def damage(folder: Path) -> None:
        path = folder / "manifest.json"
        held = json.loads(path.read_text())
        for key, value in changes.items():
            held[key] = value(held[key]) if callable(value) else value
        path.write_text(json.dumps(held))

    return damage


def entry(**changes: Any) -> Damage:
    return manifest(shards=lambda shards: [shards[0], {**shards[1], **changes}, *shards[2:]])


def sample(row: list[float], value: float) -> list[float]:
    return [*row[:50], value, *row[51:]]


def flip(folder: Path) -> None:
    content = bytearray((folder / SHARD).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / SHARD).write_bytes(content)


def cut(folder: Path) -> None:
    (folder / SHARD).write_bytes((folder / SHARD).read_bytes()[:-10])


def no_parquet(folder: Path) -> None:
    (folder / SHARD).write_bytes(b"PAR1 nothing")
    listed_anew(folder)


def reject(**values: Any) -> Damage:
    def damage(folder: Path) -> None:
        row = {
            "seed": 3, "item": 4, "class": 1, "class_name": "x", "code": "01111", "subset": "control",
            "machine_draw": 4, "stage": "simulation", "reason": "It could not be.", "draws": "{}", **values,
        }  # fmt: skip
        pq.write_table(pa.Table.from_pylist([row], schema=rejected_schema()), folder / "rejected.parquet")

    return damage


def renamed_metadata(table: pa.Table) -> pa.Table:
    place = table.column_names.index("step")
    field = table.schema.field("step").with_metadata({"unit": "ms"})
    return pa.Table.from_arrays(table.columns, schema=table.schema.set(place, field))


DAMAGES: dict[str, tuple[Damage, str]] = {
    # files
    "a shard is gone": (lambda f: (f / SHARD).unlink(), r"shard-00001\.parquet: it must be there"),
    "a shard is cut": (cut, r"shard-00001\.parquet: it must have \d+ bytes, got"),
    "one bit is flipped": (flip, r"shard-00001\.parquet: its SHA-256 must be"),
    "a shard is no Parquet": (no_parquet, r"shard-00001\.parquet.* is damaged"),
    "a strange file among the shards": (
        lambda f: (f / "data" / "x.csv").write_text("1"),
        r"data/x\.csv: data/ must hold",
    ),
    "a file left over": (
        lambda f: (f / "manifest.json.part").write_text(""),
        r"manifest\.json\.part: a finished data set",
    ),
    "no rejected items": (lambda f: (f / "rejected.parquet").unlink(), r"rejected\.parquet: it must be there"),
    "rejected items unreadable": (
        lambda f: (f / "rejected.parquet").write_text("x"),
        r"rejected\.parquet: it must be Par",
    ),
    "no card": (lambda f: (f / "README.md").unlink(), r"README\.md: it must be there"),
    "no truth of the example": (lambda f: (f / "example.json").unlink(), r"example\.json: it must be there beside"),
    "truth unreadable": (lambda f: (f / "example.json").write_text("{"), r"example\.json: it must be JSON"),
    "croissant unreadable": (
        lambda f: (f / "croissant.json").write_text("[1]"),
        r"croissant\.json: it must be a mapping",
    ),
    "croissant of other shards": (
        text("croissant.json", '"sha256": "', '"sha256": "0'),
        r"croissant\.json: sha256 of data/",
    ),
    # manifest
    "manifest without a key": (text("manifest.json", '"count"', '"cuont"'), r"manifest\.json: count must be given"),
    "manifest with text for a number": (
        manifest(records="20"),
        r"manifest\.json: records must be given as int, got '20'",
    ),
    "shard entry incomplete": (entry(rows=None), r"manifest\.json, shard 1: rows must be given"),
    "shard under another name": (entry(name="../x.parquet"), r"shard 1: name must be data/shard-NUMBER\.parquet"),
    "a shard twice": (manifest(shards=lambda s: [*s, s[0]]), r"manifest\.json: a shard must be listed once"),
    "wrong number of rows": (entry(rows=7), r"it must have 7 rows, as the manifest says, got 8"),
    "wrong first item": (entry(first_item=7), r"first_item of data/shard-00001\.parquet must be 8, .* got 7"),
    "wrong number of records": (manifest(records=21), r"manifest\.json: records must be 20, .* got 21"),
    "wrong number of rejected": (manifest(rejected=1), r"manifest\.json: rejected must be 0, .* got 1"),
    "wrong count of a class": (manifest(classes={"x": 20}), r"manifest\.json: classes must count"),
    "wrong count of a subset": (manifest(subsets={"control": 20}), r"manifest\.json: subsets must count"),
    "wrong number not settled": (manifest(not_settled=99), r"manifest\.json: not_settled must be \d+, .* got 99"),
    "items missing": (manifest(count=25), r"item 20: an item must be a record or rejected, got neither for 5"),
    "items beyond the count": (manifest(count=15), r"item 15: item must be from 0 to 14"),
    # schema
    "a column gone": (rewritten(lambda t: t.drop_columns(["model"])), r"column model must be there"),
    "a column too many": (rewritten(lambda t: t.append_column("x", t["item"])), r"got x as well"),
    "a column of another type": (
        rewritten(lambda t: t.set_column(t.column_names.index("step"), "step", t["step"].cast(pa.float32()))),
        r"column step must be double, got float",
    ),
    "a unit changed": (rewritten(renamed_metadata), r"column step must carry the unit.*'unit': 'ms'"),
    "columns in another order": (
        rewritten(lambda t: t.select([*t.column_names[1:], "record"])),
        r"in the order of the",
    ),
    "no schema version": (rewritten(lambda t: t.replace_schema_metadata({})), r"must carry format and schema version"),
    # rows
    "a null": (put("warmup_tolerance", None), r"item 10: warmup_tolerance of a simulated row must be given, got None"),
    "a source in a simulated row": (put("source", "x.csv"), r"item 10: source of a simulated row must be null"),
    "a number that is none": (put("table_inertia", float("nan")), r"item 10: table_inertia must be a finite number"),
    "an infinite number": (put("warmup_difference", float("inf")), r"item 10: warmup_difference must be a finite"),
    "a share above 1": (put("clipped_share", 1.5), r"item 10: clipped_share must be from 0 to 1, got 1\.5"),
    "a share of another record": (put("constant_share", 0.5), r"item 10: constant_share must be that of its record"),
    "a class below 1": (put("class", 0), r"item 10: class must be >= 1, got 0"),
    "a class under another name": (put("class_name", "x"), r"item 10: class 5 must be .*, got 'x' with code 11101"),
    "a class with two codes": (put("code", "00000"), r"item 10: class 5 must be .*, got .* with code 00000"),
    "two classes with one code": (put("class", 9), r"item 10: code 11101 must be of one class"),
    "a code of other signs": (put("code", "1110x"), r"item 10: code must be characters 0 and 1, got '1110x'"),
    "an unknown subset": (put("subset", "training"), r"item 10: subset must be one of .*, got 'training'"),
    "a machine in two subsets": (
        put("machine_draw", 0),
        r"machine draw 0 must be in one subset, got calibration and con",
    ),
    "turns below 0": (put("remaining_turns", -1), r"item 10: remaining_turns must be >= 0, got -1"),
    "an unknown kind": (put("kind", "dreamt"), r"item 10: kind must be one of simulated, measured, got 'dreamt'"),
    "a rate of 0": (put("sample_rate", 0.0), r"item 10: sample_rate must be > 0, got 0\.0"),
    "a rate the sensor cannot give": (put("sample_rate", 600.0), r"item 10: sample_rate must be simulation_rate over"),
    "a record cut short": (put("record", lambda row: row[:200]), r"item 10: record must have the samples of its sim"),
    "an empty record": (put("record", lambda _: []), r"item 10: record must hold samples, got 0"),
    "a sample that is no number": (
        put("record", lambda row: sample(row, float("nan"))),
        r"item 10: record must hold fin",
    ),
    "an unknown unit": (put("unit", "g"), r"item 10: unit must be one of rad/s\^2, m/s\^2, got 'g'"),
    "two units": (put("unit", "rad/s^2"), r"item 10: unit must be m/s\^2 as that of the first row, got 'rad/s\^2'"),
    "another unit than the sensor's": (put("unit", "rad/s^2"), r"item 10: unit must be m/s\^2, as its sensor reads"),
    "another quantity": (put("quantity", "speed"), r"item 10: quantity must be table_acceleration, got 'speed'"),
    "an empty text": (put("machine_name", ""), r"item 10: machine_name must be a text that is not empty"),
    "effects that are no JSON": (put("effects", "[{"), r"item 10: effects must be a JSON list"),
    "effects without a name": (put("effects", '[{"torque": 1}]'), r"item 10: effects must be a JSON list"),
    "an effect that is none": (put("effects", '[{"name": "friction.colomb"}]'), r"item 10: .*friction\.colomb"),
    "an impossible machine": (put("output_joint_stiffness", -1.0), r"item 10: .*stiffness must be .* got -1\.0"),
    "an impossible sensor": (put("sensor_gain", 0.0), r"item 10: Sensor\.gain must be other than 0"),
    "an unknown motion law": (put("motion_law", "magic"), r"item 10: its columns must describe a machine"),
    "a fault without its effect": (
        put("fault_backlash", 0.1),
        r"item 10: effects must hold the row's faults, got none",
    ),
    "more warm-up than allowed": (
        put("warmup_turns", 9),
        r"item 10: warmup_turns must be at most warmup_limit \(1\), got 9",
    ),
    "settled against the difference": (
        put("warmup_settled", lambda old: not old),
        r"item 10: warmup_settled must be true",
    ),
    "another campaign": (
        put("campaign", "bench"),
        r"item 10: campaign must be table2, as the manifest says, got 'bench'",
    ),
    "another seed": (put("seed", 4), r"item 10: seed must be 3, as the manifest says, got 4"),
    "another version": (
        put("numpy_version", "1.0"),
        r"item 10: numpy_version must be .*, as the manifest says, got '1\.0'",
    ),
    "another schema version": (put("schema_version", 1), r"item 10: schema_version must be from 4 to 4, got 1"),
    "an item twice": (put("item", 9), r"item 9: item must be above that of the row before, got 9"),
    "items out of order": (put("item", 30), r"item 11: item must be above that of the row before, got 11"),
    "rows at fault are counted": (
        put("class", -1, (2, 4, 5)),
        r"item 10: class must be >= 1, got -1, as do 2 more rows",
    ),
    # records made again
    "a sample changed": (
        put("record", lambda row: sample(row, 1.25), tuple(range(8))),
        r"item \d+: its record must be what its columns make, got 1 of 300 samples apart, first sample 50 \(1\.25",
    ),
    "another stiffness": (
        put("output_joint_stiffness", lambda old: 1.001 * old, tuple(range(8))),
        r"item \d+: its record must be what its columns make, got \d+ of 300 samples apart",
    ),
    # rejected items
    "an item both kept and rejected": (
        reject(),
        r"rejected\.parquet, item 4: an item must be a record or rejected, got b",
    ),
    "a rejection without a sentence": (reject(reason="no"), r"rejected\.parquet, item 4: reason must be a sentence"),
    "a rejection of no subset": (reject(subset="x"), r"rejected\.parquet, item 4: subset must be one of"),
    "a rejection with a strange item": (reject(item=-1), r"rejected\.parquet, item -1: item must be above"),
    "rejections of another schema": (
        lambda f: pq.write_table(pa.table({"item": [1]}), f / "rejected.parquet"),
        r"rejected\.parquet: column seed must be",
    ),
}


def test_a_sound_data_set_has_no_fault(dataset):
    verdict = check(dataset, remake=20)
    assert (verdict.faults, verdict.notes, verdict.records, verdict.remade) == ([], [], 20, 20)


def test_a_data_set_with_rejected_items_has_no_fault(order, settings, tmp_path):
    settings["draws"]["machine"]["output_joint"]["stiffness"]["around"] = 1.5
    generate(replace(order, campaign=make_campaign(settings), count=40), tmp_path / "wild")
    verdict = check(tmp_path / "wild")
    assert verdict.faults == [] and 0 < verdict.records < 40


@pytest.mark.parametrize("name", DAMAGES)
def test_every_damage_is_found_and_named(copy, name):
    damage, sentence = DAMAGES[name]
    damage(copy)
    faults = check(copy, remake=20).faults
    assert any(re.search(sentence, fault) for fault in faults), "\n".join(faults)
    assert all(fault.endswith(".") and "\n" not in fault for fault in faults), faults
