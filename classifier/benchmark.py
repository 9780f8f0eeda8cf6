"""The benchmark set: frozen items, three ways to split them, one line to load them.

    dataset = load_benchmark("benchmark-v1", split="fault_size")

    machine          validation holds machines that no other subset has seen
    operating_point  ... at a motor speed above all that teach: FASTEST_TAUGHT
    fault_size       ... whose faults are all smaller than those that teach: LARGE

The items, that is what every record is a record of, are drawn by `conf/campaign/benchmark-v1.yaml` and compared with
the digest published here. The samples follow from the simulator: a later version may change their last digits.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from classifier.conditions import Conditions
from classifier.dataset import Dataset, load_dataset
from classifier.tasks.severity import QUANTITIES
from datagen.order import Order
from datagen.recipes import Recipe, make, order_of
from indexer_env.checks import check_choice
from indexer_env.errors import refuse
from indexer_env.units import RPM

SEED = 0
FASTEST_TAUGHT = 1400.0
"""Motor speed [rpm] up to which records teach, where the split is by operating point; the set has 1200 to 1500."""

LARGE: Mapping[str, float] = {"backlash_deg": 6.0, "crack": 0.25, "looseness": 0.4}
"""Sizes from which faults teach, where the split is by their size: backlash in degrees at the motor shaft, the others
as shares. They part the drawn ones so that each class keeps records on both sides."""

BENCHMARKS: dict[str, str] = {
    "benchmark-v1": "e0f449ce2f7430226bb93d917c1b2deecad8567c79077ee06d4bcf4417d58f3e",
}
"""SHA-256 of the items (`digest`) by the name of the set."""


def load_benchmark(name: str = "benchmark-v1", split: str = "machine", folder: str | Path = "data") -> Dataset:
    """The records of a benchmark with calibration, control and validation subsets.

    Parameters
    ----------
    name : str
        One of BENCHMARKS.
    split : str
        One of SPLITS.
    folder : str or Path
        Where the data set is kept; it is made where it is not there.

    Returns
    -------
    Dataset
        Learn from `rows("calibration")`, choose settings by `rows("control")`, judge once on `rows("validation")`.

    Raises
    ------
    ParameterError
        Another name or split, or items that are not the published ones.
    """
    check_choice("load_benchmark", "name", name, BENCHMARKS)
    check_choice("load_benchmark", "split", split, SPLITS)
    recipe = recipe_of(name)
    found = digest(order_of(recipe, SEED))
    if found != BENCHMARKS[name]:
        rule = f"the published one, whose items have the digest {BENCHMARKS[name][:12]}…"
        raise refuse("load_benchmark", "name", rule, f"{name} with {found[:12]}…", "do not change its files in conf/")
    dataset = load_dataset(make(recipe, SEED, Path(folder)))
    return _split(dataset, split)


def recipe_of(name: str) -> Recipe:
    """The command that makes a benchmark."""
    return Recipe(name, (f"campaign={name}", "sensor=bench"))


def digest(order: Order) -> str:
    """SHA-256 of all items of an order: label, machine, operating point, faults, effects and sensor of each, numbers to
    ten digits, which no processor or library rounds differently."""
    whole = hashlib.sha256()
    for index in range(order.count):
        item = dataclasses.asdict(order.campaign.item(index, order.base, order.seed))
        whole.update(json.dumps(_rounded(item), sort_keys=True).encode())
    return whole.hexdigest()


def _rounded(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _rounded(below) for key, below in value.items()}
    return f"{value:.9e}" if isinstance(value, float) else value


def _split(dataset: Dataset, split: str) -> Dataset:
    """The data set with the subsets of a split; records that belong to none of them left out."""
    judges, teaches = SPLITS[split](dataset)
    validation = judges & (~teaches | (dataset.subsets == "validation"))
    rows = np.flatnonzero(validation | (teaches & (dataset.subsets != "validation")))
    subsets = np.where(validation, np.array("validation", dataset.subsets.dtype), dataset.subsets)[rows]
    table = dataset.table.take(rows)
    records = dataset.records[rows]
    return dataclasses.replace(
        dataset,
        records=records,
        classes=dataset.classes[rows],
        subsets=subsets,
        provenance={**dataset.provenance, "split": split, "records": len(rows)},
        conditions=Conditions.of_rows(table, records, subsets),
        table=table,
    )


def _by_machine(dataset: Dataset) -> tuple[np.ndarray, np.ndarray]:
    everywhere = np.ones(len(dataset.classes), bool)
    return everywhere, everywhere


def _by_operating_point(dataset: Dataset) -> tuple[np.ndarray, np.ndarray]:
    fast = dataset.table.column("motor_speed").to_numpy() > FASTEST_TAUGHT * RPM
    return fast, ~fast


def _by_fault_size(dataset: Dataset) -> tuple[np.ndarray, np.ndarray]:
    sizes = {name: QUANTITIES[name].factor * dataset.table.column(QUANTITIES[name].column).to_numpy() for name in LARGE}
    small = np.all([sizes[name] < least for name, least in LARGE.items()], axis=0)
    large = np.all([(sizes[name] == 0.0) | (sizes[name] >= least) for name, least in LARGE.items()], axis=0)
    return small, large


SPLITS: dict[str, Callable[[Dataset], tuple[np.ndarray, np.ndarray]]] = {
    "machine": _by_machine,
    "operating_point": _by_operating_point,
    "fault_size": _by_fault_size,
}
"""Masks (n,) of the records that may judge and of those that may teach; those of both do as the subset of
their machine says. Each machine has one record."""
