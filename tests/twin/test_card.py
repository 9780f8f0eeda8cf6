"""What twin.yaml says of the networks, and the turns of healthy records."""

from __future__ import annotations

import numpy as np

from discrepancy.indexer import Experiment
from indexer_env import OperatingPoint, Run, Signal, simulate
from indexer_env.units import RPM
from tests.twin.builders import MACHINE, NOISE, RATE, healthy
from tests.twin.test_judge import turns
from twin.card import scores, turns_of


def test_with_one_fault_in_the_table_there_is_no_score_of_several():
    part = turns(12, 1, faulty=True)
    told = {"faults": np.where(part.there, 3.0, -3.0)}
    assert scores(told, np.arange(12), part) == {"all": 1.0, "healthy": None, "one": 1.0, "several": None}


def test_a_healthy_record_is_cut_by_its_own_clock():
    """0.09 % faster than that of the first record."""
    point, rate = OperatingPoint(1400.0 * RPM, 5.0, 3.0), 1.0009 * RATE
    run = Run(rate, int(2.1 * MACHINE.turn_duration(point) * rate), warmup_turns=1)
    record = Signal(simulate(MACHINE, point, run).table_acceleration, rate, unit="rad/s^2")
    found = turns_of(Experiment(record, point), healthy())
    assert len(found) == 2 and np.abs(found - healthy().turn(point)).max() < 0.6 * NOISE
