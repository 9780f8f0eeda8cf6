"""A free function as a table: what remains may be one, and a law over the same variable is held to it.

A law is named only where the table beside it closes hardly more of what a free function could: a force that grows with
the square of the speed is closed to nine tenths by one in proportion to it, which is not what is missing (lack of fit
against a saturated model; Draper and Smith, Applied Regression Analysis, section 2.1).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.fit import fit
from discrepancy.model import Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.effects.spline import Axis

_SHARES = (0.1, 0.3, 1.0)
"""Sizes of a table's starts, in the torque or force of the motion."""

_STEPS = 20
"""Steps of a fit that takes up a table beside what it has."""


@dataclass(frozen=True)
class Form:
    """What a torque, or an error of a motion, may be tabulated over.

    Attributes
    ----------
    over : str
        Its variable, or two, with their units: "speed of the table [rad/s]".
    variables : tuple of str
        Their names.
    hypothesis : Hypothesis
        The table's values as parameters, those of the last variable side by side, with starts as of `shaped`.
    axes : tuple of Axis
        Where they stand along each variable.
    """

    over: str
    variables: tuple[str, ...]
    hypothesis: Hypothesis
    axes: tuple[Axis, ...]

    @property
    def places(self) -> list[tuple[float, ...]]:
        """Where each value stands, a number for each variable."""
        return list(itertools.product(*(axis.places.tolist() for axis in self.axes)))


def beside(model: Model, place: Point, form: Form) -> Point:
    """A fitted place with the table beside it, which begins at nothing."""
    both = together(place.hypothesis, form.hypothesis)
    problem = Problem(model, both)
    z = np.concatenate([place.z, np.zeros(len(form.hypothesis.parameters))])
    return fit(problem, problem.point(z, model.states_for(both, place.states)), steps=_STEPS).place


def shaped(axes: Sequence[Axis], size: float) -> tuple[tuple[float, ...], ...]:
    """Values of a table from which a fit may begin: nothing, and in both signs and some sizes a line and a parabola
    over what goes to and fro, one wave over a turn; over two variables these of the first one, the same all along the
    second or times one of its own."""
    first = _shapes(axes[0])
    shapes = first if len(axes) == 1 else [np.outer(f, g) for f in first for g in _along(axes[1])]
    nothing = np.zeros(math.prod(axis.count for axis in axes))
    laid = [sign * share * size * shape.ravel() for share in _SHARES for shape in shapes for sign in (1.0, -1.0)]
    return tuple(tuple(row.tolist()) for row in (nothing, *laid))


def _shapes(axis: Axis) -> list[np.ndarray]:
    x = axis.places
    return [np.sin(x), np.cos(x)] if axis.closed else [x / np.abs(x).max(), x * np.abs(x) / np.abs(x).max() ** 2]


def _along(axis: Axis) -> list[np.ndarray]:
    return [np.ones(axis.count), *_shapes(axis)]
