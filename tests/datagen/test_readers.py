"""The tools of the ecosystem open a data set as it lies there and give its values back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.dataset
import pytest

from datagen.schema import COLUMNS
from datagen.shard import Records, read_shards


@pytest.fixture(scope="module")
def data(dataset) -> Records:
    return read_shards(dataset)


@pytest.fixture(scope="module")
def shards(dataset) -> Path:
    return dataset / "data"


def test_arrow(shards, data):
    opened = pyarrow.dataset.dataset(shards)
    table = opened.to_table(columns=["item", "record"], filter=pyarrow.dataset.field("class") == 5)
    assert set(table.column("item").to_pylist()) == {4, 10, 16}
    np.testing.assert_array_equal(table.column("record")[1].values.to_numpy(), data.records[10])
    assert opened.schema.field("step").metadata[b"unit"] == b"s"


def test_pandas(shards, data):
    import pandas

    frame = pandas.read_parquet(shards)
    assert list(frame.columns) == list(COLUMNS) and len(frame) == 20
    assert frame["record"][13].dtype == np.float32
    np.testing.assert_array_equal(frame["record"][13], data.records[13])
    assert frame["output_joint_stiffness"][13] == data.row(13)["output_joint_stiffness"]


def test_polars(shards, data):
    import polars

    lazy = polars.scan_parquet(shards / "*.parquet").filter(polars.col("class") == 5).select("item", "record")
    frame = lazy.collect()
    assert frame["item"].to_list() == [4, 10, 16] and frame.schema["record"] == polars.List(polars.Float32)
    np.testing.assert_array_equal(frame["record"][1].to_numpy(), data.records[10])


def test_duckdb(shards, data):
    import duckdb

    with duckdb.connect() as connection:
        query = f"select item, record, class_name from '{shards}/*.parquet' where class = 5 order by item"
        rows = connection.execute(query).fetchall()
    assert [row[0] for row in rows] == [4, 10, 16] and rows[1][2] == data.row(10)["class_name"]
    np.testing.assert_array_equal(np.float32(rows[1][1]), data.records[10])


@pytest.fixture
def hugging_face(monkeypatch, tmp_path):
    """The library, kept from the network and from the user's cache."""
    import datasets
    import datasets.config

    monkeypatch.setattr(datasets.config, "HF_HUB_OFFLINE", True)
    datasets.disable_progress_bars()

    def load(*arguments: str, **options: str):
        return datasets.load_dataset(*arguments, split="train", cache_dir=str(tmp_path / "cache"), **options)

    return load


def test_hugging_face_opens_the_shards(hugging_face, shards, data):
    from datasets import List, Value

    loaded = hugging_face("parquet", data_dir=str(shards))
    assert loaded.features["record"] == List(Value("float32"))
    assert loaded.features["item"] == Value("int64") and loaded.features["subset"] == Value("string")
    row = loaded.with_format("numpy")[11]
    assert row["record"].dtype == np.float32 and row["item"] == 11
    np.testing.assert_array_equal(row["record"], data.records[11])


def test_hugging_face_opens_the_folder_by_its_card(hugging_face, dataset, data):
    loaded = hugging_face(str(dataset))
    assert loaded.num_rows == 20 and loaded[19]["code"] == data.row(19)["code"]
    np.testing.assert_array_equal(np.float32(loaded[19]["record"]), data.records[19])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning:ray")
def test_ray(shards, data):
    """A cluster of this process's own, one core, no dashboard."""
    import ray

    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    try:
        rows = ray.data.read_parquet(str(shards)).select_columns(["item", "record"]).sort("item").take_all()
    finally:
        ray.shutdown()
    assert [row["item"] for row in rows] == list(range(20))
    np.testing.assert_array_equal(np.float32(rows[6]["record"]), data.records[6])


def test_a_column_of_records_is_plain_float32(shards):
    field = pyarrow.dataset.dataset(shards).schema.field("record")
    assert field.type.value_type == pa.float32() and not field.nullable
