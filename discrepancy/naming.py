"""Which effect is missing: every effect and "none" compete for the same records, and for records they never saw.

scan every start → fit the promising ones jointly → refit the base from the winner's place → compare, also on records
held out.
All rules are relative: to the base model's misfit, to the noise floor and to each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from discrepancy.blackbox import black_box_level
from discrepancy.candidates import (
    CAUTIONS,
    FLOOR,
    Candidate,
    base_candidate,
    brought_to_rest,
    careful_base,
    finalists,
    tested,
)
from discrepancy.findings import Ranked, ranked
from discrepancy.held_out import held_places
from discrepancy.model import NONE, Model
from discrepancy.problem import Point
from discrepancy.scan import Scanner
from discrepancy.starts import promising
from indexer_env.errors import refuse

VERDICTS = ("named", "none", "ambiguous", "unexplained", "not_converged")
"""named: an effect is clearly ahead, or effects found one after the other close the gap; none: there is no gap;
ambiguous: several effects explain it alike; unexplained: there is a gap that no effect of the library closes;
not_converged: the base fit never came to rest, so nothing can be said."""

NAMING = ("named", "ambiguous")
"""Verdicts that give a name."""

MARGIN = 30.0
"""Least gain in cost (twice a log-likelihood) beyond the price of an effect's parameters."""

_EARNED = 0.1
"""Least share of the gap on the records held out (mean square above the noise) that an effect must close."""

_SHARE = 0.05
"""Share of the winner's gain by which the next effect must stay behind; nearer ones are ambiguous."""

_CLEAR = 60.0
"""Lead in a typical window, times the windows, by which an effect that is down at the noise is told from another."""

_TEMPER = 3.0
"""Factor by which evidence is taken for less than the sum over samples says: what a model gets wrong repeats. With it
and the margin, probabilities of cases whose answer is known came out best."""

AT_NOISE = 0.11
"""Mean square above the noise of a typical window (the median), in units of it, below which nothing is left in it."""

SLIGHT = 0.2
"""Mean square above the noise, in units of it, below which there is hardly a gap: 1.095 in rms."""


@dataclass(frozen=True, eq=False)
class Naming:
    """The answer.

    Attributes
    ----------
    verdict : str
        One of VERDICTS.
    names : tuple of str
        The effect named, or those that cannot be told apart.
    candidates : tuple of Candidate
        Those fitted to the end, best first; "none" among them.
    black_box : float
        Level of the black-box control on the records held out.
    reason : str
    """

    verdict: str
    names: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    black_box: float
    reason: str

    @property
    def ranking(self) -> tuple[Ranked, ...]:
        """Posterior probabilities, each effect charged the margin for being searched for, tempered by the misfit that
        even the best candidate leaves."""
        rows = [(c.name, c.score + (0.0 if c.name == NONE.name else MARGIN), c.held_out) for c in self.candidates]
        return ranked(rows, max(1.0, self.candidates[0].level ** 2) * _TEMPER)


def name_effect(model: Model, held_out: Model, start: Point | None = None) -> Naming:
    """Name the one effect that a model lacks most to explain its records.

    Parameters
    ----------
    model : Model
        With the records to fit.
    held_out : Model
        The same model with records at other conditions, on which the candidates are compared with their physics frozen.
    start : Point, optional
        Where the base fit begins: the place reached by the model that this one extends.
    """
    if not model.hypotheses():
        raise refuse("name_effect", "model", "a library of one effect or more", "none", "take effects out of without")
    careful = careful_base(model, start)
    scanner = Scanner(model, careful, CAUTIONS[0])
    starts, more = promising(model, scanner)
    if scanner.gain(starts[0]) <= MARGIN:
        # where no start promises anything, the best one stands for all
        starts, cut = starts[:1], starts[1:]
        more = {name: [*(s for s in cut if s.hypothesis.name == name), *others] for name, others in more.items()}
    rivals = finalists(scanner, starts, more, careful.cost)
    none = base_candidate(model, careful, rivals[0])
    candidates, held = _compared([none, *rivals], held_out)
    best, *others = candidates
    if best.name != NONE.name and best.level < FLOOR and best.typical**2 - 1.0 >= AT_NOISE:
        # at the noise, but for a few windows or on the records held out: not yet at rest
        candidates, held = _compared([brought_to_rest(model, best), *others], held_out, held)
    of_none = next(place for place in held if place.hypothesis.name == NONE.name)
    return _verdict(candidates, black_box_level(model, none.place, held_out, of_none))


def judged(held_out: Model, candidates: Sequence[Candidate], black_box: float) -> Naming:
    """The answer that candidates for the same records give, "none" among them; of two with one name the better one
    counts."""
    best: dict[str, Candidate] = {}
    for candidate in sorted(candidates, key=lambda c: c.score):
        best.setdefault(candidate.name, candidate)
    return _verdict(_compared(list(best.values()), held_out)[0], black_box)


def _compared(
    candidates: Sequence[Candidate], held_out: Model, found: Sequence[Point] = ()
) -> tuple[list[Candidate], list[Point]]:
    """The candidates, best first, with what they predict of the records held out; and their places there. Places
    `found` there before lend their start states."""
    candidates = sorted(candidates, key=lambda c: c.score)
    held = held_places([c.place for c in candidates], held_out, found)
    return [tested(c, place, held_out) for c, place in zip(candidates, held, strict=True)], held


def alike(best: Candidate, other: Candidate, gain: float) -> bool:
    """Whether another effect explains the records as well as the best one, which gains so much over none: a share of a
    large gain may be what a fit has missed in some windows, but not where the best one is down at the noise and the
    other is not, or is behind in most windows."""
    behind = other.score - best.score
    if behind < MARGIN:
        return True
    at_noise = best.typical**2 - 1.0 < AT_NOISE
    told_apart = at_noise and (other.typical**2 - 1.0 >= AT_NOISE or best.lead(other) > _CLEAR)
    return behind < _SHARE * gain and not told_apart


def _verdict(candidates: list[Candidate], box: float) -> Naming:
    none = next(c for c in candidates if c.name == NONE.name)
    best = candidates[0]
    gap, gain = none.level**2 - 1.0, none.score - best.score

    def answer(verdict: str, names: tuple[str, ...], reason: str) -> Naming:
        return Naming(verdict, names, tuple(candidates), box, reason)

    if gain < MARGIN or (gap < SLIGHT and none.held_out <= 1.05 * best.held_out):
        if gap < SLIGHT:
            if none.strange**2 - 1.0 < SLIGHT:
                return answer("none", (), "the base model alone reaches the noise floor")
            remark = f"leaves one held out at {none.strange:.2f} times the noise, and no effect lessens that"
            return answer("unexplained", (), f"the base model explains the records fitted but {remark}")
        verdict = "unexplained" if none.converged else "not_converged"
        return answer(verdict, (), "the base model leaves a gap, and no effect of the library lessens it")
    near = [c.name for c in candidates[1:] if c.name != NONE.name and alike(best, c, gain)]
    if near:
        return answer("ambiguous", (best.name, *near), "these effects explain the records alike")
    closed = (none.held_out**2 - best.held_out**2) / max(none.held_out**2 - 1.0, SLIGHT)
    if closed < _EARNED:
        remark = f"{best.name} closes {100.0 * closed:.0f} % of the gap on the records held out, too little to be named"
        return answer("unexplained", (best.name,), remark)
    return answer("named", (best.name,), f"{best.name} explains the records best, also those it never saw")
