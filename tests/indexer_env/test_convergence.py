"""Order of convergence on smooth and on rattling machines, and energy kept where nothing takes it."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import engine
from indexer_env.coefficients import coefficients, pack
from indexer_env.kernels import layout
from indexer_env.machine import CONTACT_LAWS, Joint, Machine
from indexer_env.motion_law import motion_law
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate

STEPS = tuple(1e-3 / parts for parts in (1, 2, 4))
"""s; with finer ones rounding begins to count, which leaves some 2e-11 of the record."""

FINE = 1e-3 / 32
FOUR = pytest.approx(4.2, abs=0.3)
"""The order of the scheme is 4, and 5 but for what dampers do."""


def errors(machine: Machine, seconds: float, steps=STEPS, fine: float = FINE, start: float = 0.0) -> np.ndarray:
    """Relative rms error of φ̈ at each step against a much finer one."""

    def record(step: float) -> np.ndarray:
        run = Run(samples=round(seconds * 1000), warmup_turns=0, step=step)
        return simulate(machine, OperatingPoint(start_angle=start), run).table_acceleration

    truth = record(fine)
    return np.array([np.sqrt(np.mean((record(step) - truth) ** 2) / np.mean(truth**2)) for step in steps])


def order(steps, found: np.ndarray) -> float:
    """Slope of log error over log step."""
    return float(np.polyfit(np.log(steps), np.log(found), 1)[0])


# -------------------------------------------------------------------------------- order


@pytest.mark.parametrize("law", ["modified_sine", "modified_trapezoid", "cycloidal", "polynomial_345"])
def test_fourth_order_on_the_smooth_machine(smooth, law):
    """Over the index and into the dwell, so across the law's junctions, where its fourth or third derivative jumps."""
    found = errors(dataclasses.replace(smooth, motion_law=motion_law(law)), seconds=0.6)
    assert order(STEPS, found) == FOUR
    assert found[2] < 1e-9


@pytest.mark.parametrize("name", ["drive.slip", "drive.speed_ripple", "drive.mesh_stiffness", "load.imbalance",
                                  "friction.viscous", "output.cubic_stiffness"])  # fmt: skip
def test_fourth_order_with_smooth_effects(smooth, visible, name):
    found = errors(smooth.with_effects(visible(name)), seconds=0.3)
    assert order(STEPS, found) == FOUR


@pytest.mark.parametrize(
    ("name", "other"),
    [("cam.profile_error", {}), ("load.process", {"centre": 0.2}), ("roller.crack", {}), ("cam.station_spacing", {})],
)
def test_fourth_order_across_bumps_and_cracks(smooth, visible, name, other):
    found = errors(smooth.with_effects(visible(name, **other)), seconds=0.4)
    assert order(STEPS, found) == pytest.approx(4.0, abs=0.4)  # the bump's fourth derivative jumps


@pytest.mark.parametrize("law", CONTACT_LAWS)
@pytest.mark.parametrize(("play_1", "play_2"), [(0.0136, 1e-3), (0.0, 1e-3), (0.0136, 0.0), (5.8e-4, 0.0)])
def test_order_survives_contact(smooth, law, play_1, play_2):
    """Steps land on the edges of the play; a plain fixed step is of first order there."""
    machine = dataclasses.replace(
        smooth, contact_law=law,
        input_joint=dataclasses.replace(smooth.input_joint, backlash=play_1),
        output_joint=dataclasses.replace(smooth.output_joint, backlash=play_2),
    )  # fmt: skip
    found = errors(machine, seconds=0.3)
    assert order(STEPS, found) == FOUR
    assert found[0] < 2e-6 and found[2] < 1e-8


