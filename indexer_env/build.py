"""The one door from plain mappings (YAML, Hydra, JSON) to the self-checking objects.

Keys are the fields' names; an angle's key may end in ``_deg`` and a speed's in ``_rpm``: its value is converted to the
SI field without the ending.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Mapping
from typing import Any, TypeVar

from indexer_env.checks import check_number, closest
from indexer_env.errors import ParameterError
from indexer_env.units import ENDINGS

_T = TypeVar("_T")


def from_mapping(
    cls: type[_T], mapping: Mapping[str, Any], owner: str | None = None, keys: Mapping[str, str] | None = None
) -> _T:
    """Build a frozen dataclass from a mapping of its fields.

    Parameters
    ----------
    cls : type
        The dataclass; its ``__post_init__`` checks the values.
    mapping : mapping
        Field names, with ``_deg`` keys of angles and ``_rpm`` keys of speeds converted, to plain values.
    owner : str, optional
        Name used in errors; the class's name where not given.
    keys : mapping, optional
        By field, the key in another unit under which a value was given that stands here in its SI unit.

    Raises
    ------
    ParameterError
        Not a mapping, an unknown or doubled key, a missing field, or what the class itself refuses.
    """
    owner = owner or cls.__name__
    if not isinstance(mapping, Mapping):
        raise ParameterError(f"{owner} must be a mapping of parameters to values, got {mapping!r}.")
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    typed = dict(keys or {})
    for key, value in mapping.items():
        name, number = _converted(owner, str(key), value, fields)
        typed.setdefault(name, str(key))
        if name in values:
            raise ParameterError(f"{owner}.{name} is given twice, once as {key!r}; keep one of them.")
        values[name] = number
    missing = [
        name
        for name, field in fields.items()
        if name not in values and field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise ParameterError(f"{owner} lacks {', '.join(missing)}; give a value for each.")
    try:
        return cls(**values)
    except ParameterError as error:
        refused = error.out_of_range
        if refused is not None and refused.owner in (cls.__name__, owner) and refused.name in typed:
            raise refused.given_as(owner, typed[refused.name]).error() from None
        said = str(error).replace(f"{cls.__name__}.", f"{owner}.")
        if said == str(error):
            raise
        raise ParameterError(said) from None


def check_keywords(owner: str, given: Collection[str], arguments: Collection[str], cls: type) -> None:
    """Refuse a keyword that is neither an argument of `owner` nor a field of `cls`, whose fields it takes too."""
    names = (*arguments, *(field.name for field in dataclasses.fields(cls)))
    for key in given:
        if key not in names:
            field_of(owner, key, names)


def field_of(owner: str, key: str, fields: Collection[str]) -> tuple[str, float]:
    """The SI field that a key stands for, and the factor to its unit: ("backlash", π/180) for ``backlash_deg``.

    `fields` are names, or dataclass fields by name, of which an effect's state their units.

    Raises
    ------
    ParameterError
        No field of this name, or one that is not measured in the unit of the ending.
    """
    if key in fields:
        return key, 1.0
    for ending, unit in ENDINGS.items():
        name = key.removesuffix(ending)
        if name != key and name in fields and ending in _endings(name, fields):
            return name, unit.factor
    # a heading such as "motor speed (rpm)" is led to its own unit
    plain = re.sub(r"\W+", "_", key).strip("_").lower()
    known = [*fields, *(f"{name}{ending}" for name in fields for ending in _endings(name, fields))]
    begun = max((name for name in fields if plain.startswith(f"{name}_")), key=len, default="")
    meant = closest(plain, known, 0.8) or begun or closest(plain, known)
    hint = f"did you mean {meant!r}" if meant else f"its parameters are {', '.join(fields) or 'none'}"
    if meant and meant == begun:
        endings = ", ".join(_endings(meant, fields))
        hint += ", which is in SI units" + (f", or an ending of {endings} for another one" if endings else "")
    raise ParameterError(f"{owner} has no parameter {key!r}; {hint}.")


def _endings(name: str, fields: Collection[str]) -> list[str]:
    """The endings that a field takes."""
    stated = fields[name].metadata.get("unit") if isinstance(fields, Mapping) else None
    return [ending for ending, unit in ENDINGS.items() if unit.measures(name, stated)]


def check_typed(owner: str, name: str, key: str, value: object) -> None:
    """Refuse what is no finite number under a key in a unit of the shop, such as `backlash_deg` for `backlash`."""
    check_number(owner, key, value, kind=f"a finite number in {ENDINGS[key.removeprefix(name)].name}")


def _converted(owner: str, key: str, value: Any, fields: Collection[str]) -> tuple[str, Any]:
    name, factor = field_of(owner, key, fields)
    if name == key:
        return name, value
    check_typed(owner, name, key, value)
    return name, value * factor
