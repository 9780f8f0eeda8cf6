"""What cannot be compared with a twin is refused in a sentence."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from indexer_env import Joint, Signal, SignalError
from tests.twin.builders import MACHINE, RANGE, RATE, healthy, record, view
from twin.gate import Gate

GATE = Gate(healthy(), view(), RANGE)


def changed(signal: Signal, **changes) -> Signal:
    given = {"values": signal.values, "sample_rate": signal.sample_rate, "unit": signal.unit, "source": signal.source}
    return Signal(**{**given, **changes})


def test_a_turn_of_this_machine_passes_and_its_start_is_found_where_it_is_not_stated():
    signal, told = record()
    x, point, known = GATE.looked(signal, told)
    assert x.shape == (1, 8, 64) and known and point.load_torque == 5.0
    assert np.sqrt((x**2).mean()) < 0.3
    found, _, known = GATE.looked(signal, dataclasses.replace(told, start_angle=None))
    assert not known and np.sqrt((found**2).mean()) < 0.5


def refused(said: str, signal: Signal, told) -> None:
    with pytest.raises(SignalError, match=said):
        GATE.looked(signal, told)


def test_each_reason_has_its_sentence():
    signal, told = record()
    refused("must be in rad/s", changed(signal, unit="m/s^2"), told)
    refused("sampled at the twin's 500 Hz, got 250 Hz", changed(signal, sample_rate=250.0), told)
    dead = signal.values.copy()
    dead[500:1500] = 0.0
    refused("must vary throughout", changed(signal, values=dead), told)
    top = 0.93 * np.abs(signal.values).max()
    refused("inside the sensor's range", changed(signal, values=np.clip(signal.values, -top, top)), told)
    top = 0.1 * np.abs(signal.values).max()
    refused("inside the sensor's range", changed(signal, values=np.clip(signal.values, -top, top)), told)
    refused("must vary throughout", changed(signal, values=np.full_like(signal.values, top)), told)
    refused("motor speed must lie within the twin's 1200 to 1500 rpm, got 1600", *record(rpm=1600.0))
    refused("load must lie within the twin's 0 to 20 N m, got 30", *record(load=30.0))
    refused(r"a whole turn of the table, got 0\.9", *record(turns=0.9))
    refused("must look like the twin's machine", changed(signal, values=9.81 * signal.values), told)
    late = dataclasses.replace(told, start_angle=told.start_angle + 0.3)
    refused("cam angle at the first sample must agree .* got 0.3", signal, late)


def test_another_machine_is_refused():
    slow = dataclasses.replace(MACHINE, output_joint=Joint(2000.0, 5.0))
    refused("must look like the twin's machine", *record(slow))


def test_an_operating_point_of_a_twin_for_one_point_is_that_point():
    gate = Gate(healthy(), view(), {**RANGE, "load_torque": [10.0, 10.0]})
    signal, told = record(load=10.1)
    gate.looked(signal, told)
    signal, told = record(load=12.0)
    with pytest.raises(SignalError, match="within the twin's 10 to 10 N m"):
        gate.looked(signal, told)
    assert gate.healthy.cells.rate == RATE
