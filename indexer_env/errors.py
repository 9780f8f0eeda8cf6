"""The errors a user can meet: one class per kind, each message one sentence.

A sentence says which parameter of whom, the rule with its unit, the value got and, where known, the remedy.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

from indexer_env.units import ENDINGS


class IndexerError(Exception):
    """Base of all errors that a user of the project is meant to read; commands print it without a traceback."""


class ParameterError(IndexerError, ValueError):
    """A parameter of a machine, operating point, fault, effect, sensor or run breaks its rule.

    Attributes
    ----------
    out_of_range : OutOfRange or None
        The sentence as data where it is about a number out of its range.
    """

    out_of_range: OutOfRange | None = None


class SignalError(IndexerError, ValueError):
    """A signal or file from outside cannot be used as it is."""


class SimulationError(IndexerError, ArithmeticError):
    """A run became non-finite or left the physical range; the message names machine, time and state."""


class MotionLawWarning(UserWarning):
    """A user's motion law table can be used, but not all of it is what a cam should be; the message says what."""


def refuse(owner: str, name: str, rule: str, value: object, remedy: str = "") -> ParameterError:
    """Build (not raise) the sentence ``Owner.name must be RULE, got VALUE; REMEDY.``"""
    tail = f"; {remedy}" if remedy else ""
    return ParameterError(f"{owner}.{name} must be {rule}, got {value!r}{tail}.")


@dataclass(frozen=True)
class OutOfRange:
    """A number that is none or out of its range: whose it is, its range and unit, and the value got."""

    owner: str
    name: str
    value: Any
    kind: str = "a finite number"
    low: float | None = None
    high: float | None = None
    low_open: bool = False
    high_open: bool = False
    unit: str = ""
    remedy: str = ""

    @property
    def rule(self) -> str:
        """Such as "a finite number >= 0 and < 1 rad"."""
        bounds = []
        if self.low is not None:
            bounds.append(f"{'>' if self.low_open else '>='} {self.low:g}")
        if self.high is not None:
            bounds.append(f"{'<' if self.high_open else '<='} {self.high:g}")
        text = f"{self.kind} {' and '.join(bounds)}".strip()
        return f"{text} {self.unit}".strip() if self.unit not in ("", "-") else text

    def error(self) -> ParameterError:
        """Build (not raise) the sentence."""
        error = refuse(self.owner, self.name, self.rule, self.value, self.remedy)
        error.out_of_range = self
        return error

    def given_as(self, owner: str, key: str) -> OutOfRange:
        """The same of the key that was typed, in its unit: ``backlash_deg`` for `backlash`."""
        unit = ENDINGS.get(key.removeprefix(self.name))
        if unit is None:
            return replace(self, owner=owner, name=key)
        low, high, value = (_in(unit.factor, number) for number in (self.low, self.high, self.value))
        said = re.sub(rf"^{unit.si}\b", unit.name, self.unit) or unit.name
        return replace(self, owner=owner, name=key, low=low, high=high, value=value, unit=said)


def _in(factor: float, number: Any) -> Any:
    """A number in units of this factor, without the last digits that the conversion leaves; else what it is."""
    if not isinstance(number, int | float):
        return number
    shown = float(f"{number / factor:.12g}")
    return int(shown) if shown.is_integer() else shown
