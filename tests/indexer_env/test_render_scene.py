"""A scene holds what the simulator's channels say, and refuses what cannot be drawn."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import Faults, OperatingPoint, ParameterError, Run, make_effect, simulate
from indexer_env.motion_law import Cycloidal, TableLaw
from indexer_env.render import SCENE_CHANNELS, Scene, scene_from

INDEX = 1025
"""Samples of one cam turn of the reference machine at 1500 rpm and 1 kHz."""


@pytest.fixture(scope="module")
def smooth_record(smooth):
    return simulate(smooth, run=Run(channels=SCENE_CHANNELS))


def at(record, index):
    return {name: float(values[index]) for name, values in record.channels.items()}


def test_angles_deflections_and_time_are_those_of_the_sample(smooth, smooth_record):
    sample = at(smooth_record, 2300)
    scene = scene_from(smooth, sample, time=2.3)
    assert (scene.cam_angle, scene.table_angle) == (sample["cam_angle"], sample["table_angle"])
    assert scene.deflections == tuple(sample[f"deflection_{joint}"] for joint in (1, 2, 3))
    assert (scene.time, scene.stations, scene.motion_law) == (2.3, 8, smooth.motion_law)
    assert len(scene.history_time) == 0


@pytest.mark.parametrize(("turns", "dwell", "station"), [(2.1, False, 2), (2.49, False, 2), (2.51, True, 3)])
def test_the_dwell_follows_the_motion(smooth, smooth_record, turns, dwell, station):
    scene = scene_from(smooth, at(smooth_record, round(turns * INDEX)))
    assert (scene.dwell, scene.station % 8) == (dwell, station)


def test_a_table_says_itself_where_it_dwells_and_how_fast_it_moves(smooth, smooth_record):
    """Two thirds of a turn beside a motion_share of a half: from 270 over 0 to 150 degrees."""
    angles = np.radians(np.arange(361.0))
    rise = Cycloidal().evaluate(angles + 0.5 * math.pi, smooth.stations, 2.0 / 3.0)[0]
    table = dataclasses.replace(smooth, motion_law=TableLaw(tuple(angles), tuple(rise)))
    sample = at(smooth_record, 2300)
    dwells = [
        scene_from(table, sample | {"cam_angle": math.radians(a)}).dwell for a in (-80.0, 10.0, 149.0, 151.0, 269.0)
    ]
    assert dwells == [False, False, False, True, True]
    named = dataclasses.replace(smooth, motion_law=Cycloidal(), motion_share=2.0 / 3.0)
    scales = [scene_from(one, sample).acceleration_scale for one in (table, named)]
    assert scales[0] == pytest.approx(scales[1], rel=1e-3)


def test_theory_is_the_rigid_machine_at_nominal_speed(smooth, smooth_record):
    """Peak Ca h / T² of the modified sine over the time T of an index, zero in the dwell, near the real one."""
    history = {"time": smooth_record.time, **smooth_record.channels}
    scene = scene_from(smooth, at(smooth_record, 8199), time=8.199, history=history, window=8.2)
    theory = scene.theoretical_acceleration
    assert len(theory) == 8200
    assert theory.max() == pytest.approx(5.5280 * (2.0 * math.pi / 8) / 0.5125**2, rel=1e-3)
    assert np.abs(theory[520:1020]).max() == 0.0
    rms = np.sqrt(np.mean(theory**2))
    assert np.sqrt(np.mean((scene.acceleration - theory) ** 2)) < 0.3 * rms
    fast = scene_from(
        smooth, at(smooth_record, 8199), time=8.199, history=history, window=8.2,
        operating_point=OperatingPoint(motor_speed=2.0 * OperatingPoint().motor_speed),
    )  # fmt: skip
    np.testing.assert_allclose(fast.theoretical_acceleration, 4.0 * theory, rtol=1e-12)


def test_the_history_shown_is_the_window_before_now(smooth, smooth_record):
    history = {"time": smooth_record.time, **smooth_record.channels}
    scene = scene_from(smooth, at(smooth_record, 3000), time=3.0, history=history)
    assert scene.window == pytest.approx(2.05)
    assert (scene.history_time[0], scene.history_time[-1]) == (0.95, 3.0)
    np.testing.assert_array_equal(scene.acceleration, smooth_record.table_acceleration[950:3001])
    early = scene_from(smooth, at(smooth_record, 100), time=0.1, history=history)
    assert len(early.history_time) == 101


def test_plays_are_halves_of_the_machines(smooth, smooth_record):
    sample = at(smooth_record, 0)
    assert scene_from(smooth, sample).half_plays == (0.0, 0.0, 0.0)
    worn = smooth.with_effects(
        make_effect("input.backlash", backlash=4e-3),
        make_effect("output.backlash", backlash=2e-3),
        make_effect("base.looseness", compliance=1e-5, backlash=6e-3),
    )
    assert scene_from(worn, sample).half_plays == pytest.approx((2e-3, 1e-3, 3e-3))


def test_a_model_without_a_joint_shows_no_play_there(reference, smooth_record):
    assert reference.input_joint.backlash > 0.0
    assert scene_from(dataclasses.replace(reference, model="A"), at(smooth_record, 0)).half_plays == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("faults", "cracked", "loose"),
    [
        (Faults(), (), False),
        (Faults(roller_crack=0.3), tuple(range(8)), False),
        (Faults(roller_crack=0.3, cracked_station=5), (5,), False),
        (Faults(screw_looseness=0.5), (), True),
    ],
)
def test_faults_show(smooth, smooth_record, faults, cracked, loose):
    scene = scene_from(faults.applied_to(smooth), at(smooth_record, 0))
    assert (scene.cracked_stations, scene.loose_screws) == (cracked, loose)


def test_effects_at_their_null_value_do_not_show(smooth, smooth_record):
    null = smooth.with_effects(
        make_effect("roller.crack_single", stiffness_loss=0.0), make_effect("base.looseness", compliance=0.0)
    )
    scene = scene_from(null, at(smooth_record, 0))
    assert (scene.cracked_stations, scene.loose_screws) == ((), False)


def test_a_missing_channel_is_named(smooth, smooth_record):
    sample = at(smooth_record, 0)
    del sample["deflection_2"]
    with pytest.raises(
        ParameterError, match=r"^scene_from\.sample must hold .*, got none of deflection_2; record with"
    ):
        scene_from(smooth, sample)
    with pytest.raises(ParameterError, match=r"^scene_from\.history must hold .*, got none of motor_angle; "):
        history = {"time": smooth_record.time, "table_acceleration": smooth_record.table_acceleration}
        scene_from(smooth, at(smooth_record, 0), history=history)


def test_histories_of_unequal_length_are_refused(smooth, smooth_record):
    history = {**smooth_record.channels, "time": smooth_record.time[:-1]}
    with pytest.raises(ParameterError, match=r"^scene_from\.history must be three arrays \(n,\) of one length, got"):
        scene_from(smooth, at(smooth_record, 0), history=history)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"cam_angle": math.nan}, "Scene.cam_angle must be a finite number rad, got nan."),
        ({"stations": 1}, "Scene.stations must be a whole number >= 2 and <= 1000, got 1."),
        ({"motion_law": "cycloidal"}, "Scene.motion_law must be a MotionLaw, got 'cycloidal'; see "),
        (
            {"deflections": (0.0, 0.0)},
            "Scene.deflections must be a tuple of three angles in rad, of joints 1, 2 and 3, ",
        ),
        ({"half_plays": (0.0, -1.0, 0.0)}, "Scene.half_plays must be a finite number >= 0 rad, got -1.0."),
        ({"cracked_stations": 3}, "Scene.cracked_stations must be a tuple of stations, got 3."),
        ({"cracked_stations": (8,)}, "Scene.cracked_stations must be a whole number >= 0 and <= 7, got 8."),
        ({"dwell": 1}, "Scene.dwell must be True or False, got 1."),
        ({"window": 0.0}, "Scene.window must be a finite number > 0 s, got 0.0."),
        ({"exaggeration": 0.0}, "Scene.exaggeration must be a finite number > 0, got 0.0."),
        ({"acceleration": np.zeros(3)}, "Scene.acceleration must be one-dimensional and as long as history_time, got "),
        (
            {"history_time": [0.0], "acceleration": [math.inf], "theoretical_acceleration": [0.0]},
            "Scene.acceleration must be finite, got inf.",
        ),
    ],
)
def test_a_scene_refuses_in_one_sentence(wrong, sentence):
    values = {"cam_angle": 0.0, "table_angle": 0.0, "housing_angle": 0.0, "stations": 8} | wrong
    with pytest.raises(ParameterError) as caught:
        Scene(**values)
    assert str(caught.value).startswith(sentence)
