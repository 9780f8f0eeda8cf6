"""The errors a user can meet: one class per kind, each message one sentence.

A sentence says which parameter of whom, the rule with its unit, the value got and, where known, the remedy.
"""

from __future__ import annotations


class IndexerError(Exception):
    """Base of all errors that a user of the project is meant to read; commands print it without a traceback."""


class ParameterError(IndexerError, ValueError):
    """A parameter of a machine, operating point, fault, effect, sensor or run breaks its rule."""


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
