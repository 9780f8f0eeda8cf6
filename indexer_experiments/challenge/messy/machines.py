"""Machines of random size: nominal ones, and the true ones that they stand for."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from indexer_env import load_machine
from indexer_env.machine import Machine
from indexer_env.motion_law import motion_law
from indexer_experiments.challenge.laws import LAWS
from indexer_experiments.challenge.parameters import changed, read

SIZE = (0.01, 100.0)
"""One factor on all inertias, stiffnesses and dampings (and on all loads), log-uniform."""

PROPORTIONS = 0.25
"""Half width of the uniform law of each parameter of the nominal machine beside that factor, relative."""

SPREAD = 0.1
"""Half width of the uniform law of each true parameter about its nominal value, relative."""

KNOWN_TO = SPREAD / math.sqrt(3.0)
"""What a method is told of it: the law's relative standard deviation."""

STATIONS = (4, 5, 6, 8, 10, 12)
MOTION_SHARE = (0.35, 0.65)
"""A cam moves the table in 126° to 234° of its turn."""

_HEAVY = (
    "input_joint.stiffness", "input_joint.damping", "output_joint.stiffness", "output_joint.damping",
    "cam_inertia", "follower_inertia", "table_inertia", "housing_inertia", "motor_inertia",
)  # fmt: skip

VARIED = (*_HEAVY, "input_joint.backlash")
"""Parameters that vary, in the nominal machine as between it and the true one."""


@dataclasses.dataclass(frozen=True)
class Pair:
    """The nominal and the true machine, and the factor on all torques between the reference machine and them."""

    nominal: Machine
    truth: Machine
    size: float


def drawn_machine(rng: np.random.Generator) -> Pair:
    """A machine of random size, proportions, stations, dwell and law, and the true one near it."""
    size = math.exp(rng.uniform(math.log(SIZE[0]), math.log(SIZE[1])))
    reference = load_machine("reference")
    values = {}
    for name in (*VARIED, "reduction_ratio"):
        factor = 1.0 + PROPORTIONS * rng.uniform(-1.0, 1.0)
        values[name] = read(reference, name) * factor * (size if name in _HEAVY else 1.0)
    nominal = dataclasses.replace(
        changed(reference, values), name="drawn", stations=int(rng.choice(STATIONS)),
        motion_share=rng.uniform(*MOTION_SHARE), motion_law=motion_law(str(rng.choice(LAWS))),
    )  # fmt: skip
    near = {name: read(nominal, name) * (1.0 + SPREAD * rng.uniform(-1.0, 1.0)) for name in VARIED}
    return Pair(nominal, changed(nominal, near), size)
