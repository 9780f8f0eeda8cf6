"""The compiled simulator against the reference solver, sample by sample over short horizons."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import pytest

from indexer_env.coefficients import coefficients
from indexer_env.effects import make_effect
from indexer_env.effects.base import EFFECTS, MachineEffect
from indexer_env.machine import CONTACT_LAWS, MODELS, Machine
from indexer_env.motion_law import Cycloidal, ModifiedTrapezoid, MotionLaw, Polynomial345, TableLaw
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.reference import simulate_reference
from indexer_env.simulate import Run, simulate
from indexer_env.trajectory import CHANNELS

SMOOTH, WITH_EDGES = 1e-6, 1e-5
"""Largest relative rms error of φ̈, as promised for the default step without and with play."""

HEALTHY = load_machine("smooth")
PLAY = {"input_joint": {"backlash": 13.6e-3}, "output_joint": {"backlash": 1e-3}, "base_joint": {"backlash": 2e-4}}
BILINEAR = {joint: {"stiffness_ratio": 0.6} for joint in PLAY}


def machine(**changes: dict) -> Machine:
    """The machine without play, its base soft enough to move, some joints changed."""
    joints = {"base_joint": {"stiffness": 1e6, "damping": 500.0}}
    for name, change in changes.items():
        joints[name] = {**joints.get(name, {}), **change}
    return dataclasses.replace(
        HEALTHY, **{name: dataclasses.replace(getattr(HEALTHY, name), **change) for name, change in joints.items()}
    )


def difference(one: Machine, point: OperatingPoint | None = None, samples: int = 400, **run: float) -> float:
    """Relative rms difference of φ̈ between the two solvers [-]."""
    expected = simulate_reference(one, point, samples=samples).table_acceleration
    found = simulate(one, point, Run(warmup_turns=0, samples=samples, **run)).table_acceleration
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


class Case(NamedTuple):
    """An effect at a size that shows, and the cam angle from which it is seen at work."""

    parameters: dict
    start_angle: float = 0.0
    tolerance: float = SMOOTH


EFFECT_CASES = {
    "friction.coulomb": Case({"torque": 20.0}),
    "friction.viscous": Case({"coefficient": 10.0}),
    "friction.stribeck": Case({"torque": 20.0}),
    "load.imbalance": Case({"torque": 100.0, "phase": 0.5}),
    "load.process": Case({"torque": 50.0}, start_angle=3.5),
    "drive.slip": Case({"compliance": 0.2}),
    "drive.speed_ripple": Case({"depth": 0.02, "phase": 0.3}),
    "drive.transmission_error": Case({"amplitude": 5e-4, "phase": 0.4}),
    "drive.mesh_stiffness": Case({"depth": 0.3, "phase": 0.2}),
    "drive.mesh_friction": Case({"loss": 0.3}, tolerance=WITH_EDGES),
    "cam.profile_error": Case({"height": 5e-4}),
    "cam.station_spacing": Case({"error": 1e-3, "station": 2}, start_angle=6.0),
    "roller.crack": Case({"stiffness_loss": 0.3}, tolerance=WITH_EDGES),
    "roller.crack_single": Case({"stiffness_loss": 0.5, "station": 1}, start_angle=5.8, tolerance=WITH_EDGES),
    "input.backlash": Case({"backlash": 5e-3}, tolerance=WITH_EDGES),
    "output.backlash": Case({"backlash": 1e-3}, tolerance=WITH_EDGES),
    "output.cubic_stiffness": Case({"stiffness": 1e10}),
    "base.looseness": Case({"compliance": 1e-6, "backlash": 2e-4}, tolerance=WITH_EDGES),
}


def test_every_machine_effect_has_a_case() -> None:
    assert set(EFFECT_CASES) == {name for name, effect in EFFECTS.items() if issubclass(effect, MachineEffect)}


@pytest.mark.parametrize("name", EFFECT_CASES)
def test_effect(name: str) -> None:
    case = EFFECT_CASES[name]
    point = OperatingPoint(start_angle=case.start_angle)
    with_it = HEALTHY.with_effects(make_effect(name, case.parameters))  # type: ignore[arg-type]
    samples = 500
    expected = simulate_reference(with_it, point, samples=samples).table_acceleration
    found = simulate(with_it, point, Run(warmup_turns=0, samples=samples)).table_acceleration
    plain = simulate(HEALTHY, point, Run(warmup_turns=0, samples=samples)).table_acceleration
    size = np.linalg.norm(expected)
    assert np.linalg.norm(found - expected) <= case.tolerance * size
    assert np.linalg.norm(found - plain) > 1e-4 * size, "the effect does not show, so the case proves nothing"


@pytest.mark.parametrize("name", sorted(EFFECT_CASES))
def test_effect_on_a_machine_with_play(name: str) -> None:
    case = EFFECT_CASES[name]
    one = machine(**PLAY).with_effects(make_effect(name, case.parameters))  # type: ignore[arg-type]
    assert difference(one, OperatingPoint(start_angle=case.start_angle), samples=300) <= WITH_EDGES


@pytest.mark.parametrize("law", CONTACT_LAWS)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("joints", [*((joint,) for joint in PLAY), tuple(PLAY)], ids=lambda joints: "+".join(joints))
@pytest.mark.parametrize("shapes", [(PLAY,), (BILINEAR,), (PLAY, BILINEAR)], ids=["play", "bilinear", "both"])
def test_joints(law: str, model: str, joints: tuple[str, ...], shapes: tuple[dict, ...]) -> None:
    changes = {joint: {key: value for shape in shapes for key, value in shape[joint].items()} for joint in joints}
    one = dataclasses.replace(machine(**changes), model=model, contact_law=law)
    assert difference(one) <= WITH_EDGES


def test_all_channels() -> None:
    one = dataclasses.replace(machine(**PLAY), model="B_on_base")
    channels = tuple(CHANNELS)
    expected = simulate_reference(one, samples=300, channels=channels).channels
    found = simulate(one, run=Run(warmup_turns=0, samples=300, channels=channels)).channels
    for channel in channels:
        if channel.startswith("region"):
            np.testing.assert_array_equal(found[channel], expected[channel])
        else:
            size = np.linalg.norm(expected[channel])
            assert np.linalg.norm(found[channel] - expected[channel]) <= WITH_EDGES * size, channel


def table_law(lift: float) -> TableLaw:
    angles = np.radians(np.arange(361.0))
    return TableLaw(tuple(angles), tuple(Cycloidal().evaluate(angles, 8, 0.5)[0] + lift))


@pytest.mark.parametrize("law", [ModifiedTrapezoid(), Cycloidal(), Polynomial345(), table_law(0.0), table_law(0.1)])
def test_motion_laws(law: MotionLaw) -> None:
    """From mid-motion through the dwell into the next cam turn."""
    one = dataclasses.replace(HEALTHY, motion_law=law)
    assert difference(one, OperatingPoint(start_angle=1.0), samples=1000) <= SMOOTH


@pytest.mark.parametrize("centre", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("name", ["load.process", "cam.profile_error"])
def test_a_table_says_itself_where_a_bump_meets_its_dwell(name: str, centre: float) -> None:
    """The table moves from 90 to 270 degrees, which `motion_share` does not say; nor does the table read it."""
    angles = np.radians(np.arange(361.0))
    law = TableLaw(tuple(angles), tuple(Cycloidal().evaluate(angles - 0.5 * math.pi, 8, 0.5)[0]))
    size = {"load.process": {"torque": 5.0}, "cam.profile_error": {"height": 1e-4}}[name]
    bump = make_effect(name, centre=centre, half_width=0.05, **size)
    one = dataclasses.replace(HEALTHY, motion_law=law).with_effects(bump)
    assert difference(one, samples=800) <= SMOOTH
    assert coefficients(one, OperatingPoint())["linear_dwell"] == (1.0 if centre == 0.5 else 0.0)


@pytest.mark.parametrize(
    "point",
    [
        OperatingPoint(motor_speed=400.0),
        OperatingPoint(motor_speed=20.0, start_angle=1.0),
        OperatingPoint(load_torque=-50.0),
        OperatingPoint(start_angle=-5.0),
        OperatingPoint(start_angle=2.0 * math.pi * 3),
    ],
    ids=str,
)
def test_operating_points(point: OperatingPoint) -> None:
    assert difference(HEALTHY, point) <= SMOOTH
    assert difference(machine(**PLAY), point) <= WITH_EDGES


@pytest.mark.parametrize("model", ["A", "B"])
@pytest.mark.parametrize(
    ("effect", "start_angle"),
    [
        (make_effect("cam.station_spacing", {"error": 1e-3, "station": 0}), 0.0),
        (make_effect("cam.station_spacing", {"error": 1e-3, "station": 1}), 1.0),
        (make_effect("cam.profile_error", {"height": 5e-4, "centre": 0.5}), 3.1),
        (make_effect("drive.transmission_error", {"amplitude": 5e-4, "phase": 0.4}), 1.0),
    ],
    ids=["off station at the start", "on the way to it", "on the bump", "wavering drive"],
)
def test_start_on_an_effect(model: str, effect: MachineEffect, start_angle: float) -> None:
    """The start state is the law's with the effects that shape it."""
    one = dataclasses.replace(HEALTHY, model=model).with_effects(effect)
    assert difference(one, OperatingPoint(start_angle=start_angle), samples=200) <= SMOOTH


def test_station_off_its_place_with_a_table_that_starts_above_zero() -> None:
    effect = make_effect("cam.station_spacing", {"error": 1e-3, "station": 2})
    one = dataclasses.replace(HEALTHY, motion_law=table_law(0.1)).with_effects(effect)  # type: ignore[arg-type]
    assert difference(one, OperatingPoint(start_angle=5.8), samples=1600) <= SMOOTH


@pytest.mark.parametrize("law", CONTACT_LAWS)
@pytest.mark.parametrize("model", ["A", "B"])
@pytest.mark.parametrize("play", [1e-6, 1e-5])
def test_play_thinner_than_a_step(play: float, model: str, law: str) -> None:
    """The table crosses the whole play within one step: it leaves one flank and reaches the other in the same step."""
    one = machine(output_joint={"backlash": play})
    one = dataclasses.replace(one, model=model, contact_law=law)
    assert difference(one, OperatingPoint(load_torque=-50.0)) <= SMOOTH


def test_whole_turn_of_the_smooth_machine() -> None:
    assert difference(HEALTHY, samples=8200) <= SMOOTH


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_whole_turn_of_the_smooth_models(model: str) -> None:
    assert difference(dataclasses.replace(machine(), model=model), samples=8200) <= SMOOTH
