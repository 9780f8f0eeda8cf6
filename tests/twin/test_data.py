"""Simulated turns that networks learn from."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.campaigns.own import LOAD_FACTOR
from indexer_env import Sensor
from tests.twin.builders import CELLS, MACHINE, healthy
from twin.data import OWN_LOAD, made, order_of, points_of
from twin.faults import chosen

UNCERTAINTY = 0.1


def test_a_turn_has_the_point_that_it_was_simulated_for(tmp_path: Path):
    """At one speed only the load tells points apart, and the simulated one is not the stated one."""
    posterior, points, faults = (
        tmp_path / "posterior.parquet",
        points_of((1400.0, 1400.0), (2.0, 20.0), 0),
        chosen(["crack"]),
    )
    pq.write_table(pa.table({LOAD_FACTOR: [0.94]}), posterior)
    order = order_of(posterior, faults, points, MACHINE, Sensor(), CELLS, UNCERTAINTY, 40, 1)
    turns = made(order, faults, healthy(), points)
    for index, place in enumerate(turns.point):
        load = order.campaign.item(index, order.base, order.seed).operating_point["load_torque"]
        own = 3.0**0.5 * OWN_LOAD * UNCERTAINTY
        assert load / (0.94 * points[place].load_torque) == pytest.approx(1.0, abs=1.01 * own)
