"""Orders of the campaigns' families with short records, their items and what these make."""

from __future__ import annotations

from typing import Any

import numpy as np
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from datagen.order import Order, order_from
from datagen.produce import produce
from indexer_env.presets import config_dir

SHORT = ["run.samples=300", "run.warmup_turns=0"]


def ordered(*overrides: str) -> Order:
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("generate", ["out=x", *overrides]))
    assert isinstance(config, dict)
    return order_from({str(key): value for key, value in config.items()})


def items_of(order: Order, count: int | None = None) -> list[Any]:
    return [order.campaign.item(index, order.base, order.seed) for index in range(count or order.count)]


def made(order: Order, indices: list[int]) -> tuple[list[dict[str, Any]], np.ndarray]:
    rows, records, rejected = produce(order, [order.campaign.item(i, order.base, order.seed) for i in indices])
    assert not rejected, rejected[0]["reason"]
    return rows, records
