"""Earlier rounds in the light of later ones.

Effects are found one after the other, so a first one may stand for what a later one explains. Where such an effect has
hardly any size left, what was found after it is fitted without it. If that explains the records as well, it competes
with the first one in the first one's own round, and the search goes on from there.

While another effect is missing, two may explain the records alike. They are told apart again once it is found.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discrepancy.candidates import Candidate, refitted
from discrepancy.findings import FoundEffect, findings
from discrepancy.model import NONE, Hypothesis, Model, in_turn
from discrepancy.naming import MARGIN, NAMING, Naming, judged

_SURE = 6.0
"""Distance of an effect's size from none, in half widths of its 95 % interval, at which it is not doubted: it wins some
80 in cost, more than the margin and the price of its parameters."""


def corrected(model: Model, held_out: Model, rounds: Sequence[Naming]) -> tuple[Naming, ...] | None:
    """The rounds up to the first one whose effect is superfluous, that one judged again with what was found later; None
    where all effects are needed.

    Parameters
    ----------
    model, held_out : Model
        As they came, without any effect.
    rounds : sequence of Naming
        Those that named an effect, in their order.
    """
    effects = effects_of(rounds)
    if len(effects) < 2:
        return None
    best = rounds[-1].candidates[0]
    numbers = findings(in_turn(model, effects[:-1]), best.place)
    for k, effect in enumerate(effects[:-1]):
        if _sure(numbers.effect(effect.name)):
            continue
        own, others = rounds[k].candidates[0], [*effects[:k], *effects[k + 1 :]]
        without = _without(in_turn(model, others[:-1]), best, _span(best, effects, k), others[-1])
        if without.place.cost - best.place.cost > MARGIN + own.score - own.place.cost:
            continue
        known, known_held = in_turn(model, effects[:k]), in_turn(held_out, effects[:k])
        later, late = range(k + 1, len(effects)), [without]
        if k + 2 < len(effects):
            late = [_without(known, best, _others(best, effects, k, j), effects[j]) for j in later]
        base = np.delete(best.place.z, np.concatenate([_span(best, effects, j) for j in range(k, len(effects))]))
        late += [_instead(known, base, rival) for j in later for rival in _rivals(rounds[j])]
        again = judged(known_held, [*rounds[k].candidates, *late], rounds[k].black_box)
        if again.verdict in NAMING and again.candidates[0].name != effect.name:
            return (*rounds[:k], again)
    return None


def told_apart(model: Model, held_out: Model, rounds: Sequence[Naming]) -> tuple[Naming, ...]:
    """The rounds, each ambiguous one that others follow judged again with all that was found besides, and put last; it
    stays where it is if nothing is named then.

    Parameters
    ----------
    model, held_out, rounds
        As `corrected` takes them.
    """
    needless: list[Naming] = []
    # a round that is still ambiguous waits again for those that it was put behind
    for _ in range(len(rounds) + 1):
        waiting = [k for k, one in enumerate(rounds[:-1]) if one.verdict == "ambiguous" and one not in needless]
        if not waiting:
            break
        k = waiting[0]
        again = _judged_again(model, held_out, rounds, k)
        if again.verdict in NAMING:
            rounds = (*rounds[:k], *rounds[k + 1 :], again)
        else:
            needless.append(rounds[k])
    return tuple(rounds)


def _judged_again(model: Model, held_out: Model, rounds: Sequence[Naming], k: int) -> Naming:
    """An ambiguous round judged with all that the others found in place."""
    effects, best, naming = effects_of(rounds), rounds[-1].candidates[0], rounds[k]
    others = [*effects[:k], *effects[k + 1 :]]
    known, known_held = in_turn(model, others), in_turn(held_out, others)
    own = _span(best, effects, k)
    z = np.delete(best.place.z, own)
    found = {effect.name for effect in others}
    rivals = [(c.place.hypothesis, c.place.own) for c in _rivals(naming) if c.name not in found]
    fits = [
        refitted(known, h, np.concatenate([z, values]), known.states_for(h, best.place.states))
        for h, values in [(effects[k], best.place.z[own]), *rivals, (NONE, np.zeros(0))]
    ]
    return judged(known_held, fits, naming.black_box)


def _rivals(naming: Naming) -> list[Candidate]:
    """Those that the best candidate cannot be told from."""
    return [c for c in naming.candidates[1:] if naming.verdict == "ambiguous" and c.name in naming.names]


def effects_of(rounds: Sequence[Naming]) -> list[Hypothesis]:
    """What the rounds named, each its best."""
    return [naming.candidates[0].place.hypothesis for naming in rounds]


def _span(candidate: Candidate, effects: Sequence[Hypothesis], k: int) -> np.ndarray:
    """Places (p,) of the k-th effect's parameters in a candidate that has all of them."""
    first = len(candidate.place.z) - sum(len(effect.parameters) for effect in effects[k:])
    return np.arange(first, first + len(effects[k].parameters))


def _others(candidate: Candidate, effects: Sequence[Hypothesis], k: int, kept: int) -> np.ndarray:
    """Places of the parameters of all effects from the k-th on but one."""
    return np.concatenate([_span(candidate, effects, j) for j in range(k, len(effects)) if j != kept])


def _without(model: Model, candidate: Candidate, columns: np.ndarray, hypothesis: Hypothesis) -> Candidate:
    """A candidate fitted again without some of its parameters, under another hypothesis."""
    z, states = np.delete(candidate.place.z, columns), model.states_for(hypothesis, candidate.place.states)
    return refitted(model, hypothesis, z, states)


def _instead(model: Model, base: np.ndarray, rival: Candidate) -> Candidate:
    """A rival fitted again in a model that knows less, from the model's own parameters `base`."""
    hypothesis = rival.place.hypothesis
    states = model.states_for(hypothesis, rival.place.states)
    return refitted(model, hypothesis, np.concatenate([base, rival.place.own]), states)


def _sure(effect: FoundEffect) -> bool:
    size = effect.parameters[0]
    return effect.possible and abs(size.value - size.nominal) > _SURE * 0.5 * (size.high - size.low)
