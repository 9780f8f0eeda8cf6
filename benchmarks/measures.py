"""The mathematics of the measurements, free of machines and clocks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from indexer_env.machine import Machine


def relative_rms(values: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """rms(values - reference) / rms(reference) over the last axis [-], (...,) from (..., n)."""
    return np.sqrt(((values - reference) ** 2).mean(axis=-1) / (reference**2).mean(axis=-1))


def observed_order(steps: np.ndarray, errors: np.ndarray) -> float:
    """Slope p of log(error) = p log(step) + c by least squares over (n,) steps [s] and errors, n >= 2."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def level_difference(density: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Difference of two power densities as level [dB], 10 log10(P / P_ref), of their shape."""
    return 10.0 * np.log10(density / reference)


ENERGY_CHANNELS = (
    "cam_angle", "cam_rate", "table_rate", "housing_rate", "deflection_1", "deflection_2", "deflection_3", "region_1",
)  # fmt: skip
"""Channels of a trajectory that `energies` needs."""


def energies(machine: Machine, channels: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Total energy and the cam's share of it [J], each (n,), of Model B on its base with play in joint 1 only.

    T = ½ J_C α̇² + ½ J_F (β' α̇ + θ̇)² + ½ J_t φ̇² + ½ J_b θ̇² and V = ½ k2 δ2² + ½ k3 δ3²
    (docs/explanation/physics.md): joint 1
    must stay inside its play, which the caller sees in region_1.
    """
    w, housing_rate = channels["cam_rate"], channels["housing_rate"]
    _, slope, _ = machine.motion_law.evaluate(channels["cam_angle"], machine.stations, machine.motion_share)
    cam = 0.5 * machine.cam_inertia * w**2
    others = (
        machine.follower_inertia * (slope * w + housing_rate) ** 2
        + machine.table_inertia * channels["table_rate"] ** 2
        + machine.housing_inertia * housing_rate**2
        + machine.output_joint.stiffness * channels["deflection_2"] ** 2
        + machine.base_joint.stiffness * channels["deflection_3"] ** 2
    )
    return cam + 0.5 * others, cam
