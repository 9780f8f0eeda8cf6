"""What remains beside all that was found as a table: a missing torque over the one variable that orders it best.

For each variable that the subject offers, the values of a spline at nine places are fitted together with what was
accepted, start states and all. The variable of least cost on the records fitted is taken, and judged on the records
held out with its physics frozen. A table is no law: it holds where it was read off, and says nothing of why.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from discrepancy.estimates import Estimate, estimates_of
from discrepancy.explain import Explanation
from discrepancy.fit import fit
from discrepancy.held_out import held_places
from discrepancy.model import Hypothesis, together
from discrepancy.problem import Point, Problem

_STEPS = 12
"""Of the fit of one table: it is nearly linear."""


@dataclass(frozen=True)
class Form:
    """A variable over which a torque may be tabulated.

    Attributes
    ----------
    over : str
        The variable with its unit: "speed of the table [rad/s]".
    hypothesis : Hypothesis
        The table's values as parameters, 0 at the start.
    places : tuple of float
        Where they stand.
    """

    over: str
    hypothesis: Hypothesis
    places: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Table:
    """What remains as a table.

    Attributes
    ----------
    form : Form
    values : tuple of Estimate
        Torque at each place.
    before, after : float
        Levels (rms over noise) on the records held out, with what was accepted, and with the table beside it.
    closes : float
        Share of what remained on the records held out that it closes.
    place : Point
        On the records fitted, what was accepted and the table together.
    """

    form: Form
    values: tuple[Estimate, ...]
    before: float
    after: float
    closes: float
    place: Point


def tabulate(answer: Explanation, forms: Sequence[Form]) -> Table | None:
    """The best table of what the accepted machine leaves; None where that is the noise, or no table earns a hint."""
    floor, criteria = answer.remains.noise**2, answer.criteria
    if answer.after**2 - floor < criteria.at_noise or not answer.selection.complete:
        return None
    # as in `explain`: many small systems, for which threads are slower than one
    with threadpool_limits(limits=1, user_api="blas"):
        fitted = [(form, _fitted(answer, form.hypothesis)) for form in forms]
        if not fitted:
            return None
        form, place = min(fitted, key=lambda pair: pair[1].cost)
        known = answer.held[answer.accepted.name]
        before, after = held_places([answer.accepted.place, place], answer.held_out, [known])
        levels = [p.level(answer.held_out) for p in (before, after)]
        closes = (levels[0] ** 2 - levels[1] ** 2) / max(levels[0] ** 2 - floor, 1e-9)
        if not math.isfinite(closes) or closes < criteria.hint:
            return None
        values = estimates_of(answer.model, place).effect(form.hypothesis.name).parameters
    return Table(form, values, levels[0], levels[1], closes, place)


def _fitted(answer: Explanation, hypothesis: Hypothesis) -> Point:
    model, accepted = answer.model, answer.accepted.place
    both = together(accepted.hypothesis, hypothesis)
    z = np.concatenate([accepted.z, np.zeros(len(hypothesis.parameters))])
    problem = Problem(model, both)
    return fit(problem, problem.point(z, model.states_for(both, accepted.states)), steps=_STEPS).place
