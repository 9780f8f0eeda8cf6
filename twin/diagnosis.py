"""What the networks say of a turn, as objects."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from indexer_cli.words import joined
from twin.faults import FAULTS

HEALTHY, FAULTY, UNKNOWN, NOT_COMPARABLE = "healthy", "faulty", "unknown", "not comparable"
"""What is said of a turn."""


@dataclass(frozen=True)
class FaultSeen:
    """A fault as the networks see it.

    Attributes
    ----------
    name : str
    probability : float
    size, low, high : float
        In the shop's unit, with the interval that holds the stated share.
    unit : str
    share : float
        The size as share of the largest.
    matters : bool
        Whether it is as large as the smallest size that a headline names.
    station : int or None
        Where a single roller is cracked, counted from the stated start angle; None where unknown.
    """

    name: str
    probability: float
    size: float
    low: float
    high: float
    unit: str
    share: float
    matters: bool
    station: int | None = None


@dataclass(frozen=True)
class TurnDiagnosis:
    """What the networks say of a turn, or of several together.

    Attributes
    ----------
    verdict : str
        HEALTHY, FAULTY, UNKNOWN or NOT_COMPARABLE.
    faults : tuple of FaultSeen
        Those that are named, as likely there as not or more, the most probable first.
    probabilities : mapping
        Of each fault of the table.
    severities : mapping
        (size, low, high) of each fault of the table in the shop's unit, were it there.
    alarm : float
        Logit of any fault less the threshold; above 0 the turn is not healthy.
    novelty : float
        Over its threshold; above 1 the turn is like none of the simulated ones.
    reason : str
        One sentence.
    notes : tuple of str
        What of the record was put right.
    unnamed : tuple of FaultSeen
        Of a turn with an alarm, faults that are possible and not named, with the sizes that they would have.
    """

    verdict: str
    faults: tuple[FaultSeen, ...]
    probabilities: Mapping[str, float]
    severities: Mapping[str, tuple[float, float, float]]
    alarm: float
    novelty: float
    reason: str
    notes: tuple[str, ...] = ()
    unnamed: tuple[FaultSeen, ...] = ()

    @property
    def suspected(self) -> tuple[FaultSeen, ...]:
        """All faults that the networks think possible."""
        return (*self.faults, *self.unnamed)


def said_of(
    alarm: float, novelty: float, named: Sequence[FaultSeen], nearest: FaultSeen
) -> tuple[str, tuple[FaultSeen, ...], str]:
    """The verdict on a turn, the faults that are told, and why.

    Without a likely fault, `named`, an alarm is unknown, but healthy where the nearest fault is too small to matter.
    """
    if novelty > 1.0:
        why = f"the turn is unlike the healthy machine and all faults of the table, {novelty:.1f} times the limit"
        return UNKNOWN, tuple(named) if alarm > 0.0 else (), why
    if alarm <= 0.0:
        return HEALTHY, (), "the turn is as the healthy machine's"
    if named:
        slight = "" if any(one.matters for one in named) else ", too small to matter"
        return FAULTY, tuple(named), f"the turn shows {joined([FAULTS[one.name].words for one in named])}{slight}"
    near = f"nearest: {FAULTS[nearest.name].words}, {100.0 * nearest.probability:.0f} %"
    if nearest.matters:
        return UNKNOWN, (), f"the turn is not healthy, and no fault of the table is likely; {near}"
    return HEALTHY, (), f"the turn raises an alarm, but no fault is likely; {near}, too small to matter"


def together(each: Sequence[TurnDiagnosis]) -> TurnDiagnosis:
    """What comparable records of a machine in one state say together: of the records on the side on which all are in
    the middle, the one that is clearest there; of those with an alarm one that names faults, if any does.

    The median novelty decides, and the mean alarm of those that are not novel. A limit that one healthy turn in a
    hundred passes is passed by the highest of n in n hundredths.
    """
    if statistics.median(one.novelty for one in each) > 1.0:
        return max(each, key=lambda one: one.novelty)
    known = [one for one in each if one.novelty <= 1.0]
    alarmed = statistics.fmean(one.alarm for one in known) > 0.0
    if not alarmed:
        return min(known, key=lambda one: one.alarm)
    return max(known, key=lambda one: (bool(one.faults), one.alarm))
