"""A case as the columns of a row, and a row as the case again: nothing else in the project flattens or
rebuilds a machine."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from datagen.campaign import Case, Label
from datagen.quantities import JOINTS
from datagen.schema import SCHEMA_VERSION
from datagen.versions import versions_of
from indexer_env.device import CPU, cuda_of
from indexer_env.drive_sensors import DriveSensors
from indexer_env.effects import MachineEffect, make_effect
from indexer_env.effects.joint import InputBacklash, OutputBacklash
from indexer_env.machine import Joint, Machine
from indexer_env.motion_law import MOTION_LAWS, MotionLaw
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.simulate import Run

_FORMER_NAMES = {
    "input.backlash": {"play": "backlash"},
    "output.backlash": {"play": "backlash"},
    "base.looseness": {"play": "backlash"},
    "roller.crack": {"severity": "stiffness_loss"},
    "roller.crack_single": {"severity": "stiffness_loss"},
}
"""Parameters of effects by names that stored data sets may still hold."""

_WRITTEN_AS_TEXT = ("motion_law", "effects", *JOINTS)


@dataclass(frozen=True)
class Remade:
    """What a row says of its making: everything `datagen.remake` needs to make the record again."""

    machine: Machine
    operating_point: OperatingPoint
    run: Run
    sensor: Sensor
    drive_sensors: DriveSensors
    seed: int
    item: int
    device: str = CPU


def label_columns(label: Label) -> dict[str, Any]:
    """The columns of a label."""
    return {
        "class": label.number,
        "class_name": label.name,
        "code": label.code,
        "subset": label.subset,
        "machine_draw": label.machine_draw,
        "remaining_turns": label.remaining_turns,
    }


def case_columns(case: Case) -> dict[str, Any]:
    """Label, item, machine, faults, operating point and sensor of a case, by column name."""
    return {
        "unit": case.sensor.unit,
        **label_columns(case.item.label),
        "item": case.item.index,
        **machine_columns(case.machine),
        **{f"fault_{name}": severity for name, severity in case.severities.items()},
        **_fields(case.operating_point),
        **sensor_columns(case.sensor),
    }


def machine_columns(machine: Machine) -> dict[str, Any]:
    """A machine by column name; exact, so that `machine_of` gives an equal machine back."""
    columns = _fields(machine, leave_out=_WRITTEN_AS_TEXT)
    columns["machine_name"] = columns.pop("name")
    law = machine.motion_law
    columns["motion_law"] = law.name
    columns["motion_law_parameters"] = _law_as_text(law)
    for name in JOINTS:
        columns.update(_fields(getattr(machine, name), f"{name}_"))
    for name, kind in (("input_joint", InputBacklash), ("output_joint", OutputBacklash)):
        added = sum(effect.backlash for effect in machine.effects if isinstance(effect, kind))
        columns[f"{name}_backlash_total"] = columns[f"{name}_backlash"] + added
    columns["effects"] = json.dumps([{"name": effect.name, **dataclasses.asdict(effect)} for effect in machine.effects])
    return columns


def sensor_columns(sensor: Sensor) -> dict[str, Any]:
    """A sensor by column name."""
    return _fields(sensor, "sensor_")


def run_columns(run: Run) -> dict[str, Any]:
    """A run, whose samples are set, by column name."""
    return {
        "simulation_rate": float(run.sample_rate),
        "simulation_samples": run.samples,
        "step": None if run.step is None else float(run.step),
        "warmup_limit": run.warmup_turns,
        "warmup_tolerance": float(run.warmup_tolerance),
    }


def device_columns(device: str) -> dict[str, Any]:
    """Which GPU simulated a row; none where a CPU did."""
    cuda = cuda_of("datagen", device)
    return {"device": cuda.name} if cuda else {}


def drive_columns(sensors: DriveSensors) -> dict[str, Any]:
    """How the signals of the drive were read; none where there are none."""
    return {"drive_sensors": json.dumps(dataclasses.asdict(sensors))} if sensors.signals else {}


@functools.cache
def version_columns() -> dict[str, Any]:
    """Versions of what makes a record, by column name."""
    package, numpy, scipy, numba = versions_of(("indexer-diagnosis", "numpy", "scipy", "numba")).values()
    return {
        "schema_version": SCHEMA_VERSION,
        "package_version": package,
        "numpy_version": numpy,
        "scipy_version": scipy,
        "numba_version": numba,
    }


def made_with() -> dict[str, str]:
    """The same versions by the name of what they are of, without that of the schema."""
    columns = version_columns()
    return {name.removesuffix("_version"): columns[name] for name in columns if name != "schema_version"}


def machine_of(row: Mapping[str, Any]) -> Machine:
    """The machine of a row, equal to the one it was written from."""
    names = [field.name for field in dataclasses.fields(Machine) if field.name not in _WRITTEN_AS_TEXT]
    return Machine(
        **{name: row["machine_name" if name == "name" else name] for name in names},
        motion_law=_law(row["motion_law"], json.loads(row["motion_law_parameters"])),
        effects=tuple(_effect(entry) for entry in json.loads(row["effects"])),
        **{name: _object(Joint, row, f"{name}_") for name in JOINTS},
    )


def remade(row: Mapping[str, Any]) -> Remade:
    """The objects that a row (a mapping of its columns) was made with."""
    run = Run(
        sample_rate=row["simulation_rate"],
        samples=row["simulation_samples"],
        step=row["step"],
        warmup_turns=row["warmup_limit"],
        warmup_tolerance=row["warmup_tolerance"],
    )
    operating_point = _object(OperatingPoint, row)
    drive = DriveSensors(**json.loads(row["drive_sensors"])) if row.get("drive_sensors") else DriveSensors()
    sensor = _object(Sensor, row, "sensor_")
    device = "cuda" if row.get("device") else CPU
    return Remade(machine_of(row), operating_point, run, sensor, drive, row["seed"], row["item"], device)


def effects_of_faults(row: Mapping[str, Any]) -> set[str]:
    """Names of the effects that a row's machine must have for the severities in its columns."""
    crack = "roller.crack" if row["fault_cracked_station"] is None else "roller.crack_single"
    effects = {"roller_crack": crack, "screw_looseness": "base.looseness", "backlash": "input.backlash"}
    return {effect for name, effect in effects.items() if row[f"fault_{name}"] > 0.0}


def _fields(target: Any, prefix: str = "", leave_out: tuple[str, ...] = ()) -> dict[str, Any]:
    return {column: getattr(target, name) for column, name in _column_names(type(target), prefix, leave_out)}


@functools.cache
def _column_names(kind: type, prefix: str, leave_out: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Column and field name of each field of a dataclass that is written as it is."""
    names = [field.name for field in dataclasses.fields(kind) if field.name not in leave_out]
    return tuple((prefix + name, name) for name in names)


@functools.lru_cache(maxsize=256)
def _law_as_text(law: MotionLaw) -> str:
    return json.dumps(dataclasses.asdict(law))  # type: ignore[call-overload]


def _object(kind: type, row: Mapping[str, Any], prefix: str = "") -> Any:
    return kind(**{field.name: row[prefix + field.name] for field in dataclasses.fields(kind)})


def _law(name: str, parameters: Mapping[str, Any]) -> MotionLaw:
    return MOTION_LAWS[name](**{key: tuple(value) for key, value in parameters.items()})


def _effect(entry: Mapping[str, Any]) -> MachineEffect:
    former = _FORMER_NAMES.get(entry["name"], {})
    effect = make_effect(entry["name"], {former.get(key, key): value for key, value in entry.items() if key != "name"})
    assert isinstance(effect, MachineEffect)
    return effect
