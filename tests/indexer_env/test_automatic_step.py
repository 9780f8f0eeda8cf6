"""The automatic step on machines drawn at random, against DOP853 stopped at edges."""

import dataclasses

import numpy as np
import pytest

from indexer_env.coefficients import coefficients
from indexer_env.effects import make_effect
from indexer_env.errors import ParameterError
from indexer_env.machine import CONTACT_LAWS, Machine
from indexer_env.modes import steps_of
from indexer_env.operating_point import OperatingPoint
from indexer_env.reference import simulate_reference
from indexer_env.simulate import Run, simulate_batch

SEED, MACHINES = 171, 40

EFFECTS = (
    ("drive.speed_ripple", {"depth": (1e-3, 0.05)}),
    ("drive.transmission_error", {"amplitude": (1e-5, 1e-3)}),
    ("drive.mesh_stiffness", {"depth": (0.05, 0.3)}),
    ("drive.mesh_friction", {"loss": (0.05, 0.4)}),
    ("output.cubic_stiffness", {"stiffness": (1e7, 1e9)}),
    ("load.imbalance", {"torque": (1.0, 50.0)}),
    ("cam.profile_error", {"height": (1e-5, 1e-3)}),
)
"""Effects that have a say in the step or act at each of its stages, and the ranges their sizes are drawn from."""


FORCES = tuple(pair for pair in EFFECTS if pair[0].startswith(("drive.speed", "drive.trans", "load.")))
"""Those that force the oscillators of the dwell."""

FRICTION = (("friction.coulomb", {"torque": (1.0, 20.0)}), ("friction.stribeck", {"torque": (1.0, 20.0)}))


def varied(machine: Machine, rng: np.random.Generator) -> Machine:
    """Inertias, stiffnesses and dampings times 1/2 … 2, one of the contact laws."""

    def off(value: float) -> float:
        return value * 2.0 ** float(rng.uniform(-1.0, 1.0))

    joints = {
        name: dataclasses.replace(joint, stiffness=off(joint.stiffness), damping=off(joint.damping))
        for name, joint in (("input_joint", machine.input_joint), ("output_joint", machine.output_joint))
    }
    inertias = {name: off(getattr(machine, name)) for name in ("cam_inertia", "follower_inertia", "table_inertia")}
    law = CONTACT_LAWS[int(rng.integers(len(CONTACT_LAWS)))]
    return dataclasses.replace(machine, contact_law=law, **joints, **inertias)


def with_play(machine: Machine, rng: np.random.Generator) -> Machine:
    """Play of up to 13.6 mrad at the input joint and 1 mrad at the output joint."""
    return dataclasses.replace(
        machine,
        input_joint=dataclasses.replace(machine.input_joint, backlash=float(rng.uniform(0.0, 0.0136))),
        output_joint=dataclasses.replace(machine.output_joint, backlash=float(rng.uniform(0.0, 1e-3))),
    )


def with_effect(machine: Machine, rng: np.random.Generator, effects: tuple = EFFECTS) -> Machine:
    """One effect, its size drawn evenly in its logarithm."""
    name, sizes = effects[int(rng.integers(len(effects)))]
    drawn = {key: float(np.exp(rng.uniform(*np.log(ends)))) for key, ends in sizes.items()}
    return machine.with_effects(make_effect(name, drawn))


def with_friction(machine: Machine, rng: np.random.Generator) -> Machine:
    return with_effect(machine, rng, FRICTION)


def with_forces(machine: Machine, rng: np.random.Generator) -> Machine:
    """Two effects that force the dwell, or one."""
    return with_effect(with_effect(machine, rng, FORCES), rng, FORCES)


KINDS = {
    "smooth": ((), 1500, 1e-6),
    "play": ((with_play,), 500, 1e-5),
    "effect": ((with_effect,), 500, 1e-5),
    "play and effect": ((with_play, with_effect), 500, 1e-5),
    "forced dwell": ((with_forces,), 400, 1e-6),
    "forced dwell and play": ((with_play, with_forces), 400, 1e-5),
    "friction": ((with_friction,), 500, 1e-4),  # a table that changes its direction within a step
}
"""What is added to a machine, samples compared, relative rms error allowed."""


