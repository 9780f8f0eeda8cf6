"""What remains beside all that was found as a table: a missing torque over the one variable that orders it best.

The values of a spline at nine places are fitted together with what was accepted, start states and all, over each of
the variables that lead a race for starts. The variable of least cost on the records fitted is taken, and judged on the
records held out with its physics frozen. A table is no law: it holds where it was read off, and says nothing of why.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from threadpoolctl import threadpool_limits

from discrepancy.estimates import Estimate, estimates_of
from discrepancy.explain import Explanation
from discrepancy.fit import fit
from discrepancy.form import Form
from discrepancy.held_out import held_places
from discrepancy.model import Hypothesis
from discrepancy.problem import Point, Problem
from discrepancy.race import CAUTION, race

_CAREFUL, _LONG = 15, 60
"""Steps of a fit that lacks what remains, and of one that is compared."""


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
    if not forms or answer.after**2 - floor < criteria.at_noise or not answer.selection.complete:
        return None
    # as in `explain`: many small systems, for which threads are slower than one
    with threadpool_limits(limits=1, user_api="blas"):
        place = min(_fitted(answer, [form.hypothesis for form in forms]), key=lambda place: place.cost)
        form = next(form for form in forms if form.hypothesis.name == place.hypothesis.names[-1])
        known = answer.held[answer.accepted.name]
        before, after = held_places([answer.accepted.place, place], answer.held_out, [known])
        levels = [p.level(answer.held_out) for p in (before, after)]
        closes = (levels[0] ** 2 - levels[1] ** 2) / max(levels[0] ** 2 - floor, 1e-9)
        if not math.isfinite(closes) or closes < criteria.hint:
            return None
        values = estimates_of(answer.model, place).effect(form.hypothesis.name).parameters
    return Table(form, values, levels[0], levels[1], closes, place)


def _fitted(answer: Explanation, hypotheses: Sequence[Hypothesis]) -> list[Point]:
    """What was accepted with each of the tables that lead the race for starts."""
    model, accepted = answer.model, answer.accepted.place
    # without the table the fit has bent the machine to what is missing, so it is held near nominal at first
    problem = Problem(model, accepted.hypothesis, caution=CAUTION)
    careful = fit(problem, problem.searched(problem.adopted(accepted)), steps=_CAREFUL).place
    found = []
    for place in race(model, careful, hypotheses, answer.criteria)[: answer.criteria.rivals]:
        problem = Problem(model, place.hypothesis)
        found.append(fit(problem, problem.adopted(place), steps=_LONG, thorough=True).place)
    return found
