"""The machine extended by what was found, as YAML that `indexer_env`, `datagen` and a second search load as it is."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from indexer_env.machine import Joint, Machine
from indexer_env.motion_law import MotionLaw, TableLaw
from indexer_env.sensors import Sensor


def machine_yaml(machine: Machine) -> str:
    """A machine as the YAML text that `load_machine` reads back equal (a law given as a table: to the last digits, as
    its angles stand in degrees)."""
    import yaml

    content: dict[str, Any] = {}
    for field in dataclasses.fields(machine):
        value = getattr(machine, field.name)
        if field.name == "effects":
            content["effects"] = {effect.name: _plain(dataclasses.asdict(effect)) for effect in value}
        elif isinstance(value, MotionLaw):
            content[field.name] = _law(value)
        elif isinstance(value, Joint):
            content[field.name] = _plain(dataclasses.asdict(value))
        else:
            content |= _plain({field.name: value})
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def sensor_yaml(sensor: Sensor) -> str:
    """A sensor as YAML text."""
    import yaml

    return yaml.safe_dump(_plain(dataclasses.asdict(sensor)), sort_keys=False)


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """The values as YAML knows them: a fit gives numpy's floats."""
    return {name: float(value) if isinstance(value, float) else value for name, value in values.items()}


def _law(law: MotionLaw) -> str | dict[str, Any]:
    if not isinstance(law, TableLaw):
        return law.name
    columns = (law.cam_angle, law.follower_angle)
    cam, follower = ([math.degrees(angle) for angle in column] for column in columns)
    return {"name": law.name, "cam_angle_deg": cam, "follower_angle_deg": follower}
