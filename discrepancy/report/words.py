"""The answer in one sentence, and numbers as a person writes them."""

from __future__ import annotations

import math

from discrepancy.chain import Outcome
from discrepancy.estimates import Estimate, FoundEffect
from discrepancy.finding import Finding
from discrepancy.grades import FAMILY, NAMED
from discrepancy.locate import Where
from discrepancy.locate.sentences import shortly
from discrepancy.origin import Origin
from discrepancy.subjects.base import bounded
from indexer_cli.words import joined
from indexer_env.units import behind_number

JOINT_WORDS = {
    "input": "the drive or the input joint", "output": "the indexer, the output joint or the table", "base": "the base",
    "sensor": "the measuring chain",
}  # fmt: skip
"""Where something is missing, to a reader."""


def headline(outcome: Outcome) -> str:
    """What is missing, how large it is, how much of the gap it closes, and what remains."""
    answer = outcome.answer
    if answer.verdict == "nothing missing":
        if _unrepeated(outcome) and answer.criteria.tolerance is None:
            return (
                f"Nothing that repeats from turn to turn is missing: {times(answer.before)} the noise remains on "
                f"records that were never fitted{_unrepeated(outcome)}, so that the noise is larger than it was taken "
                f"for, or something acts that is not locked to the table{_yet(outcome)}.{_cut_short(outcome)}"
            )
        tolerated = answer.criteria.tolerance is not None
        level = f"{times(answer.before / answer.remains.noise)} both" if tolerated else f"{times(answer.before)} it"
        said = f"Nothing is missing: the calibrated model comes down to the noise{' and what is tolerated' * tolerated}"
        return (
            f"{said} on records that were never fitted ({level}){_yet(outcome)}{_taken_up(outcome)}."
            f"{_cut_short(outcome)}"
        )
    named = [finding for finding in answer.findings if finding.grade in NAMED]
    hints = [finding for finding in answer.findings if finding.grade not in NAMED]
    remains = f"{times(answer.after)} the noise remains{_unrepeated(outcome)}{where_in_short(outcome.left)}"
    if named:
        closes = "close" if len(named) > 1 else "closes"
        said = f"{capital(joined([described(finding) for finding in named]))} {closes} {_closed(outcome)} of the gap"
        if not remains_more(outcome):
            return f"{said}; nothing else remains above the noise{_yet(outcome)}.{_cut_short(outcome)}"
        said = f"{said}; {remains}"
    else:
        said = f"Something is missing to which no effect of the library gives a name: {remains}"
    if hints:
        names = joined([finding.name for finding in hints])
        stand = "stand" if len(hints) > 1 else "stands"
        said += f"; {names} {stand} in for a part of it"
    elif answer.remains.looks_like:
        said += f"; {answer.remains.looks_like} comes nearest to it, but explains too little"
    return f"{said}.{_cut_short(outcome)}"


def remains_more(outcome: Outcome) -> bool:
    """Whether more than noise, and what is tolerated, remains beside what is accepted."""
    criteria, noise = outcome.answer.criteria, outcome.answer.remains.noise
    floor = 1.0 if criteria.tolerance is None else noise
    return not outcome.answer.within_noise and (outcome.answer.after / floor) ** 2 - 1.0 >= criteria.at_noise


def floor(outcome: Outcome) -> str:
    """What the machine comes down to where nothing is missing: its noise, what is tolerated, what does not repeat."""
    if outcome.answer.criteria.tolerance is not None:
        return "their noise and what is tolerated"
    return (
        "what does not repeat from turn to turn, which is more than their noise"
        if _unrepeated(outcome)
        else "their noise"
    )


def _unrepeated(outcome: Outcome) -> str:
    """How much of what remains does not repeat or is tolerated, where that is more than the noise."""
    noise = outcome.answer.remains.noise
    if noise**2 - 1.0 < outcome.answer.criteria.at_noise:
        return ""
    tolerated = "" if outcome.answer.criteria.tolerance is None else "is tolerated or "
    return f" ({times(noise)} of it {tolerated}does not repeat from turn to turn)"


def _taken_up(outcome: Outcome) -> str:
    """Hints at what would lessen even what lies within the noise."""
    hints = [finding.name for finding in outcome.answer.findings]
    return f"; {joined(hints)} would take up a part of what is left" if hints else ""


def _yet(outcome: Outcome) -> str:
    """What the records fitted show beyond chance all the same, though those held out are at their noise."""
    tolerated = outcome.answer.criteria.tolerance is not None  # and what the test sees may be within it
    if outcome.left is None or not outcome.left.significant or tolerated:
        return ""
    return f", though the records fitted disagree with it beyond chance{where_in_short(outcome.left)}"


def where_in_short(where: Where | None) -> str:
    """ ", most at …", or nothing."""
    said = "" if where is None else shortly(where.cells, where.spots, where.spread)
    return f", {said}" if said else ""


