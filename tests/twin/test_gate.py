"""What cannot be compared with a twin is refused in a sentence."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from indexer_env import Joint, OperatingPoint, Run, Sensor, Signal, SignalError, make_effect, simulate
from indexer_env.units import RPM
from indexer_records.resample import CUTOFF
from tests.twin.builders import MACHINE, RATE, healthy, record, view
from twin.gate import Gate

GATE = Gate(healthy(), view())


def changed(signal: Signal, **changes) -> Signal:
    given = {"values": signal.values, "sample_rate": signal.sample_rate, "unit": signal.unit, "source": signal.source}
    return Signal(**{**given, **changes})


def test_a_turn_of_this_machine_passes_and_its_start_is_found_where_it_is_not_stated():
    signal, told = record()
    x, seen = GATE.looked(signal, told)
    assert x.shape == (1, 8, 64) and seen.stations_known and seen.point.load_torque == 5.0 and seen.notes == ()
    assert size(x) < 0.3
    _, seen = GATE.looked(signal, dataclasses.replace(told, inertia_uncertainty=0.1))
    assert "is for physics alone" in seen.notes[0]
    found, seen = GATE.looked(signal, dataclasses.replace(told, start_angle=None))
    assert not seen.stations_known and size(found) < 0.5


def test_a_record_of_unknown_station_is_compared_with_the_station_that_it_is_like():
    """An imbalance makes every station's turn another one; without its stations the machine would look faulty."""
    heavy = MACHINE.with_effects(make_effect("load.imbalance", torque=90.0, phase=1.0))
    gate = Gate(dataclasses.replace(healthy(), machine=heavy), view())
    for station in (0, 3, 5):
        signal, told = record(heavy, start=3.0 + 2.0 * np.pi * station)
        x, seen = gate.looked(signal, dataclasses.replace(told, start_angle=None))
        assert not seen.stations_known and size(x) < 0.5
        assert seen.conditions.start_angle == pytest.approx(3.0 + 2.0 * np.pi * station, abs=0.02)


@pytest.mark.parametrize("off", [0.04, 0.25])
def test_a_start_that_is_stated_roughly_is_told_by_the_record_and_its_station_as_stated(off):
    signal, told = record(start=3.0 + 2.0 * np.pi * 5)
    rough = dataclasses.replace(told, start_angle=told.start_angle + off, start_uncertainty=0.1)
    x, seen = GATE.looked(signal, rough)
    assert seen.stations_known and size(x) < 0.5 and "stated less exactly than the record" in seen.notes[0]
    assert seen.conditions.start_angle == pytest.approx(told.start_angle, abs=0.02)
    assert seen.conditions.start_uncertainty == 0.01


def size(x: np.ndarray) -> float:
    return float(np.sqrt((x**2).mean()))


@pytest.mark.parametrize("stated", [1401.0, 1407.0, 1420.0])
def test_a_speed_that_is_stated_slightly_wrong_is_put_right_by_the_record(stated):
    signal, told = record()
    x, seen = GATE.looked(signal, dataclasses.replace(told, motor_speed=stated * RPM, start_angle=None))
    assert seen.point.motor_speed / RPM == pytest.approx(1400.0, abs=0.3) and size(x) < 1.5
    rpm = seen.point.motor_speed / RPM
    by_record = f"today.csv: the mean speed is {rpm:.2f} rpm by the record, {stated:.2f} stated"
    assert seen.notes[0] == by_record and "so that no station can be told" in seen.notes[1]


def test_a_speed_that_is_another_is_refused():
    signal, told = record()
    other = dataclasses.replace(told, motor_speed=1450.0 * RPM)
    refused("must be that of the record within 2%.* 1400 rpm by the record", signal, other)


def test_a_record_of_the_other_sign_is_turned_round():
    signal, told = record()
    x, seen = GATE.looked(changed(signal, values=-signal.values), told)
    assert size(x) < 0.3 and "its sign is put right" in seen.notes[0]


def test_a_faster_record_is_read_at_the_rate_of_the_twin():
    point = OperatingPoint(1400.0 * RPM, 5.0, 3.0)
    run = Run(4 * RATE, int(4.4 * MACHINE.turn_duration(point) * RATE), warmup_turns=1)
    fast = Signal(simulate(MACHINE, point, run).table_acceleration, 4 * RATE, unit="rad/s^2")
    x, seen = GATE.looked(fast, dataclasses.replace(record()[1], noise=0.4))
    assert seen.signal.sample_rate == RATE and size(x) < 0.5
    # white noise loses what lies above the filter's edge
    assert seen.conditions.noise == pytest.approx(0.4 * np.sqrt(CUTOFF / 2.0), rel=0.01)


