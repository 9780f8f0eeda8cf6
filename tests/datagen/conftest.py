"""A small data set that all tests of a session share, and orders to vary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from omegaconf import OmegaConf

from datagen import pictures
from datagen.campaign import Base
from datagen.campaigns import make_campaign
from datagen.generate import generate
from datagen.order import Order
from datagen.schema import RECORD
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import config_dir, load_machine
from indexer_env.sensors import Sensor
from indexer_env.simulate import Run

SHORT = Run(samples=300, warmup_turns=1)
"""A third of a second is enough where the physics is not the matter."""


@pytest.fixture(scope="session", autouse=True)
def pictures_drawn_once() -> Iterator[None]:
    """Hundreds of data sets are made of the same few rows, and a picture depends on its row and title alone."""
    real, kept = pictures.picture, {}

    def picture(row: dict[str, Any], title: str) -> bytes:
        shown = ("sample_rate", "unit", "quantity", "source_channel")
        key = (np.asarray(row[RECORD]).tobytes(), title, *(str(row.get(name)) for name in shown))
        if key not in kept:
            kept[key] = real(row, title)
        return kept[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "picture", picture)
        yield


@pytest.fixture
def settings() -> dict[str, Any]:
    """The settings of campaign table2, free to change."""
    return _table2()


def _table2() -> dict[str, Any]:
    settings = OmegaConf.to_container(OmegaConf.load(config_dir() / "campaign" / "table2.yaml"))
    assert isinstance(settings, dict)
    return {str(key): value for key, value in settings.items()}


@pytest.fixture(scope="session")
def base() -> Base:
    sensor = Sensor(radius=0.4, lowpass_hz=200.0, noise_density=0.01)
    return Base(load_machine("reference"), OperatingPoint(), sensor=sensor)


@pytest.fixture(scope="session")
def order(base) -> Order:
    campaign = make_campaign(_table2())
    return Order(campaign, base, SHORT, count=20, seed=3, shard_items=8, config={"note": "test"})


@pytest.fixture(scope="session")
def dataset(order, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "set"
    generate(order, folder)
    return folder


@pytest.fixture
def tiny(order) -> Order:
    return replace(order, count=3)
