"""The reader gives back what was written and says in one sentence what keeps it from that."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.shard import read_shards, record_matrix
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


def column_of(*pieces: list[list[float]]) -> pa.ChunkedArray:
    kind = pa.list_(pa.float32())
    return pa.chunked_array([pa.array(piece, kind) for piece in pieces], kind)


def test_records_in_several_pieces_are_one_matrix():
    whole = column_of([[9, 9], [1, 2]], [], [[3, 4], [5, 6], [9, 9]])
    np.testing.assert_array_equal(record_matrix(whole.slice(1, 3), "set"), [[1, 2], [3, 4], [5, 6]])
    with pytest.raises(SignalError, match="set must hold records of one length, got 1 to 2 samples"):
        record_matrix(column_of([[1, 2]], [[3]]), "set")
    for nothing in (column_of(), column_of([])):
        with pytest.raises(SignalError, match="set must hold a record, got none"):
            record_matrix(nothing, "set")


def test_more_samples_than_32_bits_count_are_no_obstacle():
    """The same piece 2048 times over, 2^31 samples in 4 MB; an odd one at the end stops it before they are copied."""
    piece = column_of([[0.0] * 2**20]).chunk(0)
    with pytest.raises(SignalError, match="got 1 to 1048576 samples"):
        record_matrix(pa.chunked_array([piece] * 2048 + [column_of([[1.0]]).chunk(0)]), "set")
