"""How large physics measures a fault that networks think possible and its own search does not find.

A search names what closes a good share of the gap. Whether a small fault beside a large one is there is another
question: it is fitted beside those found from the size that the networks give, and has a size with its interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy import Explanation
from discrepancy.estimates import estimates_of
from discrepancy.fits import Fits
from discrepancy.model import Hypothesis, together
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.machine import Machine
from twin.calibrate import SD_OF_95
from twin.diagnosis import FaultSeen
from twin.faults import Fault


@dataclass(frozen=True)
class Measured:
    """A fault as physics measures it beside what it found.

    Attributes
    ----------
    fault : str
    size, low, high : float
        As share of the fault's largest size, with its 95 % interval.
    """

    fault: str
    size: float
    low: float
    high: float

    @property
    def evidence(self) -> float:
        """ln of the Bayes factor √(2π) σ exp(t²/2σ²) of a size t ± σ, any from nothing to the largest being as likely
        before, over nothing (Savage and Dickey's ratio of densities); of one that is held at nothing −∞."""
        spread = (self.high - self.low) / SD_OF_95
        if spread <= 0.0:
            return -math.inf
        return math.log(math.sqrt(2.0 * math.pi) * spread) + 0.5 * (self.size / spread) ** 2


def measured(
    answer: Explanation, suspected: Sequence[FaultSeen], faults: Mapping[str, Fault], machine: Machine
) -> tuple[Measured, ...]:  # fmt: skip
    """Faults measured from the sizes at which the networks see them; none of an effect that the machine has already,
    whose growth was measured. `faults` is the table by name."""
    if not suspected:
        return ()
    fits = Fits(answer.model, answer.selection.model)
    looks = (_measured(answer, fits, faults[one.name], one, machine) for one in suspected)
    return tuple(look for look in looks if look is not None)


def _measured(answer: Explanation, fits: Fits, fault: Fault, seen: FaultSeen, machine: Machine) -> Measured | None:
    best = answer.selection.best
    if fault.effect in best.place.hypothesis.names:
        fitted = fits.fit(best.place)
    else:
        library, at = fits.model.hypotheses().get(fault.effect, ()), seen.station
        hypotheses = [h for h in library if at is None or h.fixed.get("station", at) == at]
        if not hypotheses:
            return None
        value = fault.value(seen.share, machine)
        fitted = fits.fit(min((_begun(fits, best.place, h, fault, value) for h in hypotheses), key=lambda p: p.cost))
    whole = fits.on_all(fitted)
    effect = estimates_of(answer.model, whole.place).effect(fault.effect, ())
    size = next(one for one in effect.parameters if one.name == fault.parameter)
    if size.low == size.high:
        return Measured(fault.name, 0.0, 0.0, 0.0)  # held where there is none
    shares = [fault.share(number, machine) for number in (size.value, size.low, size.high)]
    return Measured(fault.name, shares[0], min(shares[1:]), max(shares[1:]))


def _begun(fits: Fits, place: Point, hypothesis: Hypothesis, fault: Fault, value: float) -> Point:
    """The best place of a fault of this size beside what was found, from any start of its other numbers."""
    both = together(place.hypothesis, hypothesis)
    problem, states = Problem(fits.model, both), fits.model.states_for(both, place.states)
    of_size = [p.name == f"{fault.effect}.{fault.parameter}" for p in hypothesis.parameters]
    starts = {tuple(np.where(of_size, value, start).tolist()) for start in hypothesis.starts}
    z = np.array([np.concatenate([place.z, hypothesis.coordinates(start)]) for start in sorted(starts)])
    begun = problem.points(z, np.repeat(states[None], len(z), axis=0))
    return problem.searched(min(begun, key=lambda point: point.cost))
