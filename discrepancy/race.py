"""The race for starts: where the fit of a set with one more effect should begin.

Successive halving (Jamieson and Talwalkar, AISTATS 2016): every start of the library is judged by what the
linearisation promises of it, the best ones of each effect by what they leave in the worst windows once these have
looked for their start states anew, proposals around the leaders likewise, the survivors by a few joint steps, of the
better half the first one and its rivals by more. Either judge alone is misled: the linearisation where an effect
changes the order of contacts, the worst windows where an effect spares them.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TypeVar

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.fit import fit, stand_out
from discrepancy.linearised import Linearised, Start, neighbours
from discrepancy.model import Hypothesis, Model, together
from discrepancy.place import Point
from discrepancy.problem import Problem

_T = TypeVar("_T")

CAUTION = 100.0
"""Weight of the machine's priors while starts race: an effect that is missing must not be taken up by the machine."""

_FEW, _MORE = 3, 6
"""Joint steps of the survivors, and those that the first one and its rivals among the better half take more."""

_OF_ONE = 2
"""Starts of one effect among the survivors: the linearisation's and the worst windows' favourites may differ."""

_LEADERS, _SIDE_BY_SIDE, _ROUNDS = 6, 3, 2
"""Starts around which others are proposed, at most so many of one effect, and how often: an effect's best start may
be an alias of the right one, half a period of the ringing off."""


_WIDE = 3
"""Starts of each effect in a wide race: with fewer, orders and sizes are left out whose basin is the only one."""


_RANKED, _BEGUN = 4.0, 1.5
"""Starts that are ranked where an effect begins anew, and that are fitted then, over `Criteria.fits`."""

_RIVAL = 0.5
"""Share of what the leading effect wins in a race below which another one is no rival."""


@dataclass(frozen=True, eq=False)
class Race:
    """What a race found.

    Attributes
    ----------
    start : float
        Cost of the set without one more effect.
    places : list of Point
        The best place of each effect that leads, best first, their costs like the start's: what is known of the machine
        weighs as in a race.
    """

    start: float
    places: list[Point]

    @property
    def names(self) -> list[str]:
        """The effects that lead."""
        return [place.hypothesis.names[-1] for place in self.places]

    def beside(self, other: Race) -> Race:
        """The best place of each effect of two races from one start."""
        ranked = sorted((*self.places, *other.places), key=lambda place: place.cost)
        return Race(self.start, first_of_each(ranked, lambda place: place.hypothesis.names[-1]))

    def without(self, name: str) -> Race:
        """The same but for one effect."""
        return Race(self.start, [place for place in self.places if place.hypothesis.names[-1] != name])

    def rival(self, place: Point, leading: float) -> bool:
        """Whether a place wins half of what one that costs `leading` does."""
        return _rival(self.start, place, leading)


def _rival(start: float, place: Point, leading: float) -> bool:
    return start - place.cost >= _RIVAL * (start - leading)


def race(
    model: Model, base: Point, effects: Iterable[Hypothesis], criteria: Criteria, *, wide: bool = False,
    in_time: Callable[[], bool] = lambda: True,
) -> list[Point]:  # fmt: skip
    """Places of the set at `base` with one of the effects more, the best of each effect, best first; once it is no more
    `in_time`, of those that have been fitted until then, one at least.

    A `wide` race trusts no judge: every effect is fitted by a few joint steps from sizes and choices apart, with all
    that is known at nominal. It finds effects whose right start looks worse than none on a machine that is bent by what
    it lacks. Next to nothing all promise as much as none, so that sizes below the most promising one say nothing new.
    """
    if wide:
        base = _at_nominal(model, base.hypothesis, base.z, base.states)
    around = Linearised(model, base, CAUTION)
    worst = np.argsort(-base.squares / model.counts)[: criteria.windows]
    promising = [start for effect in effects for start in around.starts(effect, effect.starts)]
    if wide:
        return _fitted(model, _apart(promising), criteria.fits, in_time)
    field = _best_of_each(sorted(promising, key=_promised), criteria.starts)
    judged = [*zip(_left(around, field, worst), field, strict=True)]
    asked = set[Start]()
    for _ in range(_ROUNDS if in_time() else 0):
        leaders = _best_of_each([start for _, start in sorted(judged, key=itemgetter(0))], _SIDE_BY_SIDE)[:_LEADERS]
        proposed = [start for leader in leaders if leader not in asked for start in _proposals(around, leader)]
        asked.update(leaders)
        judged += zip(_left(around, proposed, worst), proposed, strict=True)
    by_windows = _best_of_each([start for _, start in sorted(judged, key=itemgetter(0))], _OF_ONE)
    by_promise = _best_of_each(sorted((start for _, start in judged), key=_promised), _OF_ONE)
    survivors = _best_of_each(_in_turns(by_windows, by_promise), _OF_ONE)[: criteria.fits]
    begun = Problem(model, base.hypothesis, caution=CAUTION).adopted(base).cost
    return _fitted(model, survivors, math.ceil(len(survivors) / 2), in_time, begun)


