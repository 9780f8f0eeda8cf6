"""Machines that are not quite alike: the law by which the stiffness and the damping of their joints are drawn."""

from __future__ import annotations

import dataclasses

import numpy as np

from indexer_env.checks import check_number
from indexer_env.machine import Joint, Machine

_STREAM = 1
"""Keeps the draws of machines apart from those of the environment, which has the same seed."""


def variation_rng(seed: int | None) -> np.random.Generator:
    """The generator PCG64(SeedSequence(seed, spawn_key=(1,))) from which the machines of an environment are drawn."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))


def check_half_width(owner: str, half_width: object) -> None:
    """Refuse a half width out of [0, 0.5]: beyond, a draw could leave a joint without stiffness."""
    check_number(owner, "half_width", half_width, low=0.0, high=0.5)


def varied(machine: Machine, half_width: float, rng: np.random.Generator) -> Machine:
    """The machine with stiffness and damping of its input and output joint drawn anew.

    k (1 + w u), u uniform in [-1, 1), four draws in the order k1, r1, k2, r2: the ±10 % of the paper for
    w = `half_width` = 0.1.
    """
    factors = 1.0 + half_width * rng.uniform(-1.0, 1.0, 4)

    def drawn(joint: Joint, stiffness: float, damping: float) -> Joint:
        return dataclasses.replace(joint, stiffness=joint.stiffness * stiffness, damping=joint.damping * damping)

    k1, r1, k2, r2 = factors.tolist()
    return dataclasses.replace(
        machine, input_joint=drawn(machine.input_joint, k1, r1), output_joint=drawn(machine.output_joint, k2, r2)
    )
