"""The library of effects by which the model can be extended; environment, generator and discrepancy workflow share it.

Reading order
-------------
base      Effect, MachineEffect, SensorEffect: parameters with unit, range and null value; the registry
measures  the machine's own measures, in which effects state where a search begins
friction  friction.coulomb · friction.viscous · friction.stribeck
load      load.imbalance · load.process
drive     drive.slip · drive.speed_ripple · drive.transmission_error · drive.mesh_stiffness ·
          drive.mesh_friction
cam       cam.profile_error · cam.station_spacing
roller    roller.crack · roller.crack_single
joint     input.backlash · output.backlash · output.cubic_stiffness · base.looseness
tabulated tabulated.speed · tabulated.angle · tabulated.cam · tabulated.deflection · tabulated.speed_angle ·
          tabulated.speed_cam · tabulated.deflection_rate · tabulated.profile: tables, not laws
spline    the numbers of a table's cubic spline
sensor    sensor.gain · sensor.lowpass · sensor.highpass · sensor.bracket_resonance · sensor.mains_hum ·
          sensor.offset_drift

A new effect is one class in one of these files; what enters the equations of motion in a new place also gets its scalar
equation in kernels/effects.py and a line in kernels/rates.py.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from typing import Any

from indexer_env.checks import did_you_mean
from indexer_env.effects import cam, drive, friction, joint, load, roller, sensor, tabulated
from indexer_env.effects.base import EFFECTS, Effect, MachineEffect, SensorEffect, sizes
from indexer_env.effects.tabulated import TABLES
from indexer_env.errors import ParameterError, refuse

__all__ = ["EFFECTS", "LOADABLE", "TABLES", "Effect", "MachineEffect", "SensorEffect", "effects_by_name", "make_effect"]

_FAMILIES = (cam, drive, friction, joint, load, roller, sensor, tabulated)

LOADABLE: Mapping[str, type[Effect]] = ChainMap(EFFECTS, dict(TABLES))
"""What a machine or a sensor may be extended by: the library, and tables."""


def make_effect(name: str, parameters: Mapping[str, object] | None = None, **more: object) -> Effect:
    """Build an effect by its name, its parameters given as a mapping or as keywords.

    An angle given under a key that ends in ``_deg`` is converted to radians.

    Raises
    ------
    ParameterError
        Unknown effect, unknown, missing or ill-valued parameter.
    """
    from indexer_env.build import from_mapping

    _check_known(name)
    if not isinstance(parameters, Mapping | None):
        raise ParameterError(f"{name} must be a mapping of parameters to values, got {parameters!r}.")
    return from_mapping(LOADABLE[name], {**(parameters or {}), **more}, owner=name)


def effects_by_name(mapping: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters by effect, of a mapping (YAML) by name, ``{friction.coulomb: {torque: 3}}``, or by family and effect,
    ``{friction: {coulomb: {torque: 3}}}``, which is how a dotted key of a command line reads.

    Raises
    ------
    ParameterError
        Unknown effect, or one given twice.
    """
    named: dict[str, Any] = {}
    families = {name.partition(".")[0] for name in LOADABLE}
    for key, below in mapping.items():
        in_family = key in families and isinstance(below, Mapping)
        entries = {f"{key}.{end}": value for end, value in below.items()} if in_family else {key: below}
        for name, parameters in entries.items():
            _check_known(name)
            if name in named:
                raise refuse("effects", name, "given once", parameters)
            named[name] = parameters
    return named


def _check_known(name: str) -> None:
    if name not in LOADABLE:
        hint = did_you_mean(name, LOADABLE) or "the names are " + ", ".join(sorted(LOADABLE))
        raise ParameterError(f"There is no effect {name!r}; {hint}.")


def null_effect(name: str) -> Effect:
    """The effect at its null value, other parameters at their defaults."""
    cls = LOADABLE[name]
    return cls(**{field.name: field.metadata["null"] for field in sizes(cls)})
