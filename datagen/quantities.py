"""The quantities that a campaign can vary, by dotted path from the configuration's sections, in SI units:
"machine.output_joint.stiffness", "faults.backlash", "effects.friction.coulomb.torque", "sensor.noise_density".
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping
from typing import Any

from indexer_env.build import field_of
from indexer_env.checks import check_choice
from indexer_env.effects import LOADABLE, effects_by_name
from indexer_env.errors import ParameterError, refuse
from indexer_env.faults import STATES, Faults, fault_laws
from indexer_env.law_reader import law_of_field
from indexer_env.laws import Law
from indexer_env.machine import Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor

JOINTS = ("input_joint", "output_joint", "base_joint")


def _names(kind: type, leave_out: tuple[str, ...] = ()) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind) if field.name not in leave_out)


FIELDS: dict[str, tuple[str, ...]] = {
    "machine": _names(Machine, leave_out=(*JOINTS, "effects")),
    **{f"machine.{joint}": _names(Joint) for joint in JOINTS},
    "operating_point": _names(OperatingPoint),
    "faults": _names(Faults),
    # Records of one data set share their rate.
    "sensor": _names(Sensor, leave_out=("sample_rate",)),
}
"""Fields that can be varied, by the section they stand in; effects have those of `LOADABLE`."""

SECTIONS = ("machine", "operating_point", "faults", "effects", "sensor")


def _fields(effect: str) -> dict[str, dataclasses.Field]:
    """The parameters of an effect, which state their units."""
    return {field.name: field for field in dataclasses.fields(LOADABLE[effect])}


def laws_by_path(mapping: Mapping[str, Any], owner: str) -> dict[str, Law]:
    """Law by dotted path of a mapping (YAML) of sections, e.g. {machine: {output_joint: {stiffness: LAW}}, faults:
    {backlash_deg: LAW}, effects: {friction.coulomb: {torque: LAW}}}.

    Raises
    ------
    ParameterError
        Unknown section, quantity or law, or a quantity given twice.
    """
    laws: dict[str, Law] = {}
    for section, below in _mapping(owner, mapping).items():
        check_choice(owner, "key", section, SECTIONS)
        laws |= _READERS.get(section, _section)(_mapping(f"{owner}.{section}", below), section, owner)
    return laws


def path_of(key: str) -> str | None:
    """The quantity that a dotted key of the configuration stands for, None where it stands for none:
    "faults.backlash" for "faults.backlash_deg", "effects.friction.coulomb.torque" also below "machine."."""
    section, _, name = key.rpartition(".")
    if section == "faults" and name in STATES:
        return f"faults.{STATES[name][0]}"
    fields: Collection[str] = FIELDS.get(section, ())
    above, _, effect = section.partition("effects.")
    if above in ("", "machine.") and effect in LOADABLE:
        section, fields = f"effects.{effect}", _fields(effect)
    try:
        return f"{section}.{field_of(section, name, fields)[0]}" if fields else None
    except ParameterError:
        return None


def _section(mapping: Mapping[str, Any], section: str, owner: str) -> dict[str, Law]:
    laws: dict[str, Law] = {}
    for key, given in mapping.items():
        name, law = law_of_field(f"{owner}.{section}", key, given, FIELDS[section])
        _put(laws, f"{section}.{name}", law, owner)
    return laws


def _machine(mapping: Mapping[str, Any], section: str, owner: str) -> dict[str, Law]:
    laws = _section({key: given for key, given in mapping.items() if key not in JOINTS}, section, owner)
    for joint in JOINTS:
        below = _mapping(f"{owner}.{section}.{joint}", mapping.get(joint, {}))
        laws |= _section(below, f"{section}.{joint}", owner)
    return laws


def _faults(mapping: Mapping[str, Any], section: str, owner: str) -> dict[str, Law]:
    return {f"{section}.{name}": law for name, law in fault_laws(mapping, FIELDS[section]).items()}


def _effects(mapping: Mapping[str, Any], section: str, owner: str) -> dict[str, Law]:
    laws: dict[str, Law] = {}
    for effect, parameters in effects_by_name(mapping).items():
        place = f"{owner}.{section}.{effect}"
        fields = _fields(effect)
        for key, given in _mapping(place, parameters).items():
            name, law = law_of_field(place, key, given, fields)
            _put(laws, f"{section}.{effect}.{name}", law, owner)
    return laws


_READERS: dict[str, Callable[[Mapping[str, Any], str, str], dict[str, Law]]] = {
    "machine": _machine,
    "faults": _faults,
    "effects": _effects,
}


def _put(laws: dict[str, Law], path: str, law: Law, owner: str) -> None:
    if path in laws:
        raise refuse(owner, path, "given by one key", law, "leave out the one in other units")
    laws[path] = law


def _mapping(owner: str, given: object) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        raise ParameterError(f"{owner} must be a mapping of quantities to laws, got {given!r}.")
    return given