def test_order_survives_contact_on_a_bilinear_base_with_play(smooth):
    base = Joint(stiffness=1e6, damping=900.0, backlash=2e-4, stiffness_ratio=0.7)
    crack = dataclasses.replace(smooth.output_joint, stiffness_ratio=0.6)
    machine = dataclasses.replace(smooth, model="B_on_base", base_joint=base, output_joint=crack)
    found = errors(machine, seconds=0.3, steps=STEPS[1:])
    assert order(STEPS[1:], found) == FOUR
    assert found[1] < 1e-7


# -------------------------------------------------------------------------------- energy


@pytest.fixture
def undriven(smooth, monkeypatch) -> Machine:
    """No drive torque, damping or load: an input joint so soft that its torque is below rounding. The cam then turns
    freely against the motor, so what the kernel takes for a deflection of joint 1 may be of any size."""
    monkeypatch.setattr(engine, "LARGEST_DEFLECTION", math.inf)
    return dataclasses.replace(
        smooth, model="B_on_base",
        input_joint=Joint(stiffness=1e-25, damping=0.0),
        output_joint=dataclasses.replace(smooth.output_joint, damping=0.0),
        base_joint=Joint(stiffness=1e6, damping=0.0),
    )  # fmt: skip


def energies(machine: Machine, seconds: float, step: float) -> np.ndarray:
    """T + V at every millisecond (docs/explanation/physics.md), started at speed with the table deflected."""
    point = OperatingPoint(load_torque=0.0, start_angle=0.5)
    packed = pack([coefficients(machine, point)], [point])
    every, samples = round(1e-3 / step), round(seconds * 1000)
    names = ["CAM", "CAM_RATE", "TABLE_RATE", "HOUSING_RATE", "DEFLECTION_2", "DEFLECTION_3"]
    rows = np.array([getattr(layout, name) for name in names])
    out, status, _ = engine.advance(
        packed, np.array([samples * every]), np.array([step]), np.array([0.0]), every=every, rows=rows, samples=samples
    )
    assert (status == layout.RUNNING).all()
    angle, cam, table, housing, d2, d3 = out[0]
    _, slope, _ = machine.motion_law.evaluate(angle, machine.stations, machine.motion_share)
    follower = slope * cam + housing
    kinetic = machine.cam_inertia * cam**2 + machine.follower_inertia * follower**2
    kinetic += machine.table_inertia * table**2 + machine.housing_inertia * housing**2

    def stored(joint: Joint, d: np.ndarray) -> np.ndarray:
        x = np.maximum(np.abs(d) - joint.backlash / 2.0, 0.0)
        return np.where(d > 0.0, 1.0, joint.stiffness_ratio) * joint.stiffness * x**2

    potential = stored(machine.output_joint, d2) + stored(machine.base_joint, d3)
    assert potential.max() > 1e-3 * kinetic.max()
    assert np.ptp(cam) > 0.05 * np.abs(cam).max()
    return 0.5 * (kinetic + potential)


def test_the_undamped_undriven_machine_keeps_its_energy(undriven):
    energy = energies(undriven, seconds=2.0, step=0.25e-3)
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-8
    finer = energies(undriven, seconds=2.0, step=0.125e-3)
    assert np.abs(finer / finer[0] - 1.0).max() < 1e-9


def test_undamped_contact_keeps_its_energy_too(undriven):
    rattling = dataclasses.replace(
        undriven,
        output_joint=dataclasses.replace(undriven.output_joint, backlash=1e-3, stiffness_ratio=0.6),
        base_joint=Joint(stiffness=1e6, damping=0.0, backlash=1e-4),
    )
    energy = energies(rattling, seconds=1.0, step=0.125e-3)
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-8


def test_damping_takes_energy_away(undriven):
    """The anti-test: with damping in joint 2 the energy falls, and only falls."""
    damped = dataclasses.replace(undriven, output_joint=dataclasses.replace(undriven.output_joint, damping=30.0))
    energy = energies(damped, seconds=1.0, step=0.25e-3)
    assert (np.diff(energy) < 1e-9 * energy[0]).all() and energy[-1] < 0.995 * energy[0]