@pytest.mark.parametrize("share", [1.0009, 0.9991, 1.0015])
def test_a_record_is_read_by_its_own_clock(share):
    """Within 0.1 % of the twin's rate it is not resampled."""
    point = OperatingPoint(1400.0 * RPM, 5.0, 3.0)
    run = Run(share * RATE, int(1.1 * MACHINE.turn_duration(point) * share * RATE), warmup_turns=1)
    signal = Signal(simulate(MACHINE, point, run).table_acceleration, share * RATE, unit="rad/s^2", source="today.csv")
    x, _ = GATE.looked(signal, record()[1])
    assert size(x) < 0.3


@pytest.mark.parametrize("stated", [0.0, 2.0])
def test_an_offset_that_the_sensor_has_today_is_taken_out(stated):
    """Five times the noise of a cell, beside what the twin's sensor reads at rest; seed 0."""
    sensor = Sensor(offset=stated)
    gate = Gate(dataclasses.replace(healthy(), sensor=sensor), view())
    signal, told = record()
    noisy = signal.values + stated + 0.1 * np.random.default_rng(0).standard_normal(len(signal.values))
    for start in (3.0, None):
        x, seen = gate.looked(changed(signal, values=noisy + 0.5), dataclasses.replace(told, start_angle=start))
        assert size(x) < 0.6 and "at rest; its offset is taken out" in seen.notes[0]
    assert gate.looked(changed(signal, values=noisy), told)[1].notes == ()


def test_the_pulse_tells_start_and_speed():
    """Two pulses, at cam angles of 4 rad and a table turn more; the speed is stated 1 % too high."""
    signal, told = record(turns=1.3)
    cam_rate = MACHINE.reduction * 1400.0 * RPM
    pulses = (np.array([4.0, 4.0 + 16.0 * np.pi]) - 3.0) / cam_rate
    told = dataclasses.replace(told, motor_speed=1414.0 * RPM, start_angle=None, pulse_angle=4.0)
    x, seen = GATE.looked(signal, told, pulses)
    assert seen.stations_known and seen.conditions.start_angle == pytest.approx(3.0, abs=1e-6) and size(x) < 0.3
    with pytest.raises(SignalError, match="correct start_angle or pulse_angle"):
        GATE.looked(signal, dataclasses.replace(told, pulse_angle=None), pulses)


def refused(said: str, signal: Signal, told) -> None:
    with pytest.raises(SignalError, match=said):
        GATE.looked(signal, told)


def test_each_reason_has_its_sentence():
    signal, told = record()
    refused("must be in rad/s", changed(signal, unit="m/s^2"), told)
    refused("sampled at the twin's 500 Hz or more, got 250 Hz", changed(signal, sample_rate=250.0), told)
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
    level = r"times as strong as this machine's records \(0\.5 to 2 allowed\); check its unit, its sensor's radius"
    refused(rf"today\.csv is 9\.8\d {level}", changed(signal, values=9.81 * signal.values), told)
    late = dataclasses.replace(told, start_angle=told.start_angle + 0.3)
    refused("cam angle at the first sample must agree .* got 0.3", signal, late)


def test_another_machine_is_refused():
    slow = dataclasses.replace(MACHINE, output_joint=Joint(2000.0, 5.0))
    refused(r"does not move as this machine does: .* \d\d(\.\d)? % alike \(90 or more allowed\)", *record(slow))


def test_an_operating_point_of_a_twin_for_one_point_is_that_point():
    of_one = dataclasses.replace(view(), loads=(10.0, 0.0))
    gate = Gate(healthy(), of_one)
    signal, told = record(load=10.1)
    gate.looked(signal, told)
    near = [OperatingPoint(1400.0 * RPM, load) for load in (9.8, 10.0, 10.1)]
    assert of_one.conditions(near)[:, 1].tolist() == [0.0, 0.0, 0.0], "networks were taught no other load"
    signal, told = record(load=12.0)
    with pytest.raises(SignalError, match="within the twin's 10 to 10 N m"):
        gate.looked(signal, told)


def test_beside_the_range_networks_see_its_end():
    narrow = dataclasses.replace(view(), speeds=(1490.0 * RPM, 10.0 * RPM))
    speeds = [OperatingPoint(rpm * RPM, 15.0) for rpm in (1470.0, 1485.0, 1515.0)]
    assert narrow.conditions(speeds).tolist() == [[-1.0, 0.5], [-0.5, 0.5], [1.0, 0.5]]
