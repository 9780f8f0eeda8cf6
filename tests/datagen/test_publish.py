"""A published copy has the subsets as splits, the very records, and metadata that fit its files."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from datagen.campaign import SUBSETS
from datagen.publish import publish
from datagen.shard import read_shards
from indexer_cli.places import open_place
from indexer_env.errors import ParameterError, SignalError


@pytest.fixture
def copy(dataset, tmp_path) -> Path:
    publish(open_place(dataset), tmp_path / "hub")
    return tmp_path / "hub"


def test_each_subset_is_a_split(dataset, copy, tmp_path, monkeypatch) -> None:
    import datasets

    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    opened = datasets.load_dataset(str(copy), cache_dir=str(tmp_path / "cache"))
    data = read_shards(dataset)
    assert isinstance(opened, datasets.DatasetDict) and list(opened) == list(SUBSETS)
    for subset in SUBSETS:
        wanted = data.subset(subset)
        assert opened[subset]["item"] == wanted.table.column("item").to_pylist()
        np.testing.assert_array_equal(np.float32(opened[subset]["record"]), wanted.records)


def test_metadata_fit_the_files(copy) -> None:
    described = json.loads((copy / "croissant.json").read_text())["distribution"][1:]
    assert {entry["name"] for entry in described} == {f"data/{path.name}" for path in (copy / "data").iterdir()}
    for entry in described:
        assert hashlib.sha256((copy / entry["name"]).read_bytes()).hexdigest() == entry["sha256"]
    card = (copy / "README.md").read_text()
    assert "path: data/validation-*.parquet" in card and "judge once on validation" in card
    assert len(list((copy / "pictures").iterdir())) == 6


def test_the_same_data_set_gives_the_same_bytes(dataset, copy, tmp_path) -> None:
    publish(open_place(dataset), tmp_path / "again")
    for path in copy.rglob("*.parquet"):
        assert path.read_bytes() == (tmp_path / "again" / path.relative_to(copy)).read_bytes()


def test_nothing_is_replaced_or_left_half_written(dataset, copy, tmp_path) -> None:
    with pytest.raises(ParameterError, match="out must be a new or empty folder"):
        publish(open_place(dataset), copy)
    publish(open_place(dataset), copy, overwrite=True)
    with pytest.raises(SignalError, match="no folder that holds a data set"):
        publish(open_place(tmp_path / "nothing"), tmp_path / "new")
    assert not (tmp_path / "new").exists()
