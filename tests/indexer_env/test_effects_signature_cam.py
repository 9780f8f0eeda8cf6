"""Errors of the cam and cracked rollers show at their place on the cam or at their station, and nowhere when off."""

import dataclasses
import functools
import math

import numpy as np
import pytest

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate

POINT = OperatingPoint()
CHANNELS = (
    "cam_angle", "cam_rate", "table_angle", "table_acceleration", "deflection_2", "deflection_rate_2", "torque_2",
)  # fmt: skip
STATION = 1025
"""Samples of one cam turn at 1 kHz."""
DWELL_END = slice(int(0.9 * STATION), STATION)


@functools.lru_cache(maxsize=64)
def turn_of(machine: Machine) -> dict[str, np.ndarray]:
    """One settled table turn at 1 kHz."""
    trajectory = simulate(machine, POINT, Run(warmup_turns=4, channels=CHANNELS))
    assert trajectory.warmup is not None and trajectory.warmup.settled
    return trajectory.channels


@functools.lru_cache(maxsize=64)
def first_turn_of(machine: Machine) -> dict[str, np.ndarray]:
    """The first table turn from rest on the law, at 1 kHz."""
    return simulate(machine, POINT, Run(warmup_turns=0, channels=CHANNELS)).channels


def law_error(machine: Machine, record: dict[str, np.ndarray]) -> np.ndarray:
    """How far the follower is from the law at this cam angle [rad]: φ - δ2 - β(α)."""
    beta, _, _ = machine.motion_law.evaluate(record["cam_angle"], machine.stations, machine.motion_share)
    return record["table_angle"] - record["deflection_2"] - beta


def by_station(values: np.ndarray) -> np.ndarray:
    return values.reshape(8, STATION)


# -------------------------------------------------------------------------------- profile error


@pytest.mark.parametrize(("centre", "half_width"), [(0.25, 0.05), (0.0, 0.1), (0.95, 0.2)])
def test_a_profile_error_is_a_bump_at_its_place_in_every_cam_turn(smooth, visible, centre, half_width):
    machine = smooth.with_effects(visible("cam.profile_error", centre=centre, half_width=half_width))
    record = turn_of(machine)
    phase = record["cam_angle"] / (2.0 * math.pi)
    y = ((phase - centre + 0.5) % 1.0 - 0.5) / half_width
    bump = np.where(np.abs(y) < 1.0, (1.0 - y**2) ** 4, 0.0)
    np.testing.assert_allclose(law_error(machine, record), 1e-3 * bump, rtol=0, atol=1e-9)
    assert np.abs(law_error(smooth, turn_of(smooth))).max() < 1e-9


def test_a_profile_error_shows_alike_at_every_station(smooth, visible):
    record, plain = turn_of(smooth.with_effects(visible("cam.profile_error"))), turn_of(smooth)
    added = by_station(record["table_acceleration"] - plain["table_acceleration"])
    assert np.abs(added).max() > 1.0
    np.testing.assert_allclose(added, np.broadcast_to(added[0], added.shape), rtol=0, atol=1e-4)


def test_the_rates_of_a_bump_are_the_derivatives_of_its_height(smooth, visible):
    """δ̇2 = φ̇ - (β' + bump') α̇ is the rate of the recorded δ2, by central differences."""
    record = turn_of(smooth.with_effects(visible("cam.profile_error")))
    slope = (record["deflection_2"][2:] - record["deflection_2"][:-2]) * 500.0
    scale = np.abs(slope).max()
    np.testing.assert_allclose(record["deflection_rate_2"][1:-1], slope, rtol=0, atol=0.01 * scale)


# -------------------------------------------------------------------------------- station spacing


@pytest.mark.parametrize("station", [1, 5, 0])
def test_a_misplaced_station_alone_stands_off(smooth, visible, station):
    error = 0.02
    machine = smooth.with_effects(visible("cam.station_spacing", error=error, station=station))
    stands = [by_station(turn_of(m)["table_angle"])[:, DWELL_END].mean(axis=1) for m in (machine, smooth)]
    expected = np.zeros(8)
    expected[(station - 1) % 8] = error  # cam turn n ends in the dwell at station n + 1
    np.testing.assert_allclose(stands[0] - stands[1], expected, rtol=0, atol=2e-5)


