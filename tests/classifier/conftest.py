"""A small data set, a classifier trained on it, and records of simulated machines."""

import hashlib
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pyarrow as pa
import pytest

from classifier.codes import CodeBook
from classifier.conditions import Conditions
from classifier.dataset import SUBSETS, Dataset
from classifier.features import Psd
from classifier.train import Result, train
from classifier.trainers.traingdx import TrainGdx
from datagen.recipes import Recipe, make
from datagen.schema import COLUMNS, FORMAT, RECORD, SCHEMA_VERSION
from datagen.shard import Records, parquet_bytes, read_shards, to_table
from datagen.store import MANIFEST, as_json, shard_name
from indexer_cli.places import open_place
from tests.ringing import ringing


@pytest.fixture(scope="session")
def dataset() -> Dataset:
    return ringing()


@pytest.fixture
def plain_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are empty files: drawing them takes most of the time of a short training."""

    def save(figure: object, file: str | Path | io.BytesIO, **_: object) -> None:
        if isinstance(file, str | Path):
            Path(file).touch()

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", save)


@pytest.fixture(scope="session")
def features() -> Psd:
    return Psd(resolution_hz=2.0, maximum_hz=50.0)


@pytest.fixture(scope="session")
def trainer() -> TrainGdx:
    return TrainGdx(epochs=300)


@pytest.fixture(scope="session")
def result(dataset: Dataset, features: Psd, trainer: TrainGdx) -> Result:
    return train(dataset, features, trainer, hidden=6, seed=3, restarts=3)


@pytest.fixture(scope="session")
def machines(tmp_path_factory) -> Records:
    """The paper's 20 cases on a simulated bench, twice: a table turn of 8 indexes each, begun at any place; seed 3."""
    recipe = Recipe("machines", ("campaign=bench", "count=40"))
    return read_shards(make(recipe, 3, tmp_path_factory.mktemp("machines")))


@pytest.fixture(scope="session")
def cracked(machines: Records) -> np.ndarray:
    """Which of the 40 have a cracked roller."""
    return machines.table.column("fault_roller_crack").to_numpy() > 0.0


@pytest.fixture(scope="session")
def few(machines: Records, cracked: np.ndarray) -> tuple[Dataset, np.ndarray]:
    """Twelve of them as two classes, each as if from a file of its own: 8 calibration, 2 control and 2 validation
    records; and the records of the others."""
    chosen = np.concatenate([np.flatnonzero(cracked == state)[:6] for state in (False, True)])
    subsets = np.tile(np.repeat(SUBSETS, (4, 1, 1)), 2)
    records, table = machines.records[chosen], machines.table.take(chosen)
    dataset = Dataset(
        records=records,
        classes=1 + cracked[chosen],
        subsets=subsets,
        codes=CodeBook((1, 2), ("whole", "cracked"), ("10", "01")),
        sample_rate=1000.0,
        quantity="table_acceleration",
        unit="m/s^2",
        provenance={"folder": "made by the tests"},
        conditions=Conditions.of_rows(table, records, subsets),
        table=pa.table({"machine_draw": np.arange(len(chosen))}),
    )
    return dataset, np.delete(machines.records, chosen, axis=0)


@pytest.fixture(scope="session")
def strange_records(few: tuple[Dataset, np.ndarray]) -> dict[str, np.ndarray]:
    """Records that are none of a bench, by what they are; noise and tone have the level of a machine's."""
    record = few[1][0].astype(np.float64)
    time = np.arange(record.size) / 1000.0
    return {
        "noise": record.std() * np.random.default_rng(1).standard_normal(record.size),
        "tone": np.sqrt(2.0) * record.std() * np.sin(2.0 * np.pi * 33.0 * time),
        "ten times": 10.0 * record,
        "a tenth": 0.1 * record,
    }


@pytest.fixture(scope="session")
def write_dataset() -> Callable[..., Path]:
    """Write a data set as datagen does: through its schema, its Parquet writer and its manifest.

    `every` replaces columns of every row, `last` of the last one.
    """

    def write(
        dataset: Dataset, folder: Path, every: Mapping[str, object] = MappingProxyType({}), **last: object
    ) -> Path:
        fixed = {
            "kind": "simulated",
            "sample_rate": dataset.sample_rate,
            "quantity": dataset.quantity,
            "unit": dataset.unit,
        }
        # What a machine would fill in does not matter to a classifier.
        empty = {pa.float64(): 0.0, pa.int64(): 0, pa.string(): "", pa.bool_(): True}
        rows = []
        for item, label in enumerate(dataset.classes.tolist()):
            position = dataset.codes.classes.index(label)
            own = {
                "class": label,
                "class_name": dataset.codes.names[position],
                "code": dataset.codes.codes[position],
                "subset": str(dataset.subsets[item]),
                "machine_draw": item,
                "item": item,
            }
            others = {
                name: None if column.nullable else empty[column.type]
                for name, column in COLUMNS.items()
                if name != RECORD
            }
            rows.append({**others, **fixed, **own, **every})
        rows[-1].update(last)
        place, shard = open_place(folder), parquet_bytes(to_table(rows, dataset.records))
        place.publish(shard_name(0), shard)
        entry = {
            "name": shard_name(0),
            "rows": len(rows),
            "bytes": len(shard),
            "sha256": hashlib.sha256(shard).hexdigest(),
        }
        manifest = {
            "format": FORMAT,
            "schema_version": SCHEMA_VERSION,
            "campaign": "test",
            "seed": 5,
            "count": len(rows),
        }
        place.publish(MANIFEST, as_json({**manifest, "shards": [entry]}))
        return folder

    return write
