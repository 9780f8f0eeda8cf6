"""Data sets of experiments: each is a command line of `datagen`, made once and kept."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from datagen.campaign import SUBSETS
from datagen.generate import generate
from datagen.order import order_from
from datagen.shard import read_shards
from indexer_env.presets import config_dir


@dataclass(frozen=True)
class Recipe:
    """A kind of data set; its seed is given when it is made.

    name       of its folders
    overrides  arguments of ``indexer generate``
    """

    name: str
    overrides: tuple[str, ...]

    def command(self, seed: int) -> str:
        """The command line that makes the same data set."""
        quoted = (f"'{part}'" if set(part) & set("[]{} +~") else part for part in self.overrides)
        return f"indexer generate {' '.join(quoted)} seed={seed}"


@dataclass(frozen=True, eq=False)
class Labelled:
    """Records with what a network is to say of them.

    records      (n, samples) float32
    targets      (n, bits) in [0, 1]
    subsets      calibration, control and validation: a mask (n,) of the rows of each
    sample_rate  [Hz]
    """

    records: np.ndarray
    targets: np.ndarray
    subsets: Mapping[str, np.ndarray]
    sample_rate: float


def make(recipe: Recipe, seed: int, folder: Path) -> Path:
    """The data set of a recipe in a folder below `folder`; one that is there is not made again.

    Raises as `datagen.generate.generate` does.
    """
    # Within a command Hydra stands on the same folder already.
    standing = GlobalHydra.instance().is_initialized()
    with contextlib.nullcontext() if standing else initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("generate", [*recipe.overrides, f"seed={seed}", "out=."]), resolve=True)
    assert isinstance(config, dict)
    place = folder / f"{recipe.name}-{seed}"
    generate(order_from({str(key): value for key, value in config.items()}), place)
    return place


def read(folder: Path) -> tuple[np.ndarray, pa.Table, float]:
    """Records, all other columns and the sample rate [Hz] of a data set."""
    data = read_shards(folder)
    return data.records, data.table, float(data.table.column("sample_rate")[0].as_py())


def column(table: pa.Table, name: str) -> np.ndarray:
    """One column (n,)."""
    return np.array(table.column(name).to_pylist())


def labelled_by_code(folder: Path) -> Labelled:
    """Records of a data set with the bits of their classes as targets."""
    records, table, rate = read(folder)
    targets = np.array([[float(bit) for bit in code] for code in column(table, "code")])
    return Labelled(records, targets, masks(table), rate)


def masks(table: pa.Table) -> dict[str, np.ndarray]:
    """The rows (n,) of each subset."""
    subsets = column(table, "subset")
    return {subset: subsets == subset for subset in SUBSETS}
