"""Data sets that the benchmarks read, made once and kept in .cache/."""

from __future__ import annotations

from pathlib import Path

from datagen.campaign import Base
from datagen.campaigns import make_campaign
from datagen.generate import generate
from datagen.order import Order
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_sensor, load_yaml

CACHE = Path(__file__).parent / ".cache"


def data_set(sensor: str, count: int) -> Path:
    """Folder of a data set of campaign table2, seed 0, one turn a record, read by a sensor of conf/sensor."""
    base = Base(load_machine("reference"), OperatingPoint(), sensor=load_sensor(sensor))
    order = Order(make_campaign(load_yaml("campaign", "table2")), base, count=count)
    folder = CACHE / f"table2-{sensor}-{count}"
    generate(order, folder, overwrite=True)
    return folder
