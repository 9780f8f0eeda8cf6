"""A labelled data set as the classifier needs it: records, labels and the three subsets of the paper."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from classifier.codes import CodeBook
from classifier.conditions import Conditions
from datagen.campaign import SUBSETS
from datagen.campaigns import CAMPAIGNS
from datagen.shard import read_shards
from datagen.store import MANIFEST
from indexer_cli.places import Place, open_place
from indexer_env.errors import SignalError

_NOT_OF_AN_ITEM = ("count", "shard_items", "device")
"""Keys of conf/generate.yaml that say how many items there are and where they are made."""


@dataclass(frozen=True, eq=False)
class Dataset:
    """Labelled one-turn records that share rate, length, quantity and unit.

    records      (n, samples) float32, in `unit`; (n, channels, samples) of several channels
    classes      (n,) class labels
    subsets      (n,) one of SUBSETS each; the data set has assigned them per machine draw
    codes        the classes with their names and codes
    sample_rate  [Hz]
    provenance   where the records come from: folder, SHA-256 of its manifest and of what makes its rows, number of
                 records, campaign, seed
    conditions   under what the records were taken
    table        (n rows) all further columns of `datagen.schema`; without a column where the records are no data set
                 of `datagen`
    """

    records: np.ndarray
    classes: np.ndarray
    subsets: np.ndarray
    codes: CodeBook
    sample_rate: float
    quantity: str
    unit: str
    provenance: dict[str, Any]
    conditions: Conditions = field(default_factory=Conditions)
    table: pa.Table = field(default_factory=lambda: pa.table({}))

    def __post_init__(self) -> None:
        for subset in SUBSETS:
            present = set(self.classes[self.subsets == subset].tolist())
            missing = [label for label in self.codes.classes if label not in present]
            if missing:
                name = self.codes.names[self.codes.classes.index(missing[0])]
                more = "add files of it, or say in the labels table (column subset) which go where"
                raise SignalError(
                    f"the {subset} subset must hold at least one record of every class, got none of class {missing[0]} "
                    f"({name}); {more if self.measured else 'generate more records'}."
                )

    @property
    def measured(self) -> bool:
        """Whether all records are measured ones."""
        named = self.table.column_names
        return "kind" in named and set(self.table.column("kind").unique().to_pylist()) == {"measured"}

    @property
    def channels(self) -> int:
        """Channels of each record."""
        return self.records.shape[1] if self.records.ndim == 3 else 1

    def rows(self, subset: str) -> np.ndarray:
        """Mask (n,) of the rows of one subset."""
        return self.subsets == subset


def _one(table: Any, name: str, path: Place) -> Any:
    values = table.column(name).unique().to_pylist()
    if len(values) != 1:
        raise SignalError(f"{name} must be the same for all records of {path}, got {values[:3]}.")
    return values[0]


def _check_no_leak(draws: np.ndarray, subsets: np.ndarray, path: Place) -> None:
    place: dict[int, str] = {}
    for draw, subset in zip(draws.tolist(), subsets.tolist(), strict=True):
        if place.setdefault(draw, subset) != subset:
            raise SignalError(
                f"all records of machine draw {draw} of {path} must be in one subset, "
                f"got {place[draw]} and {subset}; a network would be judged on machines that it has seen."
            )


def _check_sensors(records: np.ndarray, table: pa.Table, path: Place) -> None:
    missing = np.flatnonzero(~np.isfinite(records).all(axis=tuple(range(1, records.ndim))))
    if missing.size:
        item = table.column("item")[int(missing[0])].as_py()
        raise SignalError(
            f"all samples of {path} must be finite, got others in {missing.size} records (item {item} first); "
            "make the data set again."
        )
    dead = np.flatnonzero(table.column("constant_share").to_numpy() >= 1.0)
    if dead.size:
        item = table.column("item")[int(dead[0])].as_py()
        raise SignalError(
            f"all records of {path} must vary, got one value throughout in {dead.size} of them (item {item} first); "
            "check the sensor and make the data set without them."
        )


def manifest_sha256(place: Place) -> str:
    """SHA-256 of the manifest of a data set, by which models know what they were trained on."""
    return hashlib.sha256(place.read(MANIFEST) or b"").hexdigest()


def rows_sha256(manifest: Mapping[str, Any]) -> str | None:
    """SHA-256 of what makes item i of a simulated data set, whatever its length and shards: data sets with the same one
    have the same items as far as both go. None where the manifest does not tell."""
    config, family = manifest.get("config", {}), CAMPAIGNS.get(manifest["campaign"])
    settings = config.get("campaign")
    if family is None or not isinstance(settings, Mapping):
        return None
    if settings.get("posterior") and not settings.get("posterior_sha256"):
        return None  # the file may be another one now
    campaign = {key: value for key, value in settings.items() if key not in family.lengths}
    kept = {key: value for key, value in config.items() if key not in _NOT_OF_AN_ITEM} | {"campaign": campaign}
    told = {"campaign": manifest["campaign"], "seed": manifest["seed"], "config": kept}
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


def load_dataset(path: str | Path | Place) -> Dataset:
    """Data set from a folder or URL written by `datagen`.

    Raises SignalError for a folder that is none, for records that differ in rate, length, quantity or unit,
    for a machine draw in two subsets, for a record of a dead sensor or with samples that are not
    finite, and for a subset that lacks a class.
    """
    folder = open_place(path)
    data = read_shards(folder)
    table = data.table
    classes = table.column("class").to_numpy()
    subsets = np.array(table.column("subset").to_pylist())
    _check_no_leak(table.column("machine_draw").to_numpy(), subsets, folder)
    _check_sensors(data.records, table, folder)
    names, codes = (np.array(table.column(name).to_pylist()) for name in ("class_name", "code"))
    return Dataset(
        records=data.records,
        classes=classes,
        subsets=subsets,
        codes=CodeBook.of_rows(classes, names, codes),
        sample_rate=float(_one(table, "sample_rate", folder)),
        quantity=_one(table, "quantity", folder),
        unit=_one(table, "unit", folder),
        provenance={
            "folder": str(path),
            "manifest_sha256": manifest_sha256(folder),
            "rows_sha256": rows_sha256(data.manifest),
            "records": len(data),
            **{key: data.manifest[key] for key in ("campaign", "seed", "count")},
        },
        conditions=Conditions.of_rows(table, data.records, subsets),
        table=table,
    )