def restarted(
    model: Model, place: Point, k: int, criteria: Criteria, in_time: Callable[[], bool] = lambda: True
) -> Point:
    """The best place of a set whose k-th effect begins anew, beside the other effects as they are and all that is known
    at nominal: from a machine that has bent far, no fit finds back.

    The most promising starts, and that of each size, are ranked by what they leave once all windows have looked for
    their start states anew. The effect begins at the first one of each size and at the first ones of all, in turns:
    what has a phase may have its right size there.
    """
    effects = place.hypothesis.effects
    base = together(*effects[:k], *effects[k + 1 :])
    z = np.delete(place.z, len(model.parameters) + place.hypothesis.places(k))
    rest = _at_nominal(model, base, z, model.states_for(base, place.states))
    around = Linearised(model, rest, CAUTION)
    promising = sorted(around.starts(effects[k], effects[k].starts), key=_promised)
    field = list(dict.fromkeys([*_of_sizes(promising), *promising[: round(_RANKED * criteria.fits)]]))
    left = dict(zip(field, _left(around, field, np.arange(len(model.counts))), strict=True))
    ranked = sorted(field, key=left.__getitem__)
    chosen = _in_turns(_of_sizes(ranked)[: criteria.fits], _best_of_each(ranked, criteria.fits))
    begun = [_unmoved(start, rest) for start in chosen[: int(_BEGUN * criteria.fits)]]
    return _fitted(model, begun, math.ceil(len(begun) / 2), in_time)[0]


def _of_sizes(ranked: Sequence[Start]) -> list[Start]:
    """The first start of each size. Next to nothing all are as good as none, so those that are smaller than the first
    one of all come last."""
    in_order = sorted(ranked, key=lambda start: start.smaller(ranked[0]))
    return first_of_each(in_order, lambda start: start.values[0])


def _at_nominal(model: Model, hypothesis: Hypothesis, z: np.ndarray, states: np.ndarray) -> Point:
    """A set with its effects as they are, and all that is known of the machine and the records at nominal."""
    problem = Problem(model, hypothesis)
    return problem.searched(problem.point(np.where(problem.known, 0.0, z), states))


def first_of_each(items: Iterable[_T], key: Callable[[_T], Hashable]) -> list[_T]:
    """The first item of each key, in order."""
    found: dict[Hashable, _T] = {}
    for item in items:
        found.setdefault(key(item), item)
    return list(found.values())


def _unmoved(start: Start, rest: Point) -> Start:
    """A start with all else where it rests, and not where linear theory would have it."""
    own = start.place.z[len(rest.z) :]
    place = dataclasses.replace(start.place, z=np.concatenate([rest.z, own]))
    return dataclasses.replace(start, place=place)


def _promised(start: Start) -> float:
    return start.place.cost


def _best_of_each(starts: Sequence[Start], count: int) -> list[Start]:
    """The first `count` starts of each effect of which no two stand side by side in the library's lists, in order."""
    found: list[Start] = []
    for start in starts:
        mine = [other for other in found if other.effect.name == start.effect.name]
        if len(mine) < count and not any(start.beside(other) for other in mine):
            found.append(start)
    return found


