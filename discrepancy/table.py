"""What remains beside all that was found as a table: a missing torque over the one variable that orders it best.

The values of a spline at nine places are fitted together with what was accepted, start states and all, over each of
the variables that lead a race for starts; an error of the cam's motion is one of them. The variable of least cost on
the records fitted is taken, and judged on the records held out with its physics frozen. A second variable is added
where records held out ask for it: the best of the tables over this variable and another one takes its place if it
leaves at most half as much. A table is no law: it holds where it was read off, and says nothing of why.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from discrepancy.estimates import Estimate, estimates_of
from discrepancy.explain import Explanation
from discrepancy.fit import fit
from discrepancy.form import Form
from discrepancy.held_out import held_places
from discrepancy.problem import Point, Problem
from discrepancy.race import CAUTION, race

_CAREFUL, _LONG = 15, 60
"""Steps of a fit that lacks what remains, and of one that is compared."""

_LEFT = 0.5
"""Most that a table over two variables may leave on records held out, over what the one over one of them leaves."""


@dataclass(frozen=True, eq=False)
class Table:
    """What remains as a table.

    Attributes
    ----------
    form : Form
    values : tuple of Estimate
        At each place.
    before, after : float
        Levels (rms over noise) on the records held out, with what was accepted, and with the table beside it.
    closes : float
        Share of what remained on the records held out that it closes.
    place : Point
        On the records fitted, what was accepted and the table together, where its values are believed.
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
    if not forms or answer.at_noise or not answer.selection.complete:
        return None
    # as in `explain`: many small systems, for which threads are slower than one
    with threadpool_limits(limits=1, user_api="blas"):
        single = [form for form in forms if len(form.axes) == 1]
        careful = _careful(answer)
        taken = _best(answer, careful, single)
        if taken.after**2 / floor - 1.0 >= criteria.at_noise:
            further = [form for form in forms if len(form.axes) > 1 and taken.form.variables[0] in form.variables]
            if further:
                other = _best(answer, careful, further)
                taken = other if 1.0 - other.closes <= _LEFT * (1.0 - taken.closes) else taken
        if not math.isfinite(taken.closes) or taken.closes < criteria.hint:
            return None
        told = estimates_of(answer.model, taken.place)
    values = told.effect(taken.form.hypothesis.name).parameters
    return dataclasses.replace(taken, values=values, place=told.believed)


def _best(answer: Explanation, careful: Point, forms: Sequence[Form]) -> Table:
    """Of the tables that lead the race for starts the one that fits best, on the records held out; the estimates of its
    values are left out."""
    leaders = race(answer.model, careful, [form.hypothesis for form in forms], answer.criteria)
    place = min((_fitted(answer, one) for one in leaders[: answer.criteria.rivals]), key=lambda one: one.cost)
    form = next(form for form in forms if form.hypothesis.name == place.hypothesis.names[-1])
    known = answer.held[answer.accepted.name]
    before, after = held_places([answer.accepted.place, place], answer.held_out, [known])
    levels = [p.level(answer.held_out) for p in (before, after)]
    floor = answer.remains.noise**2
    return Table(form, (), levels[0], levels[1], closed_of(levels[0], levels[1], floor), place)


def closed_of(before: float, after: float, floor: float) -> float:
    """Share of what remained above `floor` (a mean square) that a table closes; chance may bring it below the floor,
    but no more than what remained can be closed."""
    return min(1.0, (before**2 - after**2) / max(before**2 - floor, 1e-9))


def _careful(answer: Explanation) -> Point:
    """What was accepted, fitted anew: without the table a fit has bent the machine to what is missing, so it is held
    near nominal at first."""
    accepted = answer.accepted.place
    problem = Problem(answer.model, accepted.hypothesis, caution=CAUTION)
    return fit(problem, problem.searched(problem.adopted(accepted)), steps=_CAREFUL).place


def _fitted(answer: Explanation, leader: Point) -> Point:
    problem = Problem(answer.model, leader.hypothesis)
    return fit(problem, problem.adopted(leader), steps=_LONG, thorough=True).place