def test_a_misplaced_station_lengthens_one_index_and_shortens_the_next(smooth, visible):
    machine = smooth.with_effects(visible("cam.station_spacing", error=0.02, station=3))
    record = turn_of(machine)
    beta, _, _ = machine.motion_law.evaluate(record["cam_angle"], 8, 0.5)
    turn = np.floor(record["cam_angle"] / (2.0 * math.pi)) % 8.0
    rise = beta - math.pi / 4.0 * np.floor(record["cam_angle"] / (2.0 * math.pi))
    share = rise / (math.pi / 4.0)
    expected = np.select([turn == 2.0, turn == 3.0], [0.02 * share, 0.02 * (1.0 - share)], 0.0)
    np.testing.assert_allclose(law_error(machine, record), expected, rtol=0, atol=1e-9)


def test_station_spacing_is_felt_at_its_two_indexes_first(smooth, visible):
    machine = smooth.with_effects(visible("cam.station_spacing", error=0.02, station=3))
    added = by_station(first_turn_of(machine)["table_acceleration"] - first_turn_of(smooth)["table_acceleration"])
    assert np.abs(added[:2]).max() < 1e-9
    assert np.abs(added[2]).max() > 0.3 and np.abs(added[3]).max() > 0.3
    assert np.abs(added[5:]).max() < 0.1 * np.abs(added[3]).max()


# -------------------------------------------------------------------------------- cracked rollers


@pytest.mark.parametrize("ratio", [1.0, 0.8])
def test_cracked_rollers_soften_one_sense_at_every_station(smooth, visible, ratio):
    joint = dataclasses.replace(smooth.output_joint, stiffness_ratio=ratio)
    machine = dataclasses.replace(smooth, output_joint=joint).with_effects(visible("roller.crack"))
    r = turn_of(machine)
    stiffness = np.where(r["deflection_2"] > 0.0, 1.0, ratio * 0.6) * joint.stiffness
    expected = stiffness * r["deflection_2"] + joint.damping * r["deflection_rate_2"]
    np.testing.assert_allclose(r["torque_2"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(
        by_station(r["table_acceleration"]), np.broadcast_to(by_station(r["table_acceleration"])[0], (8, STATION)),
        rtol=0, atol=1e-4,
    )  # fmt: skip


def test_cracked_rollers_lower_the_ringing_in_the_dwell(smooth, visible):
    """The zero crossings of φ̈ come with the mean of the two half periods, π/ω (1 + 1/√ρ) a period."""
    severity = 0.4

    def period(machine: Machine) -> float:
        values = by_station(turn_of(machine)["table_acceleration"])[0, int(0.55 * STATION) : int(0.95 * STATION)]
        up = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
        crossings = up - values[up] / (values[up + 1] - values[up])
        return float(np.diff(crossings).mean()) / 1000.0

    plain, cracked = period(smooth), period(smooth.with_effects(visible("roller.crack", stiffness_loss=severity)))
    assert plain == pytest.approx(1.0 / 15.0, rel=0.01)
    assert cracked / plain == pytest.approx(0.5 * (1.0 + (1.0 - severity) ** -0.5), rel=0.02)


@pytest.mark.parametrize("station", [0, 3, 7])
def test_a_single_crack_acts_in_its_cam_turn_alone(smooth, visible, station):
    effect, joint = visible("roller.crack_single", station=station), smooth.output_joint
    r = turn_of(smooth.with_effects(effect))
    turn = np.floor(r["cam_angle"] / (2.0 * math.pi)) % 8.0
    soft = (turn == station) & (r["deflection_2"] < 0.0)
    assert soft.sum() > 50
    expected = np.where(soft, 0.6, 1.0) * joint.stiffness * r["deflection_2"] + joint.damping * r["deflection_rate_2"]
    np.testing.assert_allclose(r["torque_2"], expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_single_crack_is_not_felt_before_its_station_and_fades_after(smooth, visible):
    machine = smooth.with_effects(visible("roller.crack_single", station=3))
    added = by_station(first_turn_of(machine)["table_acceleration"] - first_turn_of(smooth)["table_acceleration"])
    size = np.abs(added).max(axis=1)
    assert size[:3].max() < 1e-6
    assert size[3] > 1.0
    assert size[4] < size[3] and size[6] < 0.01 * size[3]


def test_at_its_station_a_single_crack_is_the_crack_of_all_stations(smooth, visible):
    """In its own cam turn a single crack is `roller.crack`: compared in the first, before which nothing was."""
    everywhere = by_station(first_turn_of(smooth.with_effects(visible("roller.crack")))["table_acceleration"])[0]
    single = by_station(first_turn_of(smooth.with_effects(visible("roller.crack_single")))["table_acceleration"])[0]
    np.testing.assert_allclose(single, everywhere, rtol=0, atol=1e-9)
