"""A turn by cam angle: cells and shifts."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import Faults, OperatingPoint, Sensor
from indexer_env.units import RPM
from tests.twin.builders import CELLS, MACHINE, NOISE, RATE, healthy, record
from twin import turns as module
from twin.turns import Cells, Healthy, shift_shapes, without_shift

TURN = 2.0 * math.pi


def wave(start: float, cam_rate: float, samples: int) -> np.ndarray:
    angle = start + cam_rate / RATE * np.arange(samples)
    return np.sin(angle) + 0.5 * np.cos(3.0 * angle / 8.0)


@pytest.mark.parametrize("start", [0.0, 1.234, 17.0, -3.0])
def test_a_turn_is_the_same_wherever_its_record_begins(start):
    cam_rate = 6.0
    samples = math.ceil(8 * TURN / cam_rate * RATE) + 2
    (turn,) = CELLS.turns(wave(start, cam_rate, samples), cam_rate, start)
    middle = (np.arange(8 * CELLS.count) + 0.5) * TURN / CELLS.count
    expected = (np.sin(middle) + 0.5 * np.cos(3.0 * middle / 8.0)).reshape(8, -1)
    np.testing.assert_allclose(turn, expected, atol=2e-3)


def test_a_record_holds_as_many_turns_as_are_whole():
    samples = math.ceil(8 * TURN / 6.0 * RATE)
    assert [len(CELLS.turns(np.ones(int(k * samples)), 6.0, 1.0)) for k in (0.9, 1.01, 2.5)] == [0, 1, 2]


def test_a_measured_turn_of_the_healthy_machine_is_the_simulated_one():
    signal, told = record(turns=1.2)
    sound = healthy()
    cam_rate = sound.machine.reduction * told.motor_speed
    (turn,) = CELLS.turns(signal.values, cam_rate, told.start_angle)
    reference = sound.turn(OperatingPoint(told.motor_speed, told.load_torque))
    assert np.abs(turn - reference).max() < 1e-2 * np.abs(reference).max()


def test_a_turn_begins_when_the_start_is_forgotten(monkeypatch):
    point = OperatingPoint(
        TURN / (MACHINE.reduction * 1.1), 5.0
    )  # whole samples in a cam turn: all leads read the same
    loose = dataclasses.replace(healthy(), machine=Faults(screw_looseness=0.5).applied_to(MACHINE))
    turns = []
    for lead in (module._LEAD, 16, 1):
        monkeypatch.setattr(module, "_LEAD", lead)
        turns.append(dataclasses.replace(loose).turn(point))
    usual, late, early = turns
    assert np.abs(usual - late).max() < 0.05 * NOISE < np.abs(early - late).max()


def test_turns_of_many_points_are_those_of_each():
    sound = healthy()
    points = [OperatingPoint(rpm * RPM, load) for rpm, load in ((1200.0, 2.0), (1500.0, 20.0))]
    for turn, point in zip(sound.turns(points), points, strict=True):
        np.testing.assert_allclose(turn, sound.turn(point), atol=1e-3)


def test_a_shift_is_taken_out_and_what_is_no_shift_stays():
    reference = healthy().turn(OperatingPoint())
    shapes = shift_shapes(reference, 0.002)
    shifted = 1.5 * shapes[0] - 0.7 * shapes[1]
    other = NOISE * np.random.default_rng(1).standard_normal(reference.shape)
    assert np.abs(without_shift(shifted, shapes, 1e-3 * NOISE)).max() < 1e-3 * np.abs(shifted).max()
    assert np.std(without_shift(other, shapes, NOISE)) > 0.95 * np.std(other)


def test_what_does_not_repeat_has_no_part_in_the_healthy_turn():
    """A sensor stated with noise, a range, hum and drift reads the machine as one without; its gain is its own."""
    stated = Sensor(gain=1.1, noise_density=0.1, full_scale=100.0, bits=12, hum_amplitude=1.0, offset_drift=0.5)
    turn = Healthy(MACHINE, stated, CELLS).turn(OperatingPoint())
    np.testing.assert_array_equal(turn, Healthy(MACHINE, Sensor(gain=1.1), CELLS).turn(OperatingPoint()))


def test_a_turn_is_read_along_the_cam_in_a_circle():
    cells = Cells(8, 64, 500.0)
    middles = (np.arange(8 * 64) + 0.5) * 2.0 * np.pi / 64
    turn = np.sin(middles / 8.0).reshape(8, 64)
    angle = np.random.default_rng(0).uniform(-200.0, 200.0, 500)
    np.testing.assert_allclose(cells.along(turn, angle), np.sin(angle / 8.0), atol=1e-4)