def _apart(starts: Sequence[Start]) -> list[Start]:
    """The most promising starts of each effect, `_WIDE` of them, no two of one choice and of sizes side by side, and
    none that is smaller than a more promising one and else like it."""
    found: list[Start] = []
    for start in sorted(starts, key=_promised):
        mine = [other for other in found if other.effect.name == start.effect.name]
        like = [other for other in mine if other.effect.fixed == start.effect.fixed]
        near = any(abs(other.rungs[0] - start.rungs[0]) <= 1 or start.smaller(other) for other in like)
        if len(mine) < _WIDE and not near:
            found.append(start)
    return found


def _proposals(around: Linearised, leader: Start) -> list[Start]:
    """Starts halfway from a leader to its neighbours in the library's lists, one parameter at a time, and those of the
    other sign there: half a period of the ringing off, the other sign looks alike."""
    ladders = [sorted(set(column)) for column in zip(*leader.effect.starts, strict=True)]
    values = []
    for k, ladder in enumerate(ladders):
        for other in neighbours(leader.values[k], ladder):
            moved = (*leader.values[:k], other, *leader.values[k + 1 :])
            values += [moved] if k == 0 or ladders[0][0] >= 0.0 else [moved, (-moved[0], *moved[1:])]
    own = leader.effect.parameters
    inside = [tuple(min(max(v, p.low), p.high) for v, p in zip(one, own, strict=True)) for one in values]
    # halfway between the least sizes of both signs there is no effect
    return around.starts(leader.effect, [one for one in inside if one[0] != own[0].nominal])


def _left(around: Linearised, starts: Sequence[Start], windows: np.ndarray) -> list[float]:
    """What starts leave in some windows that look for their start states anew."""
    found = [0.0] * len(starts)
    groups: dict[tuple, list[int]] = {}
    for k, start in enumerate(starts):
        groups.setdefault((start.effect.name, tuple(start.effect.fixed.items())), []).append(k)
    for members in groups.values():
        problem = around.joint(starts[members[0]].effect)
        z = np.array([starts[k].place.z for k in members])
        states = np.array([starts[k].place.states for k in members])
        _, squares = problem.started(z, states, windows)
        losses = problem.losses(squares, windows).sum(axis=1)
        for k, loss in zip(members, losses.tolist(), strict=True):
            found[k] = loss
    return found


def _in_turns(a: Sequence[Start], b: Sequence[Start]) -> list[Start]:
    """Starts of two rankings, in turns, each once."""
    pairs = itertools.zip_longest(a, b)
    return list(dict.fromkeys(start for pair in pairs for start in pair if start is not None))


def _fitted(
    model: Model, starts: Sequence[Start], finished: int, in_time: Callable[[], bool] = lambda: True,
    begun: float = -math.inf,
) -> list[Point]:  # fmt: skip
    """The best place of each effect after a few joint steps from every start and more from the best ones. Where the
    first one costs less than the set did before the effect was added, `begun`, only its rivals take more."""
    tried: list[tuple[str, Point]] = []
    for start in starts:
        if tried and not in_time():
            break
        problem = Problem(model, start.place.hypothesis, caution=CAUTION)
        place = problem.settled(problem.point(start.place.z, start.place.states))
        place = problem.searched(place, stand_out(problem, place))
        tried.append((start.effect.name, fit(problem, place, steps=_FEW).place))
    tried.sort(key=lambda pair: pair[1].cost)
    leading = tried[0][1].cost if tried else math.inf
    best: dict[str, Point] = {}
    for k, (name, place) in enumerate(tried):
        if k < finished and (leading >= begun or _rival(begun, place, leading)) and in_time():
            place = fit(Problem(model, place.hypothesis, caution=CAUTION), place, steps=_MORE).place
        if name not in best or place.cost < best[name].cost:
            best[name] = place
    return sorted(best.values(), key=lambda place: place.cost)
