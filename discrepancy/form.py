"""A free function of one variable, as a table: what remains may be one, and a law over the same variable is held to it.

A law is named only where the table beside it closes hardly more of what a free function could: a force that grows with
the square of the speed is closed to nine tenths by one in proportion to it, which is not what is missing (lack of fit
against a saturated model; Draper and Smith, Applied Regression Analysis, section 2.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.fit import fit
from discrepancy.model import Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem

_SHARES = (0.1, 0.3, 1.0)
"""Sizes of a table's starts, in the torque or force of the motion."""

_STEPS = 20
"""Steps of a fit that takes up a table beside what it has."""


@dataclass(frozen=True)
class Form:
    """A variable over which a torque may be tabulated.

    Attributes
    ----------
    over : str
        The variable with its unit: "speed of the table [rad/s]".
    hypothesis : Hypothesis
        The table's values as parameters, with starts as of `shaped`.
    places : tuple of float
        Where they stand.
    """

    over: str
    hypothesis: Hypothesis
    places: tuple[float, ...]


def beside(model: Model, place: Point, form: Form) -> Point:
    """A fitted place with the table beside it, which begins at nothing."""
    both = together(place.hypothesis, form.hypothesis)
    problem = Problem(model, both)
    z = np.concatenate([place.z, np.zeros(len(form.hypothesis.parameters))])
    return fit(problem, problem.point(z, model.states_for(both, place.states)), steps=_STEPS).place


def shaped(places: Sequence[float], size: float, *, closed: bool) -> tuple[tuple[float, ...], ...]:
    """Values of a table at its places from which a fit may begin: nothing, and in both signs and some sizes a line and
    a parabola over what goes to and fro, one wave over a turn."""
    x = np.array(places)
    shapes = (np.sin(x), np.cos(x)) if closed else (x / np.abs(x).max(), x * np.abs(x) / np.abs(x).max() ** 2)
    laid = [sign * share * size * shape for share in _SHARES for shape in shapes for sign in (1.0, -1.0)]
    return tuple(tuple(row.tolist()) for row in (np.zeros_like(x), *laid))
