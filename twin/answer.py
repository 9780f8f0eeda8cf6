"""One answer of networks and physics.

The rules, the first that fits:

    the record cannot be compared                       not comparable, and why
    no physics was asked for                            what the networks say
    physics finds faults and leaves more than noise     these and those others that are likely by networks and physics
                                                        together, and what remains; unknown where the turn is like none
                                                        that was simulated
    physics finds another that explains the record      physics' faults; what the networks say otherwise is told beside
    physics explains the record by some of the faults   these, and those others that are likely by both together
    that the networks name
    physics explains the record without a fault         the faults that are likely by both together; else healthy, and
                                                        an alarm of the networks is told as not confirmed
    physics leaves something, networks name faults      those that are likely by both together, if one matters, and what
                                                        remains
    otherwise                                           unknown, and what remains

Physics measures what it does not find beside what it found. A fault that it did not measure is as likely as the
networks say; of those that the networks do not name, the likeliest one is told.

An alarm of the networks for which no fault is likely is unknown, or healthy where the nearest fault is too small to
matter; a remark says so.

A fault that both name has the networks' size, but where they see another one that is not there or the turn is like none
that was simulated: what is fitted beside simulated turns has intervals that hold as often as they say. Where the two
differ in station, or their intervals do not meet, a remark says so. A fault smaller than the smallest size that matters
is told, but not in the headline; with such faults alone the machine is healthy.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.special import expit, logit

from discrepancy.grades import STANDS_IN
from indexer_cli.words import joined
from indexer_env.machine import Machine
from twin.diagnosis import FAULTY, HEALTHY, NOT_COMPARABLE, UNKNOWN, TurnDiagnosis
from twin.faults import FAULTS, Fault
from twin.found import BOTH, FoundFault, by_network, by_physics, physical
from twin.physics import PhysicalFault, Physics

_SURE = 1.0 - 1e-6
"""Largest probability that counts: no network is surer."""

_MORE_THAN_NOISE = 1.2
"""Times the noise above which faults do not explain a record."""


@dataclass(frozen=True)
class Answer:
    """The answer.

    Attributes
    ----------
    verdict : str
        "healthy", "faulty", "unknown" or "not comparable".
    headline : str
    faults : tuple of FoundFault
        Those that matter first.
    remarks : tuple of str
        Where networks and physics differ, what remains.
    network : TurnDiagnosis
    physics : Physics or None
    no_physics : str
        Why there is none, where it was asked for.
    """

    verdict: str
    headline: str
    faults: tuple[FoundFault, ...]
    remarks: tuple[str, ...]
    network: TurnDiagnosis
    physics: Physics | None
    no_physics: str = ""

    def plain(self) -> dict[str, Any]:
        """As JSON knows it."""
        return dataclasses.asdict(self) | {"faults": [dataclasses.asdict(f) | {"told": f.told} for f in self.faults]}


def answer_of(
    network: TurnDiagnosis, physics: Physics | None, machine: Machine, matters: Mapping[str, float],
    faults: Sequence[Fault] = tuple(FAULTS.values()),
) -> Answer:  # fmt: skip
    """One answer; `matters` has the smallest size of each fault that a headline names, as share of the largest,
    `faults` are those of the twin's table."""
    if network.verdict == NOT_COMPARABLE:
        return Answer(NOT_COMPARABLE, f"Not comparable: {network.reason}", (), (), network, physics)
    seen = by_network(network)
    if physics is None:
        told = () if network.verdict == UNKNOWN else seen
        return _with(network.verdict, told, _nameless(network), network, None)
    remains = f"{physics.level:.1f} times the noise remains"
    if physics.verdict == FAULTY:
        strange = network.verdict == UNKNOWN and network.novelty > 1.0
        found = by_physics(physics, seen, machine, matters, faults, own=strange)
        if strange and physics.level > _MORE_THAN_NOISE:
            said = joined([fault.told for fault in found])
            why = f"By physics {said}, beside which {remains}."
            return _with(UNKNOWN, (), (f"By the networks {network.reason}.", why), network, physics)
        kept, more = _kept(found, seen, physics), _more(found, network, physics, machine, matters, faults)
        if len(kept) < len(_others(found, seen)):
            # the networks' sizes are those beside a fault that is not there
            found = by_physics(physics, seen, machine, matters, faults, own=True)
        every = (*found, *kept, *more)
        if physics.level > _MORE_THAN_NOISE and not any(fault.matters for fault in every):
            said = joined([fault.told for fault in every])
            why = f"By physics {said}, smaller than what is surely seen, beside which {remains}."
            return _with(UNKNOWN, (), (*_nameless(network), why), network, physics)
        remarks = (
            *_differences(every, seen, physics),
            *_apart(by_physics(physics, (), machine, matters, faults), seen),
        )
        return _with(FAULTY, every, remarks, network, physics)
    if physics.verdict == HEALTHY:
        there: Sequence[FoundFault] = ()
        if network.alarm > 0.0 and network.novelty <= 1.0:
            there = (*_kept((), seen, physics), *_more((), network, physics, machine, matters, faults))
        remarks = _nameless(network)
        if network.verdict != HEALTHY:
            dropped = _others(there, seen)
            said = joined([fault.told for fault in dropped]) or "something that is in no table"
            if dropped or not there:
                remarks = (f"The networks see {said}; physics explains the record down to the noise without it.",)
        if there:
            said = joined([fault.words for fault in there])
            without = f"Physics explains the record also without {said}"
            remarks = (*remarks, f"{without}; by networks and physics together it is there more likely than not.")
        return _with(FAULTY if there else HEALTHY, there, remarks, network, physics)
    remains = f"{remains} that no fault of the table explains ({physics.sentence.rstrip('.')})."
    seen = tuple(_kept((), seen, physics))
    if network.verdict == FAULTY and any(fault.matters for fault in seen):
        return _with(FAULTY, seen, (f"Physics does not confirm it: {remains}",), network, physics)
    return _with(UNKNOWN, (), (f"By physics {remains}",), network, physics)


