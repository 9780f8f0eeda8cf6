"""Machines, and a visible size for each effect, that many tests share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import pytest

from indexer_env.effects import Effect, make_effect
from indexer_env.machine import Machine
from indexer_env.presets import load_machine

VISIBLE: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "friction.coulomb": {"torque": 20.0},
        "friction.viscous": {"coefficient": 15.0},
        "friction.stribeck": {"torque": 20.0},
        "load.imbalance": {"torque": 30.0, "phase": 0.4},
        "load.process": {"torque": 50.0},
        "drive.slip": {"compliance": 2.0},
        "drive.speed_ripple": {"depth": 0.05},
        "drive.transmission_error": {"amplitude": 1e-3},
        "drive.mesh_stiffness": {"depth": 0.3},
        "drive.mesh_friction": {"loss": 0.2},
        "cam.profile_error": {"height": 1e-3},
        "cam.station_spacing": {"error": 0.02, "station": 1},
        "roller.crack": {"stiffness_loss": 0.4},
        "roller.crack_single": {"stiffness_loss": 0.4, "station": 0},
        "input.backlash": {"backlash": 5e-3},
        "output.backlash": {"backlash": 1e-3},
        "output.cubic_stiffness": {"stiffness": 1e9},
        "base.looseness": {"compliance": 1.0 / 3e6},
        "sensor.gain": {"error": 0.1},
        "sensor.lowpass": {"time_constant": 2e-3},
        "sensor.highpass": {"corner": 2.0},
        "sensor.bracket_resonance": {"inverse_square": 1e-6},
        "sensor.mains_hum": {"amplitude": 0.3},
        "sensor.offset_drift": {"rate": 0.5},
    }
)
"""A size of each effect that shows plainly in a record of the smooth machine."""


@pytest.fixture(scope="session")
def smooth() -> Machine:
    """The reference machine without any play."""
    return load_machine("smooth")


@pytest.fixture(scope="session")
def reference() -> Machine:
    return load_machine("reference")


@pytest.fixture(scope="session")
def visible() -> Callable[..., Effect]:
    """`visible(name, **other)`: the effect at its visible size, some of its parameters replaced."""

    def build(name: str, **other: float) -> Effect:
        return make_effect(name, {**VISIBLE[name], **other})

    return build
