"""Fields of frozen objects by dotted path ("output_joint.stiffness"): read, and replaced all at once."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, TypeVar

from indexer_env.checks import did_you_mean
from indexer_env.errors import refuse

T = TypeVar("T")


def with_changes(target: T, changes: Mapping[str, Any]) -> T:
    """A copy of a frozen dataclass with the fields at these dotted paths replaced, all at once, so that only
    the final object has to pass its checks.

    Raises
    ------
    ParameterError
        A path that leads nowhere, or a value that the object refuses.
    """
    if not changes:
        return target
    new: dict[str, Any] = {}
    inner: dict[str, dict[str, Any]] = {}
    for path, value in changes.items():
        head, _, rest = path.partition(".")
        _check_field(target, head, path)
        if rest:
            inner.setdefault(head, {})[rest] = value
        else:
            new[head] = value
    for head, below in inner.items():
        new[head] = with_changes(new.get(head, getattr(target, head)), below)
    return dataclasses.replace(target, **new)  # type: ignore[type-var]


def value_at(target: object, path: str) -> Any:
    """The field at a dotted path, e.g. value_at(machine, "output_joint.stiffness"); ParameterError where
    there is none."""
    for name in path.split("."):
        _check_field(target, name, path)
        target = getattr(target, name)
    return target


def _check_field(target: object, name: str, path: str) -> None:
    known = _fields(type(target))
    if name not in known:
        raise refuse(type(target).__name__, name, f"a field ({path})", name, did_you_mean(name, known))


@functools.cache
def _fields(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else ()
