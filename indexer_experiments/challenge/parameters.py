"""A machine's numbers by their names, read and replaced by the challenge itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import reduce
from typing import Any

from indexer_env.machine import Machine


def read(machine: Machine, name: str) -> float:
    """Value of ``field`` or ``joint.field``."""
    return float(reduce(getattr, name.split("."), machine))  # type: ignore[arg-type]


def changed(machine: Machine, values: Mapping[str, float]) -> Machine:
    """The machine with these values."""
    new: dict[str, Any] = {}
    for name, value in values.items():
        owner, _, field = name.rpartition(".")
        if owner:
            new[owner] = dataclasses.replace(new.get(owner, getattr(machine, owner)), **{field: value})
        else:
            new[name] = value
    return dataclasses.replace(machine, **new)
