"""The verdict in one sentence, and numbers as a person writes them."""

from __future__ import annotations

import math

from discrepancy.chain import Outcome
from discrepancy.findings import Estimate, FoundEffect
from discrepancy.gap import Share
from discrepancy.next_measurement import ENOUGH


def headline(outcome: Outcome) -> str:
    """The verdict in one sentence."""
    answer, gap = outcome.answer, outcome.gap
    if answer.verdict == "named":
        found = _and([described(effect) for effect in answer.found])
        return f"The model lacks {found}; with {_it(answer.found)} {_closed(gap.closed_share)}."
    if answer.verdict == "ambiguous":
        *sure, _ = answer.found
        rivals = " or ".join(answer.rounds[-1].names)
        also = f"{_and([described(effect) for effect in sure])}, and " if sure else ""
        return f"The model lacks {also}{rivals}, which these records cannot tell apart; {_remedy(outcome)}."
    if answer.verdict == "none":
        left, floor = percent(gap.before.value), percent(gap.noise_floor.value)
        return f"Nothing is missing: the calibrated model leaves {left} of the records; the noise alone is {floor}."
    if answer.verdict == "unexplained":
        return f"Something is missing that the library does not know: {answer.reason}; nothing was added."
    return f"The calibration did not come to rest, so nothing can be said of what is missing: {answer.reason}."


def described(effect: FoundEffect) -> str:
    """An effect with its size: "friction.coulomb (torque 23.5 N m, 22.1 to 24.9)"."""
    parts = [f"{e.name} {ranged(e)}" for e in effect.parameters]
    parts += [f"{name} {value:g}" for name, value in effect.choices]
    return f"{effect.name} ({', '.join(parts)})"


def ranged(e: Estimate) -> str:
    """Value, unit and 95 % interval."""
    unit = "" if e.unit == "-" else f" {e.unit}"
    return f"{number(e.value, e)}{unit}, {number(e.low, e)} to {number(e.high, e)}"


def number(value: float, e: Estimate) -> str:
    """A value of an estimate with no more digits than its interval bears."""
    width = max(e.high - e.low, 1e-3 * abs(e.value))
    digits = 2 if width == 0.0 else max(0, math.floor(math.log10(max(abs(value), width) / width)) + 2)
    return f"{float(f'{value:.{max(digits, 2)}g}'):g}"


def percent(share: float) -> str:
    """A share in per cent, with as many digits as it needs near 0 and 1."""
    distance = min(abs(share), abs(1.0 - share))
    return f"{100.0 * share:.{1 if 0.0 < distance < 0.095 else 0}f} %"


def percents(share: Share) -> str:
    """A share with its interval in per cent."""
    return f"{percent(share.value)} ({percent(share.low)} to {percent(share.high)})"


def _closed(share: Share | None) -> str:
    if share is None:
        return "the gap on records never fitted, which was at the noise floor, stays there"
    return f"{percents(share)} of the gap closes on records that were never fitted"


def _it(effects: tuple[FoundEffect, ...]) -> str:
    return "it" if len(effects) == 1 else "them"


def _remedy(outcome: Outcome) -> str:
    best = outcome.next[0] if outcome.next else None
    if best is None or best.separation < ENOUGH:
        return "nor would any further record that was imagined"
    return f"one more record would: {best.measurement}"


def _and(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
