"""The commands that look back at a data set: rows made again, and the verdict on the whole."""

from __future__ import annotations

import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import datagen.check
import datagen.remake
from datagen.audit.again import Again
from datagen.check import check
from datagen.remake import difference, other_versions, remake
from datagen.shard import read_rows, read_shards, write_parquet
from indexer_cli.command import BAD_INPUT, DIFFERENT
from indexer_env.errors import SignalError


@pytest.fixture
def call(run_command):
    """Run one of the two commands; gives exit code, stdout and stderr."""
    return run_command


def changed(dataset, tmp_path, name, value):
    """A copy of the data set whose items 8 to 15 have another value in a column."""
    folder = shutil.copytree(dataset, tmp_path / "set")
    path = folder / "data" / "shard-00001.parquet"
    table = pq.ParquetFile(path).read()
    column = pa.array([value] * len(table), table.schema.field(name).type)
    write_parquet(table.set_column(table.column_names.index(name), table.schema.field(name), column), path)
    return folder


def test_several_items_are_equal(call, dataset):
    code, out, _ = call(datagen.remake, str(dataset), "item=[0,19,7]")
    assert code == 0
    assert out.splitlines() == [f"item {item}: equal in every bit of its 300 samples" for item in (0, 19, 7)]


def test_a_difference_is_located(call, dataset, tmp_path):
    folder = changed(dataset, tmp_path, "table_inertia", 5.5)
    code, out, _ = call(datagen.remake, str(folder), "item=9")
    assert code == DIFFERENT
    assert out.startswith("item 9: ") and " of 300 samples apart, first sample " in out


def test_other_versions_are_named(call, dataset, tmp_path):
    folder = changed(dataset, tmp_path, "numba_version", "0.1")
    code, out, _ = call(datagen.remake, f"data={folder}", "item=9")
    assert code == 0 and "; made by numba 0.1 (here " in out
    row = read_rows(folder, [9])[0]
    assert other_versions(row).startswith("numba 0.1 (here ") and other_versions(read_rows(folder, [0])[0]) == ""


def test_the_rows_made_again_are_a_file(call, dataset, tmp_path):
    out = tmp_path / "two.parquet"
    assert call(datagen.remake, str(dataset), "item=[3,12]", f"out={out}")[0] == 0
    table = pq.ParquetFile(out).read()
    assert table.column("item").to_pylist() == [3, 12]
    stored = read_shards(dataset).records[[3, 12]]
    np.testing.assert_array_equal(np.array(table.column("record").to_pylist(), dtype=np.float32), stored)
    code, _, err = call(datagen.remake, str(dataset), "item=3", f"out={out}")
    assert code == BAD_INPUT and "out must be a new file that ends in .parquet" in err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["item=99"], "item must be an item that has a record, 0 to 19"),
        (["item=-1"], "error: item must be a whole number >= 0, got -1"),
        (["item=first"], "error: item must be a whole number"),
        (["item=3", "out=x.csv"], "must be a new file that ends in .parquet, got 'x.csv'"),
        ([], "item must be given"),
    ],
)
def test_mistakes(call, dataset, arguments, sentence):
    code, out, err = call(datagen.remake, str(dataset), *arguments)
    assert (code, out) == (BAD_INPUT, "") and sentence in err and err.count("\n") == 1


def test_a_measured_row_cannot_be_made_again(dataset):
    row = {**read_rows(dataset, [0])[0], "kind": "measured", "source": "bench.csv"}
    with pytest.raises(
        SignalError, match=r"item 0 must be simulated to be made again, got a measured one \(bench\.csv\)"
    ):
        remake(row)


def test_difference_looks_at_bits():
    record = np.array([0.0, 1.0, np.float32(0.1)], dtype=np.float32)
    assert difference(record, record.copy()) == ""
    assert "1 of 3 samples apart, first sample 0" in difference(record, np.array([-0.0, 1.0, 0.1], dtype=np.float32))
    assert "2 samples instead of 3" in difference(record, record[:2])


def test_the_check_says_sound_or_counts(call, dataset, tmp_path):
    code, out, _ = call(datagen.check, str(dataset), "remake=2")
    assert code == 0 and out.splitlines()[-1] == f"{dataset}: sound; 20 records checked, 2 made again"
    folder = changed(dataset, tmp_path, "table_inertia", 5.5)
    code, out, _ = call(datagen.check, str(folder))
    assert code == DIFFERENT and out.splitlines()[-1].startswith(f"{folder}: 1 fault; 12 records checked, ")
    assert call(datagen.check, str(tmp_path))[0] == BAD_INPUT
    assert call(datagen.check, str(dataset), "remake=-1")[0] == BAD_INPUT


def test_a_path_with_strange_signs_needs_no_quotes(call, dataset, tmp_path):
    folder = shutil.copytree(dataset, tmp_path / 'it\'s, [my] "set" {1}')
    code, out, err = call(datagen.check, str(folder), "remake=0")
    assert code == 0 and "sound; 20 records checked, 0 made again" in out, err


def test_rows_of_a_gpu_that_is_not_here_are_noted_and_not_judged(dataset, tmp_path):
    folder = changed(dataset, tmp_path, "device", "NVIDIA of another host")
    again = Again(8, 8, 0)
    again.take("set", pq.ParquetFile(folder / "data" / "shard-00001.parquet").read())
    assert list(again.faults()) == [] and again.remade == 0 and len(again.notes) == 8
    assert again.notes[0] == "set, item 8: not made again, as NVIDIA of another host made it, which is not here."


def test_rows_of_other_versions_are_noted_and_not_judged(dataset, monkeypatch):
    monkeypatch.setattr("datagen.audit.again.other_versions", lambda _: "numba 0.1 (here 0.2)")
    verdict = check(dataset, remake=3)
    assert verdict.faults == [] and verdict.remade == 0 and len(verdict.notes) == 3
    assert verdict.notes[0].endswith("not made again, as other versions made it: numba 0.1 (here 0.2).")