def _nameless(network: TurnDiagnosis) -> tuple[str, ...]:
    """Why the networks name nothing of a turn that they do not find as the healthy machine's."""
    unnamed = network.verdict == UNKNOWN or (network.verdict == HEALTHY and network.alarm > 0.0)
    return (f"By the networks {network.reason}.",) if unnamed else ()


def _kept(found: Sequence[FoundFault], seen: Sequence[FoundFault], physics: Physics) -> Sequence[FoundFault]:
    """The networks' other faults that stand beside those that physics found, but those that networks and physics
    together find less likely there than not; none where physics explains the record by another one."""
    if physics.level <= _MORE_THAN_NOISE and any(fault.by != BOTH for fault in found):
        return ()
    evidence = {one.fault: one.evidence for one in physics.measured}
    kept = []
    for one in _others(found, seen):
        measured = evidence.get(one.name, 0.0)
        if one.name not in evidence or _both(one.probability, measured) > 0.5:
            kept.append(dataclasses.replace(one, by=BOTH if measured > 0.0 else one.by))
    return kept


def _both(probability: float, evidence: float) -> float:
    """Probability of a fault by networks and by physics, which has ln of a Bayes factor (logarithmic opinion pool)."""
    return float(expit(logit(min(probability, _SURE)) + evidence)) if probability > 0.0 else 0.0


def _more(
    found: Sequence[FoundFault], network: TurnDiagnosis, physics: Physics, machine: Machine,
    matters: Mapping[str, float], faults: Sequence[Fault],
) -> tuple[FoundFault, ...]:  # fmt: skip
    """The fault that neither names and that both together find the likeliest, if more likely there than not; one alone,
    as each is measured as if no other were missing."""
    if any(fault.by != BOTH for fault in found):
        return ()
    table, unnamed = {fault.name: fault for fault in faults}, {one.name: one for one in network.unnamed}
    looked = [one for one in physics.measured if one.fault in unnamed]
    chances = [_both(unnamed[one.fault].probability, one.evidence) for one in looked]
    chance, best = max(zip(chances, looked, strict=True), key=lambda pair: pair[0], default=(0.0, None))
    if best is None or chance <= 0.5:
        return ()
    station = unnamed[best.fault].station
    seen = PhysicalFault(best.fault, best.size, best.low, best.high, chance, STANDS_IN, station)
    return (dataclasses.replace(physical(seen, table.get(best.fault), machine, matters), by=BOTH),)


def _with(
    verdict: str, faults: Sequence[FoundFault], remarks: Sequence[str], network: TurnDiagnosis, physics: Physics | None
) -> Answer:
    large = [fault for fault in faults if fault.matters]
    slight = [fault for fault in faults if not fault.matters]
    if slight and (large or verdict == FAULTY):
        said = joined([fault.told for fault in slight])
        remarks = (*remarks, f"Smaller than what is surely seen: {said}.")
    if verdict == FAULTY and faults and not large:
        verdict = HEALTHY
    ordered = tuple(sorted(faults, key=lambda fault: (not fault.matters, -fault.probability)))
    headline = {
        HEALTHY: "Healthy: nothing that matters differs from the healthy machine.",
        FAULTY: f"Faulty: {joined([fault.told for fault in large])}.",
        UNKNOWN: "Unknown: the record is unlike the healthy machine, and no fault of the table explains it.",
    }[verdict]
    return Answer(verdict, headline, ordered, tuple(remarks), network, physics)


def _others(faults: Sequence[FoundFault], seen: Sequence[FoundFault]) -> tuple[FoundFault, ...]:
    """The networks' faults that physics does not name."""
    names = {fault.name for fault in faults}
    return tuple(fault for fault in seen if fault.name not in names)


def _apart(measured: Sequence[FoundFault], seen: Sequence[FoundFault]) -> tuple[str, ...]:
    """Of faults that both name: where physics and networks contradict each other in station or size."""
    named = {fault.name: fault for fault in seen}
    pairs = [(one, named[one.name]) for one in measured if one.name in named]
    return tuple(
        f"Physics and networks differ: {one.told} by physics, {other.told} by the networks."
        for one, other in pairs
        if (None not in (one.station, other.station) and one.station != other.station)
        or one.high < other.low
        or other.high < one.low
    )


def _differences(faults: Sequence[FoundFault], seen: Sequence[FoundFault], physics: Physics) -> tuple[str, ...]:
    """`faults` are all that are told."""
    more = [fault for fault in _others(faults, seen) if fault.matters]
    left = physics.level > _MORE_THAN_NOISE
    remarks = []
    if more:
        said, found = (joined([fault.told for fault in some]) for some in (more, faults))
        judged = "leaves more than noise" if left else "explains the record without them"
        remarks.append(f"Networks: also {said}; physics: {found} {judged}.")
    alone = [fault.words for fault in faults if fault.by == "network" and fault.matters]
    if alone:
        judged = "leaves more than noise" if left else "explains the record without it"
        remarks.append(f"By the networks alone: {joined(alone)}; physics does not name it and {judged}.")
    if any(fault.by == "physics" and fault.matters for fault in faults):
        said = joined([fault.words for fault in faults if fault.by == "physics" and fault.matters])
        remarks.append(f"By physics alone: {said}; the networks do not name it.")
    if left:
        remarks.append(f"{physics.level:.1f} times the noise remains.")
    return tuple(remarks)
