"""Model B with play and the clipped contact law, written anew for other solvers, with the motion law in closed form.

model_b          the machine as compiled scalar functions, and a plain fixed-step RK4 of it
lane_peer        the same RK4 over lanes of machines
scipy_peer       SciPy's RK45, DOP853 and LSODA
jax_peer         a vmapped scan of RK4
diffrax_peer     diffrax' Tsit5, vmapped
sundials_peer    CVODE with root finding at the edges of contact (scikit-sundae)

None of them imports the simulator's kernels: they are measured beside it and check it.
"""

from __future__ import annotations

import numpy as np

from indexer_env.errors import ParameterError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint

PARAMETERS = (
    "cam_inertia", "follower_inertia", "table_inertia",
    "stiffness_1", "damping_1", "edge_1", "stiffness_2", "damping_2", "edge_2",
    "advance", "motion_share", "load_torque", "cam_speed",
)  # fmt: skip
"""Columns of a peer's parameters, SI and radians; edge = g/2."""

DISTRIBUTIONS = {"jax": "jax", "diffrax": "diffrax", "sundials": "scikit-sundae"}
"""The optional peers and the distributions they need, all in the extra [bench]."""


def parameters(machine: Machine, point: OperatingPoint) -> np.ndarray:
    """The machine as a peer takes it, (13,).

    Raises
    ------
    ParameterError
        Not a Model B of modified sine, clipped contact, linear joints, no effects and start angle 0.
    """
    joints = (machine.input_joint, machine.output_joint)
    plain = all(joint.stiffness_ratio == 1.0 for joint in joints) and not machine.effects
    clipped = machine.contact_law == "clipped" and all(joint.backlash > 0.0 for joint in joints)
    if not (plain and clipped and machine.model == "B" and machine.motion_law.name == "modified_sine"):
        raise ParameterError(f"The peers know Model B of modified sine with clipped play only, got {machine.name!r}.")
    if point.start_angle != 0.0:
        raise ParameterError(f"The peers start at cam angle 0 rad, got {point.start_angle}.")
    first, second = joints
    return np.array([
        machine.cam_inertia, machine.follower_inertia, machine.table_inertia,
        first.stiffness, first.damping, first.backlash / 2.0, second.stiffness, second.damping, second.backlash / 2.0,
        machine.advance, machine.motion_share, point.load_torque, machine.reduction * point.motor_speed,
    ])  # fmt: skip


def start(p: np.ndarray) -> np.ndarray:
    """State (α, α̇, φ, φ̇) of kinematic motion at cam angle 0, (4,)."""
    return np.array([0.0, p[PARAMETERS.index("cam_speed")], 0.0, 0.0])
