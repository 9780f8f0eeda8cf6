"""The reader gives back what was written and says in one sentence what keeps it from that."""

from __future__ import annotations

import json
import shutil

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.shard import read_shards
from indexer_env.errors import SignalError


@pytest.fixture
def copy(dataset, tmp_path):
    return shutil.copytree(dataset, tmp_path / "set")


def refusal(folder) -> str:
    with pytest.raises(SignalError) as caught:
        read_shards(folder)
    text = str(caught.value)
    assert "\n" not in text and text.endswith(".")
    return text


def change_manifest(folder, **changes):
    path = folder / "manifest.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def test_no_folder_no_data_set(tmp_path, copy):
    assert "is no folder" in refusal(tmp_path / "none")
    assert "is no folder" in refusal(copy / "manifest.json")
    assert "holds a data set (no manifest.json)" in refusal(tmp_path)


def test_another_schema_version(copy):
    change_manifest(copy, schema_version=99)
    assert "must have schema version 4, got 99" in refusal(copy)


def test_damaged_or_foreign_manifest(copy):
    (copy / "manifest.json").write_text("{")
    assert "is damaged" in refusal(copy)
    (copy / "manifest.json").write_text('{"name": "web app"}')
    assert "is not the manifest of a data set" in refusal(copy)
    (copy / "manifest.json").write_text("[1, 2]")
    assert "is not the manifest of a data set" in refusal(copy)


def test_missing_cut_or_damaged_shard(copy):
    shard = copy / "data" / "shard-00001.parquet"
    whole = shard.read_bytes()
    shard.write_bytes(whole[:-100])
    assert "shard-00001.parquet must have" in refusal(copy)
    shard.write_bytes(b"\0" * len(whole))
    assert "shard-00001.parquet is damaged" in refusal(copy)
    shard.unlink()
    assert "shard-00001.parquet is missing" in refusal(copy)


def test_shard_of_another_layout(copy):
    shard = copy / "data" / "shard-00000.parquet"
    pq.write_table(pq.read_table(shard).drop_columns(["model"]), shard)
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["shards"][0]["bytes"] = shard.stat().st_size
    change_manifest(copy, shards=manifest["shards"])
    assert "does not follow schema version 4 (model)" in refusal(copy)


def test_records_of_different_lengths(copy):
    shard = copy / "data" / "shard-00002.parquet"
    table = pq.read_table(shard)
    place = table.schema.get_field_index("record")
    cut = pa.array([row[:100] for row in table.column("record").to_pylist()], type=table.schema.field(place).type)
    pq.write_table(table.set_column(place, table.schema.field(place), cut), shard)
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["shards"][2]["bytes"] = shard.stat().st_size
    change_manifest(copy, shards=manifest["shards"])
    assert "one length, got 100 to 300" in refusal(copy)
