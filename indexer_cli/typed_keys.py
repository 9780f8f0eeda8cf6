"""Parameters as objects name them -> keys as they are typed on a command's line.

An object knows its own name, `Psd.resolution_hz`, and not where a command keeps it, `features.resolution_hz`. The one
table between the two stands here and is read at the door of all commands.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Any

from indexer_env.errors import OutOfRange
from indexer_env.units import ENDINGS

OWNERS: dict[str, tuple[str, ...]] = {
    "Machine": ("machine",),
    "effects": ("machine.effects",),
    "motion_law": ("machine.motion_law",),
    "OperatingPoint": ("operating_point",),
    "Sensor": ("sensor",),
    "Faults": ("faults",),
    "Run": ("run",),
    "DriveSensors": ("drive_sensors",),
    "read": ("known",),
    "Conditions": ("known",),
    "Experiment": ("known",),
    "Psd": ("features",),
    "Fft": ("features",),
    "Mlp": ("net",),
    "Criteria": ("",),
    "datagen": ("",),
    "classifier": ("",),
    "discrepancy": ("",),
    "twin": ("",),
    "train": ("",),
    "command": ("",),
}
"""Owner of a parameter in a sentence -> the sections of a configuration that may hold it; "" is its root, where what
belongs to the command itself stands too."""

_SECTIONS = ("effects", "motion_law")
"""Owners that are sections already, named without where they lie."""

_EFFECTS = "machine.effects"
_UNITS = ("", *ENDINGS)
_PARAMETER = re.compile(r"(?<![\w./'\"-])[A-Za-z_][\w-]*(?:\.\w+)+")


def as_typed(sentence: str, command: str, keys: Collection[str], refused: OutOfRange | None = None) -> str:
    """The sentence with every parameter named by its key on the command's line, where it has one.

    `keys` are the dotted keys of the command's configuration, see `dotted`; a key in degrees or rpm stands for the
    parameter in SI units. `refused` is the number out of its range that the sentence is about, which is told in the
    key's unit.
    """
    owners = {**OWNERS, command: ("",)}

    def typed(named: str) -> str:
        owner, _, name = named.partition(".")
        sections = [section for section in owners.get(owner, ()) if not section or section in keys]
        whole = [f"{section}.{name}" if section else name for section in sections]
        candidates = [key + unit for key in (named, *whole, f"{_EFFECTS}.{named}") for unit in _UNITS]
        if found := next((key for key in candidates if key in keys), None):
            return found
        if owner in keys:
            return named
        # A section may be given as one value, machine.motion_law=cycloidal, whose parts have no key.
        values = [section for section in sections if not any(key.startswith(f"{section}.") for key in keys)]
        return next(iter([*filter(None, values), *(whole if owner in _SECTIONS else ())]), named)

    if refused is not None:
        owner, _, key = typed(f"{refused.owner}.{refused.name}").rpartition(".")
        if key.removeprefix(refused.name) in ENDINGS:
            sentence = sentence.replace(str(refused.error()), str(refused.given_as(owner, key).error()))
    return _PARAMETER.sub(lambda match: typed(match[0]), sentence)


def dotted(config: Mapping[Any, Any], before: str = "") -> set[str]:
    """The keys of a configuration at all levels, as they are typed: {"read", "read.unit", …}."""
    keys: set[str] = set()
    for key, value in config.items():
        keys.add(f"{before}{key}")
        if isinstance(value, Mapping):
            keys |= dotted(value, f"{before}{key}.")
    return keys
