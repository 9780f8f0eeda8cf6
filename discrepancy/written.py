"""The machine that an explanation leaves behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.fit import fit
from discrepancy.held_out import held_places, predicts
from discrepancy.model import NONE, Model
from discrepancy.place import Point
from discrepancy.problem import Problem

_STEPS = 12
"""Steps of the fit after parameters at a bound went back to nominal."""


@dataclass(frozen=True, eq=False)
class Written:
    """The machine that is left behind.

    Attributes
    ----------
    place : Point
        On the records fitted.
    held_back : str
        Why it is the nominal machine and not the calibrated one; "" where it is not.
    remarks : tuple of str
        What must be said of it.
    """

    place: Point
    held_back: str
    remarks: tuple[str, ...]


def written(model: Model, accepted: Point, bounds_hit: Sequence[str], held_out: Model, held: Point) -> Written:
    """What is accepted, with parameters at a bound at nominal and the others fitted again; the nominal machine where
    that one predicts a record held out better. `held` is a place on the records held out, of what is accepted."""
    place, remarks = accepted, ()
    if bounds_hit:
        hit = [k for k, p in enumerate(model.parameters) if p.name in bounds_hit]
        problem = Problem(model, accepted.hypothesis, held=hit)
        z = accepted.z.copy()
        z[hit] = 0.0
        place = fit(problem, problem.searched(problem.point(z, accepted.states)), steps=_STEPS).place
        remarks = tuple(
            f"{name} is nominal: the fit holds it at the bound of what is believable, so its number says nothing."
            for name in bounds_hit
        )
    problem = Problem(model, NONE)
    nominal = problem.point(np.zeros(len(problem.parameters)), model.states_for(NONE, accepted.states))
    if not predicts(place, held, held_out):
        (held,) = held_places([place], held_out, [held])
    (without,) = held_places([nominal], held_out, [held])
    with_it = Problem(held_out, place.hypothesis, frozen=True).pooled(held, [without])
    for g in np.unique(held_out.groups):
        mine = held_out.groups == g
        if with_it.squares[mine].sum() > without.squares[mine].sum():
            why = f"it predicts record {int(g) + 1} of those held out worse than the nominal machine does"
            return Written(nominal, why, (f"This is the nominal machine. The calibrated one is held back: {why}.",))
    return Written(place, "", remarks)
