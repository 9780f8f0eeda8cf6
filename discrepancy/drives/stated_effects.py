"""The effects that a user's file states, asks for or brings, checked before any record is read."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping
from typing import Any

from discrepancy.drives.effects import EFFECTS, DriveEffect
from discrepancy.drives.effects.base import exponents
from indexer_env.checks import did_you_mean
from indexer_env.errors import refuse

ACTS = ("force", "dry", "reading")
"""What the law of an effect may give."""


def texts(name: str, key: str, rule: str, given: Any) -> tuple[str, ...]:
    """A tuple of texts as a file states it; anything else is refused by this rule."""
    if not isinstance(given, list | tuple) or not all(isinstance(one, str) for one in given):
        raise refuse(name, key, rule, given)
    return tuple(given)


def effects_stated(owner: str, key: str, given: Any) -> Mapping[str, Mapping[str, float]]:
    """Effects with their parameters' values as a file states them; anything else is refused."""
    named = isinstance(given, Mapping) and all(isinstance(name, str) for name in given)
    if not named or not all(isinstance(values, Mapping) for values in given.values()):
        rule = "a mapping of effects to their parameters, {'friction.coulomb': {'force': 4.0}}"
        raise refuse(owner, key, rule, given)
    return given


def effects_of(name: str, found: Mapping[str, Any], known: Mapping[str, Any]) -> tuple[DriveEffect, ...]:
    """Effects that may be missing, and those known: these are not looked for."""
    own = found.get("own_effects", ())
    if not isinstance(own, list | tuple) or not all(isinstance(one, DriveEffect) for one in own):
        raise refuse(name, "own_effects", "a tuple of discrepancy.drives.DriveEffect", own)
    rule = "a tuple of names or patterns, ('friction.*', 'delay')"
    patterns = texts(name, "effects", rule, found.get("effects", ("*",)))
    for pattern in patterns:
        if not fnmatch.filter(EFFECTS, pattern):
            hint = did_you_mean(pattern, EFFECTS) or f"they are {', '.join(EFFECTS)}"
            raise refuse(name, "effects", "names or patterns of standard effects", pattern, hint)
    names = [one.name for one in own]
    for one in own:
        if one.name in EFFECTS or names.count(one.name) > 1:
            raise refuse(name, "own_effects", "effects with names of their own", one.name)
        _check_own(name, one)
    standard = [e for key, e in EFFECTS.items() if any(fnmatch.fnmatch(key, one) for one in (*patterns, *known))]
    return (*standard, *own)


def _check_own(name: str, effect: DriveEffect) -> None:
    """Refuse an effect of a user's that no fit could use."""
    key = f"own_effects[{effect.name!r}]"
    if effect.acts not in ACTS:
        raise refuse(name, f"{key}.acts", f"one of {', '.join(ACTS)}", effect.acts, did_you_mean(effect.acts, ACTS))
    for size in effect.sizes:
        where = f"{key}, {size.name!r}"
        try:
            exponents(size.dimension)
        except ValueError:
            rule = "a product of scales such as 'F V-1', or ''"
            raise refuse(name, f"{where} (dimension)", rule, size.dimension, "F is a force, Q a position") from None
        starts = size.starts
        if not isinstance(starts, tuple) or not all(isinstance(one, int | float) for one in starts):
            raise refuse(name, f"{where} (starts)", "a tuple of numbers, (0.1, 0.3)", starts)
        if starts and not size.step and all(one == (size.null or 0.0) for one in starts):
            raise refuse(name, f"{where} (starts)", "one or more that are not nothing", starts)
