"""Simulated turns that networks learn from."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.campaigns.own import LOAD_FACTOR
from indexer_env import Sensor
from indexer_env.effects import SensorEffect
from tests.twin.builders import CELLS, MACHINE, healthy
from twin.data import OWN_LOAD, made, order_of, points_of, untaught
from twin.faults import chosen
from twin.posterior import simulated
from twin.synthesis import effect_of

UNCERTAINTY, GAIN = 0.1, chosen(["sensor_gain"])


def test_a_wrong_gain_is_the_same_in_the_data_and_in_what_is_fitted(tmp_path: Path):
    """Of a sensor whose gain was found to be 6 % off."""
    posterior, points, faults = tmp_path / "posterior.parquet", points_of((1400.0,) * 2, (2.0,) * 2, 0), GAIN
    drawn = {"effects.sensor.gain.error": np.array([0.06]), "sensor.gain": np.array([1.0])}
    pq.write_table(pa.table(simulated(drawn)), posterior)
    sensor = Sensor(gain=1.06)
    order = order_of(posterior, faults, points, MACHINE, sensor, CELLS, UNCERTAINTY, 12, 1, how_many=(0.0, 1.0))
    sound = dataclasses.replace(healthy(), sensor=sensor)
    turns = made(order, faults, sound, points)
    for x, (size,) in zip(turns.x, turns.size, strict=True):
        effect = effect_of(faults[0], float(size), MACHINE, 0.0, 0, sensor=sensor)
        assert isinstance(effect, SensorEffect)
        wanted = (effect.extend_sensor(sensor).gain / sensor.gain - 1.0) * turns.reference[0]
        assert np.abs(x - wanted).max() < 1e-2 * np.abs(turns.reference).max() * max(abs(size), 0.01)


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


def test_a_posterior_of_one_machine_has_that_one_for_the_alarm(tmp_path: Path) -> None:
    pq.write_table(pa.table({"machine.table_inertia": [5.0]}), tmp_path / "posterior.parquet")
    kept = pq.read_table(untaught(tmp_path / "posterior.parquet", tmp_path / "untaught.parquet"))
    assert kept.to_pydict() == {"machine.table_inertia": [5.0]}


def test_healthy_turns_for_the_alarm_are_of_machines_that_no_network_learned(tmp_path: Path) -> None:
    pq.write_table(pa.table({"machine.table_inertia": np.arange(40.0)}), tmp_path / "posterior.parquet")
    kept = pq.read_table(untaught(tmp_path / "posterior.parquet", tmp_path / "data" / "untaught.parquet"))
    known = [float(value) for value in kept.column("machine.table_inertia").to_pylist()]
    points, faults = points_of((1400.0,) * 2, (2.0,) * 2, 0), chosen(["crack"])
    order = order_of(tmp_path / "posterior.parquet", faults, points, MACHINE, Sensor(), CELLS, UNCERTAINTY, 40, 1)
    subset = [order.campaign.item(k, order.base, 1).label.subset for k in range(40)]
    assert known == [float(k) for k in range(40) if subset[k] == "control"] and len(known) == 10
