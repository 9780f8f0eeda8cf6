"""machine.yaml of a drive: its parameters and effects as found, which a second look takes as what is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from discrepancy.drives.description import LOAD, Drive, known_parameter
from discrepancy.drives.effects import EFFECTS, TABLES, DriveEffect, Size
from discrepancy.drives.effects.tabulated import ends_of
from discrepancy.drives.sessions import Slots, stated
from discrepancy.drives.stated_effects import effects_stated
from discrepancy.model import Hypothesis, Parameter
from discrepancy.place import Point
from discrepancy.records.machine import DRIVE
from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse


def machine_yaml(drive: Drive, slots: Slots, known: tuple[Hypothesis, ...], place: Point, names: Sequence[str]) -> str:
    """A fitted place as text: values of the drive's own parameters, then of the effects, those known before first; of
    what differs between the records of these names the mean, and each record's own at the end."""
    import yaml

    effects = (*known, *place.hypothesis.effects)
    found = {p.name: float(v) for p, v in zip(place.hypothesis.parameters, place.values, strict=True)}
    values = {**slots.typical(place.z), **found}
    content: dict[str, Any] = {DRIVE: drive.path.name}
    content["parameters"] = {p.name: {"value": values[p.name], "unit": p.unit} for p in drive.parameters}
    content["effects"] = {
        one.name: {
            **{p.name.removeprefix(f"{one.name}."): values[p.name] for p in one.parameters},
            **{key: float(value) for key, value in one.fixed.items()},
        }
        for one in effects
    }
    if own := stated(slots, place.z, names):
        content["records"] = own
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def looked_at(drive: Drive, mapping: Mapping[str, Any]) -> Drive:
    """The drive with its parameters' values as a machine.yaml has them, and with the effects that this names; their
    uncertainties stay, as shares of the value.

    Raises
    ------
    ParameterError
        It is of another drive, names a parameter that the file does not have, or holds something else than values.
    """
    if mapping.get(DRIVE) != drive.path.name:
        remedy = "give the machine.yaml that a look at this drive has left"
        raise refuse("discrepancy", "machine", f"of the drive {drive.path.name}", mapping.get(DRIVE), remedy)
    given = mapping.get("parameters") or {}
    if not isinstance(given, Mapping):
        remedy = "write parameters: {NAME: {value: NUMBER}}"
        raise refuse("machine", "parameters", "a mapping of names to values", given, remedy)
    stated = effects_stated("machine", "effects", mapping.get("effects") or {})
    more = tuple(effect for name, effect in EFFECTS.items() if name in stated and effect not in drive.effects)
    parameters = []
    for p in drive.parameters:
        row = given.get(p.name, {"value": p.nominal})
        if not isinstance(row, Mapping):
            remedy = f"write {p.name}: {{value: NUMBER, unit: {p.unit}}}"
            raise refuse("machine", p.name, f"a mapping with its value [{p.unit}]", row, remedy)
        if (unit := row.get("unit", p.unit)) != p.unit:
            raise refuse("machine", f"{p.name} (unit)", f"{p.unit}, as in {drive.path.name}", unit, "convert the value")
        check_number("machine", p.name, row.get("value"), unit=p.unit)
        value = float(row["value"])
        spread = p.scale * abs(value) if p.logarithmic else p.scale
        parameters.append(known_parameter(p.name, p.unit, value, spread))
    for name in given:
        check_choice("machine", "parameters", name, [p.name for p in drive.parameters])
    return dataclasses.replace(drive, parameters=tuple(parameters), effects=(*drive.effects, *more))


def known_effects(
    drive: Drive, machine: Mapping[str, Any], library: Mapping[str, tuple[Hypothesis, ...]]
) -> tuple[Hypothesis, ...]:
    """Effects that a drive's file (`known`) or a machine.yaml (`effects`, which goes first) states, as hypotheses
    nominal at the values given.

    Raises
    ------
    ParameterError
        An effect or a parameter that the drive does not have, or a value that it cannot have.
    """
    given = machine.get("effects") or {}
    own = {name: values for name, values in drive.known.items() if name not in given}
    return (
        *_known(drive, own, library, drive.path.name, "known"),
        *_known(drive, given, library, "machine", "effects"),
    )


def _known(
    drive: Drive, stated: Mapping[str, Any], library: Mapping[str, tuple[Hypothesis, ...]], owner: str, key: str
) -> tuple[Hypothesis, ...]:
    found = []
    for name, values in stated.items():
        if name in TABLES:
            if TABLES[name].load and (drive.forward or LOAD[0] not in drive.channels):
                rule = "a table over what the drive measures"
                raise refuse(owner, key, rule, name, "it needs the inverse form with the role 'q_load'")
            found.append(_table(name, values, owner))
            continue
        effect = next((e for e in drive.effects if e.name == name), None)
        if effect is not None and name not in library:
            rule = "effects that this form has, the records can show and the drive's own parameters do not describe"
            raise refuse(owner, key, rule, name, "leave it out")
        check_choice(owner, key, name, library)
        assert effect is not None
        found.append(_stated(effect, library[name], values, owner))
    return tuple(found)


def _table(name: str, values: Mapping[str, Any], owner: str) -> Hypothesis:
    """A table as it stands, nothing of it to be fitted: it would take up whatever is looked for beside it."""
    keys = (*ends_of(name), *(size.name for size in TABLES[name].sizes))
    for key in (*values, *keys):
        check_choice(owner, name, key, keys)
        check_number(owner, f"{name}.{key}", values.get(key))
    for low, high in zip(ends_of(name)[::2], ends_of(name)[1::2], strict=True):
        if not values[low] < values[high]:
            raise refuse(owner, f"{name}.{high}", f"above {low}, {values[low]:g}", values[high])
    return Hypothesis(name, (), {key: float(values[key]) for key in keys})


def _stated(effect: DriveEffect, choices: tuple[Hypothesis, ...], values: Mapping[str, Any], owner: str) -> Hypothesis:
    names = (*(size.name for size in effect.sizes), *choices[0].fixed)
    for key, value in values.items():
        check_choice(owner, effect.name, key, names)
        check_number(owner, f"{effect.name}.{key}", value)
    chosen = next((c for c in choices if all(values.get(k) == v for k, v in c.fixed.items())), None)
    if chosen is None or not set(names) <= set(values):
        raise refuse(owner, effect.name, f"given with {', '.join(names)}", dict(values))
    parameters = tuple(
        _nominal(p, size, float(values[size.name]), owner)
        for p, size in zip(chosen.parameters, effect.sizes, strict=True)
    )
    return dataclasses.replace(chosen, parameters=parameters, starts=((),), effects=())


def _nominal(p: Parameter, size: Size, value: float, owner: str) -> Parameter:
    """A parameter at the value stated. Bounds that a search takes from the record give way to it; a sign, and the range
    of a plain number, do not."""
    if not size.dimension:
        check_number(owner, p.name, value, low=p.low, high=p.high)
    elif p.low >= 0.0:
        check_number(owner, p.name, value, low=0.0, low_open=p.low > 0.0, unit=p.unit)
    return dataclasses.replace(p, nominal=value, low=min(p.low, value), high=max(p.high, value))
