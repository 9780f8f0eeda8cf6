"""Data sets as command lines of `indexer generate`, made once and kept."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass
from pathlib import Path

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from datagen.generate import generate
from datagen.order import Order, order_from
from indexer_cli.places import StoreError
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


def make(recipe: Recipe, seed: int, folder: Path) -> Path:
    """The data set of a recipe in a folder below `folder`; one that is there is not made again.

    Raises as `datagen.generate.generate` does.
    """
    place = folder / f"{recipe.name}-{seed}"
    try:
        generate(order_of(recipe, seed), place)
    except StoreError as error:
        # the commands that keep data sets have an `out` and an `overwrite` of their own
        if "overwrite=true" not in str(error):
            raise StoreError(re.sub("^out ", "data ", str(error))) from None
        what = str(error).removeprefix("out ").partition("; ")[0]
        raise StoreError(f"{what}; delete it, or name another folder for the data.") from None
    return place


def order_of(recipe: Recipe, seed: int) -> Order:
    """The order of a recipe. Raises ParameterError as `datagen.order.order_from` does."""
    # Within a command Hydra stands on the same folder already.
    standing = GlobalHydra.instance().is_initialized()
    with contextlib.nullcontext() if standing else initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("generate", [*recipe.overrides, f"seed={seed}", "out=."]), resolve=True)
    assert isinstance(config, dict)
    return order_from({str(key): value for key, value in config.items()})
