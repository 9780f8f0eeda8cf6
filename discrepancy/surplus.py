"""An effect that those found after it have made superfluous is taken back.

Effects are found one after the other, so a first one may stand for what a later one explains. When no further effect is
found, each earlier one must earn its place again: the others are fitted without it, and it goes where it wins no more
than an effect must to be named (backward elimination).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from discrepancy.candidates import Candidate, refitted, tested
from discrepancy.findings import Estimate, findings
from discrepancy.held_out import held_place
from discrepancy.model import Hypothesis, Model, in_turn
from discrepancy.naming import MARGIN, Naming
from discrepancy.problem import Problem

_SURE = 4.0
"""Distance of an effect's size from none, in half widths of its 95 % interval, at which it is not doubted: it wins some
70 in cost, twice the margin and the price of its parameters."""


def needed(model: Model, held_out: Model, rounds: tuple[Naming, ...]) -> tuple[Naming, ...]:
    """The rounds without those whose effect the ones found after it have made superfluous.

    Parameters
    ----------
    model, held_out : Model
        As they came, without any effect.
    rounds : tuple of Naming
        Those that named an effect, in their order.
    """
    for k in range(len(rounds) - 1):
        without = _without(model, held_out, rounds, k)
        if without is not None:
            return needed(model, held_out, without)
    return rounds


def _without(model: Model, held_out: Model, rounds: tuple[Naming, ...], k: int) -> tuple[Naming, ...] | None:
    """The rounds without the k-th, or None where its effect is needed."""
    effects = [naming.candidates[0].place.hypothesis for naming in rounds]
    last, own = rounds[-1], rounds[k].candidates[0]
    best, *rivals = [c for c in last.candidates if c is last.candidates[0] or c.name in last.names]
    doubted, known = effects[k], [*effects[:k], *effects[k + 1 : -1]]
    size = findings(in_turn(model, effects[:-1]), best.place).effect(doubted.name).parameters[0]
    if _sure(size):
        return None
    model, held_out = in_turn(model, known), in_turn(held_out, known)
    # the effects known stand in front of the last one
    first = len(best.place.z) - sum(len(effect.parameters) for effect in effects[k:])
    alone = _alone(model, best, first, doubted)
    if alone.place.cost - best.place.cost > MARGIN + own.score - own.place.cost:
        return None
    found = [alone, *(_alone(model, rival, first, doubted) for rival in rivals)]
    found = [tested(c, held_place(c.place, held_out), held_out) for c in found]
    left = list(rounds)
    left[-1] = dataclasses.replace(last, candidates=(*found, *_others(rounds[-1], found)))
    # what stood beside the effect taken back stands beside the next one, which has its place now
    now = found if k + 2 == len(rounds) else rounds[k + 1].candidates[:1]
    left[k + 1] = dataclasses.replace(left[k + 1], candidates=(*now, *_others(rounds[k], now)))
    del left[k]
    return tuple(left)


def _alone(model: Model, candidate: Candidate, first: int, doubted: Hypothesis) -> Candidate:
    """A candidate fitted without the effect whose parameters begin at `first`."""
    place = candidate.place
    z = np.delete(place.z, slice(first, first + len(doubted.parameters)))
    problem = Problem(model, place.hypothesis)
    return refitted(model, problem.searched(problem.point(z, model.states_for(place.hypothesis, place.states))))


def _others(naming: Naming, found: Sequence[Candidate]) -> tuple[Candidate, ...]:
    names = [c.name for c in found]
    return tuple(c for c in naming.candidates if c.name not in names)


def _sure(size: Estimate) -> bool:
    return abs(size.value - size.nominal) > _SURE * 0.5 * (size.high - size.low)
