"""Checks for `__post_init__`: each returns quietly or raises one `ParameterError` sentence."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from numbers import Integral, Real

import numpy as np

from indexer_env.errors import OutOfRange, refuse


def check_number(
    owner: str,
    name: str,
    value: object,
    *,
    low: float | None = None,
    high: float | None = None,
    low_open: bool = False,
    high_open: bool = False,
    unit: str = "",
    remedy: str = "",
    kind: str = "a finite number",
) -> None:
    """Refuse what is not a real finite number (bool included) within the bounds, in the stated unit."""
    number = _as_float(value)
    inside = (
        math.isfinite(number)
        and (low is None or (number > low if low_open else number >= low))
        and (high is None or (number < high if high_open else number <= high))
    )
    if not inside:
        told = _as_yaml(value) or remedy
        raise OutOfRange(owner, name, value, kind, low, high, low_open, high_open, unit, told).error()


def as_python(owner: object, *names: str) -> None:
    """Make Python's numbers of NumPy's in these fields of a frozen dataclass: what is worked out from a float32 would
    be one, too."""
    for name in names:
        value = getattr(owner, name)
        if isinstance(value, np.generic):
            object.__setattr__(owner, name, value.item())


def _as_yaml(value: object) -> str:
    """The remedy for a number that YAML takes for a text: 8e3, whose exponent needs a point before it and a sign."""
    if not isinstance(value, str) or "e" not in value.lower():
        return ""
    try:
        number = float(value)
    except ValueError:
        return ""
    if not math.isfinite(number):
        return ""
    digits, exponent = f"{number:.15e}".split("e")
    whole, _, rest = digits.partition(".")
    short = f"{whole}.{rest.rstrip('0') or '0'}e{int(exponent):+d}"
    return f"write {short}" if "e" in repr(number) else f"write {number!r} or {short}"


def _as_float(value: object) -> float:
    """A real number's value, infinite where it is too large for a float; NaN for what is not one, a bool included."""
    if isinstance(value, float):  # first, as it is by far the commonest and a question to an abstract class is slow
        return value
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def check_integer(
    owner: str,
    name: str,
    value: object,
    *,
    low: int | None = None,
    high: int | None = None,
    unit: str = "",
    remedy: str = "",
) -> None:
    """Refuse what is not a whole number (bool and 3.0 included) within the bounds."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise OutOfRange(owner, name, value, "a whole number", low, high, unit=unit, remedy=remedy).error()
    check_number(owner, name, value, low=low, high=high, unit=unit, remedy=remedy, kind="a whole number")


def check_choice(owner: str, name: str, value: object, choices: Iterable[str]) -> None:
    """Refuse what is not one of the named choices, with the nearest one as the remedy."""
    names = list(choices)
    if not isinstance(value, str) or value not in names:
        told = ", ".join(repr(choice) if "," in choice else choice for choice in names)
        raise refuse(owner, name, f"one of {told}", value, did_you_mean(value, names))


def closest(value: object, names: Iterable[str], likeness: float = 0.5) -> str:
    """The name that is most like a misspelled one, at least so much (`difflib`); "" where none is."""
    return next(iter(difflib.get_close_matches(str(value), list(names), n=1, cutoff=likeness)), "")


def did_you_mean(value: object, names: Iterable[str]) -> str:
    """The remedy for a misspelled name: ``did you mean 'x'?`` without the question mark, or an empty string."""
    meant = closest(value, names)
    return f"did you mean {meant!r}" if meant else ""
