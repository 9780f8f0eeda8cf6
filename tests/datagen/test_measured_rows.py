"""Measured rows pass the check under rules of their own, and stand in the card beside nothing simulated."""

from __future__ import annotations

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.card import write_card
from datagen.check import check
from datagen.rows import made_with, version_columns
from datagen.schema import FORMAT, SCHEMA_VERSION, rejected_schema
from datagen.shard import read_rows, to_table, write_parquet
from indexer_cli.places import open_place
from indexer_cli.places.local import file_sha256
from indexer_records.quality import quality_columns


@pytest.fixture
def measured(tmp_path):
    """A data set of four measured records of two lengths."""
    return lambda **changes: _written(tmp_path / "set", changes)


def _written(folder, changes):
    (folder / "data").mkdir(parents=True)
    rng = np.random.default_rng(0)
    shards = []
    for number, samples in enumerate((100, 120)):
        records = rng.normal(size=(2, samples)).astype(np.float32)
        rows = [
            {
                "kind": "measured", "sample_rate": 1000.0, "quantity": "table_acceleration", "unit": "m/s^2",
                "class": 1 + place, "class_name": ("whole", "cracked")[place], "code": ("10", "01")[place],
                "subset": "calibration", "machine_draw": 0, "campaign": "measured", "seed": 0,
                "item": 2 * number + place,
                "source": "bench.csv", "source_sha256": "0" * 64, "source_channel": "a", "source_rate": 2000.0,
                "source_start": 8.2 * place, "source_duration": 8.2, "groups": '{"sensor": "A"}',
                **version_columns(), **quality, **changes,
            }
            for place, quality in enumerate(quality_columns(records))
        ]  # fmt: skip
        path = folder / "data" / f"shard-{number:05d}.parquet"
        write_parquet(to_table(rows, records), path)
        shards.append({
            "name": f"data/{path.name}", "rows": 2, "first_item": 2 * number, "last_item": 2 * number + 1,
            "bytes": path.stat().st_size, "sha256": file_sha256(path),
        })  # fmt: skip
    pq.write_table(rejected_schema().empty_table(), folder / "rejected.parquet")
    manifest = {
        "format": FORMAT, "schema_version": SCHEMA_VERSION, "campaign": "measured", "files": 1, "seed": 0, "count": 4,
        "records": 4, "rejected": 0, "versions": made_with(), "config": {}, "classes": {"whole": 2, "cracked": 2},
        "subsets": {"calibration": 4, "control": 0, "validation": 0}, "shards": shards,
    }  # fmt: skip
    (folder / "manifest.json").write_text(json.dumps(manifest))
    write_card(open_place(folder), manifest, {})
    return folder


def test_a_measured_data_set_is_sound_and_has_a_card(measured):
    folder = measured()
    verdict = check(folder)
    assert (verdict.faults, verdict.records, verdict.remade) == ([], 4, 0)
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert "license: unknown\n" in text and "license" not in json.loads((folder / "croissant.json").read_text())
    assert "| cracked | 2 |" in text and text.endswith("Not recorded.\n")
    assert read_rows(folder, [3])[0]["source_start"] == 8.2
    assert pa.types.is_null(pa.array([read_rows(folder, [0])[0]["step"]]).type)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"source": "/home/me/bench.csv"}, "source must be a file's path below the folder that was read"),
        ({"source_sha256": "abc"}, "source_sha256 must be 64 hexadecimal digits, got 'abc'"),
        ({"source_rate": 0.0}, "source_rate must be > 0, got 0.0"),
        ({"groups": "[]"}, "groups must be a JSON mapping, got '[]'"),
    ],
)
def test_faults_of_measured_rows(measured, changes, sentence):
    (first, second) = check(measured(**changes)).faults
    assert first.startswith(f"data/shard-00000.parquet, item 0: {sentence}") and "shard-00001" in second