def errors(smooth: Machine, kind: str, seed: int = SEED, count: int = MACHINES) -> tuple[np.ndarray, list[Machine]]:
    """Relative rms error of φ̈ of each machine, at 0.3 to 1.5 times the reference speed, and the machines."""
    added, samples, _ = KINDS[kind]
    machines, points = [], []
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        machine = varied(smooth, rng)
        for add in added:
            machine = add(machine, rng)
        machines.append(machine)
        point = OperatingPoint(motor_speed=157.0 * float(rng.uniform(0.3, 1.5)))
        if kind.startswith("forced"):  # from just before the dwell
            load, angle = float(rng.uniform(-60.0, 60.0)), float(rng.uniform(3.0, 3.3))
            point = dataclasses.replace(point, load_torque=load, start_angle=angle)
        points.append(point)
    batch = simulate_batch(machines, points, Run(samples=samples, warmup_turns=0))
    assert not batch.rejected
    truth = np.stack([
        simulate_reference(machine, point, samples=samples).table_acceleration
        for machine, point in zip(machines, points, strict=True)
    ])  # fmt: skip
    found = batch.table_acceleration
    return np.sqrt(np.mean((found - truth) ** 2, axis=1) / np.mean(truth**2, axis=1)), machines


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_automatic_step_holds_on_machines_drawn_at_random(smooth, kind):
    found, _ = errors(smooth, kind)
    assert found.max() <= KINDS[kind][2]


def error(machine: Machine, samples: int = 500) -> float:
    """Relative rms error of φ̈ at the automatic step, against one of 10 µs."""
    run = Run(samples=samples, warmup_turns=0)
    found, truth = (
        simulate_batch([machine], run=r).table_acceleration for r in (run, dataclasses.replace(run, step=1e-5))
    )
    return float(np.sqrt(np.mean((found - truth) ** 2) / np.mean(truth**2)))


@pytest.mark.parametrize("motion_share", [0.5, 0.9])
@pytest.mark.parametrize(
    ("name", "size"), [("cam.profile_error", {"height": 5e-3}), ("load.process", {"torque": 5000.0})]
)
def test_the_automatic_step_sees_the_narrowest_pulse(smooth, motion_share, name, size):
    pulse = make_effect(name, centre=0.23, half_width=0.01, **size)
    assert error(dataclasses.replace(smooth, motion_share=motion_share).with_effects(pulse)) < 1e-5


def test_a_pulse_that_no_step_sees_is_refused():
    for name, size in (("cam.profile_error", {"height": 1e-4}), ("load.process", {"torque": 50.0})):
        with pytest.raises(ParameterError, match=rf"{name}\.half_width must be a finite number >= 0\.01 and"):
            make_effect(name, half_width=0.005, **size)


@pytest.mark.parametrize("ends", [1e-3, 1e-2])
def test_the_automatic_step_sees_a_stiffness_that_is_tabulated(smooth, ends):
    """Twenty times the output joint's own, over its deflection."""
    torques = {f"torque_{k + 1}": 1e6 * ends * (k - 4) / 4 for k in range(9)}
    table = make_effect("tabulated.deflection", low=-ends, high=ends, **torques)
    plane = {f"torque_{k + 1}_{n + 1}": 1e6 * ends * (k - 2) / 2 for k in range(5) for n in range(5)}
    two = make_effect("tabulated.deflection_rate", low=-ends, high=ends, low_2=-1.0, high_2=1.0, **plane)
    stiff = dataclasses.replace(smooth.output_joint, stiffness=smooth.output_joint.stiffness + 1e6)
    point = OperatingPoint()
    expected = steps_of([coefficients(dataclasses.replace(smooth, output_joint=stiff), point)], [point])
    for effect in (table, two):
        machine = smooth.with_effects(effect)
        np.testing.assert_allclose(steps_of([coefficients(machine, point)], [point]), expected, rtol=1e-9)
    assert error(smooth.with_effects(table), 300) < 1e-5
