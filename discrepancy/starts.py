"""Which starts of the library are fitted: those that promise most, those that the linearisation overlooks, and those
that leave least of all in the worst windows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discrepancy.model import NONE, Model
from discrepancy.problem import Problem
from discrepancy.scan import Scanner, Start, apart, beside

_EFFECTS, LEADING = 6, 2
"""Effects of which the best start is fitted; those of which further ones are, and more while none explains the
records."""

_NEARBY, _SIDES = 2, 2
"""Places in the library's lists within which a start of the other sign may look alike, and how many are taken along."""

_MORE, _CHOSEN = 12, 2
"""More starts of an effect; how many of them are fitted, of those that promise most and of those that leave least in
the worst windows each."""

_WORST = 6
"""Windows, the base model's worst ones, in which more starts are compared."""

_CLOSER, _SURVEYED = 24, 4
"""Starts of an effect that are looked at in all of these windows once each was looked at in a few; how many of them are
fitted."""

_OVERLOOKED, _GLANCE, _LESS = 2, 3, 0.98
"""Effects fitted although the linearisation promises little of them; windows in which they are looked for; share of the
base model's loss there below which one shows."""


def promising(model: Model, scanner: Scanner) -> tuple[list[Start], dict[str, list[Start]]]:
    """The best start of each of the effects that promise most, and further ones of the leaders; and for every effect
    more starts, far from each other where there are many, best first."""
    best: list[list[Start]] = []
    for hypotheses in model.hypotheses().values():
        best.append(sorted((s for h in hypotheses for s in scanner.starts(h)), key=lambda s: s.promised))
    best.sort(key=lambda starts: starts[0].promised)
    leaders = [starts[0] for starts in best[:_EFFECTS]]
    leaders += [other for starts in best[:LEADING] for other in further(starts)]
    more = {
        starts[0].hypothesis.name: [start for start in apart(starts, _MORE) if start not in leaders]
        for starts in best[:_EFFECTS]
    }
    more |= {
        starts[0].hypothesis.name: starts if len(starts) <= 2 * _MORE else apart(starts, _MORE)
        for starts in best[_EFFECTS:]
    }
    return sorted((scanner.sharpened(start) for start in leaders), key=lambda s: s.promised), more


def further(starts: list[Start]) -> list[Start]:
    """Further starts of an effect. Where it has two signs, the best ones nearby with the other sign, one on either side
    as it may be: half a period of the ringing off, the other sign looks alike. Else the second one."""
    first = starts[0]
    own = -len(first.hypothesis.parameters)
    opposite = [s for s in starts[1:] if s.place.z[own] * first.place.z[own] < 0.0]
    nearby = [s for s in opposite if beside(first, s, _NEARBY, first=1)]
    return apart(nearby, _SIDES) if nearby else starts[1:2]


def chosen(scanner: Scanner, starts: Sequence[Start]) -> list[Start]:
    """The starts that promise most, and those that leave least in the base model's worst windows."""
    worst = _worst(scanner, _WORST)
    least = sorted(starts[_CHOSEN:], key=lambda start: _left(scanner.model, start, worst))[:_CHOSEN]
    return [*starts[:_CHOSEN], *least]


def overlooked(scanner: Scanner, effects: Sequence[Sequence[Start]]) -> list[Start]:
    """The starts of effects that leave least in the base model's worst windows, one of each effect."""
    worst = _worst(scanner, _GLANCE)
    base = Problem(scanner.model, NONE).losses(scanner.base.squares)[worst].sum()
    left = [[_left(scanner.model, start, worst) for start in starts] for starts in effects]
    best = sorted((min(of), k) for k, of in enumerate(left) if of)
    return [effects[k][left[k].index(least)] for least, k in best[:_OVERLOOKED] if least < _LESS * base]


def surveyed(scanner: Scanner, name: str) -> list[Start]:
    """The starts of an effect that leave least in the base model's worst windows, of all in the library. The machine
    stays as the base model has it and what belongs to single records at 0: where most is missing, neither the
    linearisation nor those parameters tell anything."""
    worst = _worst(scanner, _WORST)
    hypotheses = scanner.model.hypotheses()[name]
    starts = [scanner.unmoved(hypothesis, values) for hypothesis in hypotheses for values in hypothesis.starts]
    for windows, kept in ((worst[:_GLANCE], _CLOSER), (worst, _SURVEYED)):
        starts = sorted(starts, key=lambda start: _left(scanner.model, start, windows))[:kept]
    return starts


def _worst(scanner: Scanner, count: int) -> np.ndarray:
    """The base model's worst windows (count,)."""
    return np.argsort(-scanner.base.squares / scanner.model.counts)[:count]


def _left(model: Model, start: Start, windows: np.ndarray) -> float:
    """What a start leaves in windows once these have looked for their own start states anew: where an effect changes
    the order of contacts, the linearisation cannot follow."""
    problem = Problem(model, start.hypothesis)
    found = problem.searched(problem.point(start.place.z, start.place.states), windows)
    return float(problem.losses(found.squares)[windows].sum())
