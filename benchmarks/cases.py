"""The machines that are measured: variations of the presets, the random ones with their seeds."""

from __future__ import annotations

import dataclasses

import numpy as np

from indexer_env.machine import Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine

INPUT_PLAY = 13.6e-3
"""rad at the cam: 20° at the motor shaft over i = 25.625, the paper's largest."""

OUTPUT_PLAY = 1.0e-3
"""rad: a worn roller in its groove."""

DRAW_HALF_WIDTH = 0.10
"""The paper's ±10 % on stiffness and damping of both joints."""

DRAW_SEED = 20
"""Draw i is made from SeedSequence (DRAW_SEED, i), so it does not depend on how many are drawn."""

OPERATING_POINT = OperatingPoint()
TURN_SAMPLES = 8200
"""One turn of the table at 1 kHz."""

HALF_SECOND = 500


def smooth() -> Machine:
    """Model B without play."""
    return load_machine("smooth")


def with_play() -> Machine:
    """Model B with play in both joints."""
    machine = smooth()
    return dataclasses.replace(
        machine,
        input_joint=dataclasses.replace(machine.input_joint, backlash=INPUT_PLAY),
        output_joint=dataclasses.replace(machine.output_joint, backlash=OUTPUT_PLAY),
        name="with play",
    )


def draws(count: int) -> list[Machine]:
    """`count` machines with play, k and r of both joints drawn from k (1 + 0.1 u), u uniform in [-1, 1)."""
    machine = with_play()
    drawn = []
    for index in range(count):
        factors = 1.0 + DRAW_HALF_WIDTH * np.random.default_rng([DRAW_SEED, index]).uniform(-1.0, 1.0, 4)
        joints = (machine.input_joint, machine.output_joint)
        first, second = (
            dataclasses.replace(joint, stiffness=joint.stiffness * float(k), damping=joint.damping * float(r))
            for joint, (k, r) in zip(joints, factors.reshape(2, 2), strict=True)
        )
        name = f"draw {index}"
        drawn.append(dataclasses.replace(machine, input_joint=first, output_joint=second, name=name))
    return drawn


def free() -> Machine:
    """The 3-DOF model without damping and drive: joint 1 stays inside a play of 0.5 rad, loose base screws.

    The cam's inertia is 40 times the reference one: a free cam of that size slows so little while it moves the table
    that joint 1 never meets its flanks within two seconds, and the motor that turns on beside it stays without effect.
    """
    machine = smooth()
    return dataclasses.replace(
        machine,
        model="B_on_base",
        cam_inertia=20.0,
        input_joint=Joint(machine.input_joint.stiffness, 0.0, backlash=0.5),
        output_joint=Joint(machine.output_joint.stiffness, 0.0),
        base_joint=Joint(1.0e6, 0.0),
        name="free",
    )
