"""A machine with the user's own table law under control: the table says where its dwell is."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import ParameterError
from indexer_env.env import IndexerEnv
from indexer_env.kernels.control import DWELL_BEGIN
from indexer_env.motion_law import Cycloidal, TableLaw
from indexer_env.scenario import Scenario


def _table(machine, begin):
    """The machine with a table law that moves over 120 degrees from `begin` [deg] on, which is not its motion_share."""
    angles = np.radians(np.arange(361.0))
    rise = Cycloidal().evaluate(angles - math.radians(begin), machine.stations, 1.0 / 3.0)[0]
    return dataclasses.replace(machine, motion_law=TableLaw(tuple(angles), tuple(rise)))


def test_a_table_that_dwells_elsewhere_than_at_the_turn_s_end(smooth):
    said = r"^IndexerEnv\.machine must be one that moves once a cam turn.* from 90 to 210 deg'; shift the cam angles"
    with pytest.raises(ParameterError, match=said):
        IndexerEnv(machine=_table(smooth, 90.0))
    with pytest.raises(ParameterError, match=said):
        IndexerEnv().reset(options={"machine": _table(smooth, 90.0)})


def test_a_table_says_itself_where_its_dwell_begins(smooth):
    machine = _table(smooth, 0.0)
    scenario = Scenario.of(machine, "reference", None, "environment", {})
    angles = [scenario.draw(np.random.default_rng(seed)).operating_point.start_angle for seed in range(40)]
    phases = np.degrees(angles)
    assert 120.0 <= phases.min() < 150.0 and 330.0 < phases.max() <= 360.0
    env = IndexerEnv(machine=machine)
    env.reset(seed=0)
    assert math.degrees(env._fleet._items[0, DWELL_BEGIN]) == pytest.approx(120.0)
