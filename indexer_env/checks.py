"""Checks for `__post_init__`: each returns quietly or raises one `ParameterError` sentence."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from numbers import Integral, Real

from indexer_env.errors import refuse


def _rule(kind: str, low: float | None, high: float | None, low_open: bool, high_open: bool, unit: str) -> str:
    bounds = []
    if low is not None:
        bounds.append(f"{'>' if low_open else '>='} {low:g}")
    if high is not None:
        bounds.append(f"{'<' if high_open else '<='} {high:g}")
    text = f"{kind} {' and '.join(bounds)}".strip()
    return f"{text} {unit}".strip() if unit not in ("", "-") else text


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
    number = math.nan
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    too_low = low is not None and (number < low or (low_open and number == low))
    too_high = high is not None and (number > high or (high_open and number == high))
    if too_low or too_high or not math.isfinite(number):
        raise refuse(owner, name, _rule(kind, low, high, low_open, high_open, unit), value, remedy)


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
        raise refuse(owner, name, _rule("a whole number", low, high, False, False, unit), value, remedy)
    check_number(owner, name, value, low=low, high=high, unit=unit, remedy=remedy, kind="a whole number")


def check_choice(owner: str, name: str, value: object, choices: Iterable[str]) -> None:
    """Refuse what is not one of the named choices, with the nearest one as the remedy."""
    names = list(choices)
    if not isinstance(value, str) or value not in names:
        raise refuse(owner, name, "one of " + ", ".join(names), value, did_you_mean(value, names))


def did_you_mean(value: object, names: Iterable[str]) -> str:
    """The remedy for a misspelled name: ``did you mean 'x'?`` without the question mark, or an empty string."""
    close = difflib.get_close_matches(str(value), list(names), n=1, cutoff=0.5)
    return f"did you mean {close[0]!r}" if close else ""
