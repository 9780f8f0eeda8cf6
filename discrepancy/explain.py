"""Name, add, and look again: effects are found one after the other until no gap is left or none earns its place; what
later ones have made superfluous is taken back, and what could not be told apart before is tried again."""

from __future__ import annotations

import math
from dataclasses import dataclass

from discrepancy.candidates import Candidate
from discrepancy.findings import Calibration, FoundEffect, Ranked, findings
from discrepancy.hindsight import corrected, effects_of, told_apart
from discrepancy.model import NONE, Hypothesis, Model, in_turn
from discrepancy.naming import AT_NOISE, NAMING, SLIGHT, Naming, name_effect

_OPEN = 0.15
"""Largest share of the gap on records held out (mean square above the noise) that the effects named may leave open."""

_SYSTEMATIC = 0.01
"""Largest misfit of a typical window (mean square above the noise) as share of the gap, where it is not down at the
noise anyway: an effect that only resembles what is missing fails in every window."""

_ROUNDS = 3
"""Most effects looked for."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the records are explained by.

    Attributes
    ----------
    verdict : str
        One of `naming.VERDICTS`.
    effects : tuple of Hypothesis
        The effects found, in the order in which they were; they count as missing only where the verdict names them.
    first : Naming
        What the model as it came was judged to lack most, before anything was known of further effects.
    rounds : tuple of Naming
        What each round found; where the effect of a round was taken back, it stands there behind what took its place,
        and an ambiguous round that was judged again stands last.
    before, after : float
        Level (rms over noise) on the records held out, of the model as it came and with the effects.
    model : Model
        The model extended by the effects, with the records fitted.
    reason : str
    ranking : tuple of Ranked
        The hypotheses of the last round that was accepted (the only one where nothing was found), best first.
    found : tuple of FoundEffect
        The effects with their sizes, in the order of `effects`.
    calibration : Calibration
        The machine's own parameters with the effects in place, or without them where the verdict does not accept them.
    """

    verdict: str
    effects: tuple[Hypothesis, ...]
    first: Naming
    rounds: tuple[Naming, ...]
    before: float
    after: float
    model: Model
    reason: str
    ranking: tuple[Ranked, ...]
    found: tuple[FoundEffect, ...]
    calibration: Calibration

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects; those the last one cannot be told from stand in `rounds[-1].names`."""
        return tuple(h.name for h in self.effects)

    @property
    def closed_share(self) -> float:
        """Share of the closable gap that was closed on the records held out; NaN where there was none."""
        gap = self.before**2 - 1.0
        return (self.before**2 - self.after**2) / gap if gap > 0.0 else math.nan

    @property
    def base(self) -> Candidate:
        """The model as it came, fitted."""
        return _none(self.first)

    @property
    def best(self) -> Candidate:
        """The last candidate with the effects found, or the base model."""
        return self.rounds[-1].candidates[0] if self.effects else self.base

    @property
    def believed(self) -> Candidate:
        """The candidate whose machine is believed: the best one where the verdict names its effects, or the base
        model."""
        return self.best if self.verdict in NAMING else self.base


def explain(model: Model, held_out: Model) -> Explanation:
    """Find the effects that a model lacks, by its records and records held out (the same model, other conditions)."""
    first = name_effect(model, held_out)
    base, rounds = _none(first), (first,)
    before, after, effects, place = base.held_out, base.held_out, [], base.place
    if first.verdict in NAMING:
        rounds = _followed(model, held_out, rounds)
        again = corrected(model, held_out, rounds)
        rounds = told_apart(model, held_out, rounds if again is None else _followed(model, held_out, again))
        effects = effects_of(rounds)
        after, place = rounds[-1].candidates[0].held_out, rounds[-1].candidates[0].place
    fitted = in_turn(model, effects[:-1])
    numbers = findings(fitted, place)
    found = tuple(numbers.effect(h.name, tuple(h.fixed.items())) for h in effects)
    verdict, reason = _judged(rounds, found, before, after, first.black_box)
    if effects and verdict not in NAMING:
        numbers = findings(model, base.place)
    return Explanation(
        verdict, tuple(effects), first, rounds, before, after, in_turn(fitted, effects[-1:]), reason,
        rounds[-1].ranking, found, numbers.calibration(len(model.parameters)),
    )  # fmt: skip


def _followed(model: Model, held_out: Model, rounds: tuple[Naming, ...]) -> tuple[Naming, ...]:
    """The rounds with those that follow them, as long as they name an effect."""
    while True:
        best, effects = rounds[-1].candidates[0], effects_of(rounds)
        known, known_held = in_turn(model, effects), in_turn(held_out, effects)
        if best.level**2 - 1.0 < SLIGHT or len(rounds) == _ROUNDS or not known.hypotheses():
            return rounds
        following = name_effect(known, known_held, best.place)
        if following.verdict not in NAMING:
            return rounds
        rounds = (*rounds, following)


def _none(naming: Naming) -> Candidate:
    return next(c for c in naming.candidates if c.name == NONE.name)


def _judged(
    rounds: tuple[Naming, ...], found: tuple[FoundEffect, ...], before: float, after: float, box: float
) -> tuple[str, str]:
    last = rounds[-1]
    if not found:
        return last.verdict, last.reason
    for naming in rounds[:-1]:
        if naming.verdict == "ambiguous":
            names, others = " and ".join(naming.names), " and ".join(last.names)
            remark = f"{names} cannot be told apart"
            if last.verdict == "ambiguous":
                return "unexplained", f"{remark}, nor can {others} beside them"
            return "unexplained", f"{remark}, and none earns its place beside what was found after them"
    for effect in found:
        if not effect.possible:
            return "unexplained", f"the effects found would close the gap, but {effect.why}, so one imitates another"
    if after > box:
        return (
            "unexplained",
            f"a black box predicts the records held out better ({box:.2f}) than the effects ({after:.2f})",
        )
    gap, typical = before**2 - 1.0, last.candidates[0].typical
    if typical**2 - 1.0 > max(_SYSTEMATIC * gap, AT_NOISE):
        return "unexplained", f"even with the effects found a typical cam turn is left at {typical:.2f} times the noise"
    if after**2 - 1.0 > max(_OPEN * gap, SLIGHT):
        return "unexplained", f"the effects found leave the records held out at {after:.2f} times the noise"
    if not last.candidates[0].converged and typical**2 - 1.0 >= AT_NOISE:
        return (
            "not_converged",
            f"the fit is not at rest, and leaves a typical cam turn at {typical:.2f} times the noise",
        )
    return last.verdict, last.reason