def comes_from(origin: Origin) -> str:
    """Where what remains comes from, how sure that is, and what is hardly told from it."""
    first = origin.first
    said = f"Of the causes that were compared, {first.name} is the most likely"
    likely = _surely(first.probability)
    said += f" (among them it is {JOINT_WORDS[first.joint]}, varying with {first.kind}, with {likely})"
    if origin.alike:
        said += f"; these records hardly tell it from {joined([place.name for place in origin.alike])}"
    if origin.beside:
        said += f"; beside it they show {joined(list(dict.fromkeys(place.name for place in origin.beside)))}"
    return f"{said}."


def _surely(probability: float) -> str:
    """A probability among what was compared, which is not all that there can be."""
    return "over 99 %" if probability > 0.99 else percent(probability)


def described(finding: Finding) -> str:
    """A finding with its size: "friction.coulomb 23.5 N m (22.1 to 24.9)"; of a family each member with its own."""
    if finding.grade != FAMILY:
        return sized(finding.effects[0])
    members = " or ".join(sized(effect) for effect in finding.effects)
    return f"one of {members}, which these records cannot tell apart,"


def sized(effect: FoundEffect) -> str:
    """An effect with its first parameter, which is its size, and its choices."""
    e = effect.parameters[0]
    choices = "".join(f", {name} {value:.4g}" for name, value in effect.choices)
    return f"{effect.name} {_with_unit(e)} ({number(e.low, e)} to {number(e.high, e)}{choices})"


def ranged(e: Estimate) -> str:
    """Value, unit and 95 % interval."""
    return f"{_with_unit(e)}, {number(e.low, e)} to {number(e.high, e)}"


def number(value: float, e: Estimate) -> str:
    """A value of an estimate with no more digits than its interval bears."""
    if math.isinf(value):
        return bounded(value)
    told = e.high - e.low if math.isfinite(e.high - e.low) else abs(e.value)
    width = max(told, 1e-3 * abs(e.value))
    digits = 2 if width == 0.0 else max(0, math.floor(math.log10(max(abs(value), width) / width)) + 2)
    return f"{float(f'{value:.{max(digits, 2)}g}'):g}"


def plain(text: str, encoding: str = "utf-8") -> str:
    """A text that can be written: the name of a file may hold bytes that are no text."""
    return text.encode(encoding, "backslashreplace").decode(encoding)


def percent(share: float) -> str:
    """A share in per cent, with as many digits as it needs near 0 and 1."""
    distance = min(abs(share), abs(1.0 - share))
    return f"{100.0 * share:.{1 if 0.0 < distance < 0.095 else 0}f} %"


def capital(words: str) -> str:
    """A sentence's beginning; names of the library, which hold a full stop, stay."""
    return words if "." in words.partition(" ")[0] else words[:1].upper() + words[1:]


def _with_unit(e: Estimate) -> str:
    return number(e.value, e) + behind_number(e.unit)


def times(level: float) -> str:
    """ "1.02 times", "6.3 times", "12 times"."""
    return f"{level:.2f} times" if level < 2.0 else f"{level:.1f} times" if level < 9.95 else f"{level:.0f} times"


def _closed(outcome: Outcome) -> str:
    share = outcome.answer.closed_share
    return "what there was" if math.isnan(share) else percent(min(share, 1.0))


def _cut_short(outcome: Outcome) -> str:
    if outcome.answer.selection.complete:
        return ""
    return " The time allowed ran out before the search ended: this is the best found so far."


def to_do(outcome: Outcome) -> str:
    """What to do next, in a sentence or two."""
    question = outcome.question
    if question is None:
        written = outcome.answer.written
        which = "nominal machine" if written.held_back else "machine as the records show it"
        if written.held_back and written.place.hypothesis.effects:
            which = f"{which} with what is named"
        return f"{_closed_question(outcome)}. machine.yaml is the {which}."
    grows = "Record at another speed and under another load, and see with which of them the remainder grows"
    if len(question.rivals) < 2:
        return f"{grows}: no effect of the library predicts it, so no measurement could be chosen by simulation."
    if not outcome.next:
        return f"It is open {question.about}, and no measurement could be chosen by simulation. {grows}."
    best, enough = outcome.next[0], outcome.answer.criteria.margin
    if best.separation < enough:
        return (
            f"It is open {question.about}, and no single record that was imagined would settle it: the best one, "
            f"{best.measurement}, separates the two by {best.separation:.0f} where {enough:g} is enough. {grows}."
        )
    return f"Record {best.measurement}: it would show {question.about}."


def _closed_question(outcome: Outcome) -> str:
    """What is open where no measurement was asked for."""
    if not outcome.asked:
        return "Whether anything is open is not known, as that stage failed"
    tolerated = outcome.answer.criteria.tolerance is not None
    if outcome.left is None or not outcome.left.significant or tolerated:
        return "Nothing is open"
    return (
        "No name is open; the records fitted still disagree beyond chance, though those held out do not: where records "
        "that were never used show it too, it is more than chance"
    )
