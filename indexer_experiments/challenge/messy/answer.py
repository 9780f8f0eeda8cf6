"""What an answer to a messy case consists of, whatever method gave it: all that the score reads."""

from __future__ import annotations

import math
from dataclasses import dataclass

from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor

GRADES = ("established", "family", "stands in")
"""established: one name; family: several that no record here can tell apart; stands in: a hint, not a name."""

NAMED = ("established", "family")
"""Grades that say what is missing."""

NO_ANSWER = ("turned away", "out of time", "failed")
"""Verdicts where a method gave no answer: records refused before any fit, its time spent, an error."""


@dataclass(frozen=True)
class Interval:
    """A number's 95 % interval; `name` is `effect.parameter`, or a machine's parameter."""

    name: str
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise refuse("Interval", "low", "at most high", (self.low, self.high))


@dataclass(frozen=True)
class Finding:
    """One finding.

    Attributes
    ----------
    grade : str
        Of GRADES.
    members : tuple of str
        Names of effects: one, or those of a family.
    place : str
        Where, in the method's words; "" where it says nothing.
    probability : float
        That one of the members is there, in [0, 1].
    intervals : tuple of Interval
        Of the members' parameters.
    """

    grade: str
    members: tuple[str, ...]
    place: str
    probability: float
    intervals: tuple[Interval, ...]

    def __post_init__(self) -> None:
        check_choice("Finding", "grade", self.grade, GRADES)
        if not self.members:
            raise refuse("Finding", "members", "one name or more", self.members)
        check_number("Finding", "probability", self.probability, low=0.0, high=1.0)


@dataclass(frozen=True)
class Remains:
    """Where what is left lies: `joint` of `disturbances.JOINTS` and `kind` of `disturbances.KINDS`, "" where the method
    does not say."""

    joint: str
    kind: str


@dataclass(frozen=True)
class CaseAnswer:
    """An answer.

    Attributes
    ----------
    verdict : str
        In the method's words, or of NO_ANSWER.
    reason : str
    findings : tuple of Finding
    remains : Remains or None
        None where the method says that nothing is left.
    machine : tuple of Interval
        Of the machine's own parameters.
    gap_before, gap_after : float
        On a record that no method gets, over the noise: what the nominal machine leaves, and machine.yaml; NaN where
        there is none.
    gaps_held_out : tuple of (float, float)
        The same on each record that is held out.
    cpu_s : float
        Processor time [s].
    """

    verdict: str
    reason: str
    findings: tuple[Finding, ...] = ()
    remains: Remains | None = None
    machine: tuple[Interval, ...] = ()
    gap_before: float = math.nan
    gap_after: float = math.nan
    gaps_held_out: tuple[tuple[float, float], ...] = ()
    cpu_s: float = math.nan

    @property
    def answered(self) -> bool:
        """Whether the method gave an answer."""
        return self.verdict not in NO_ANSWER


@dataclass(frozen=True, eq=False)
class Solved:
    """An answer with the machine.yaml and sensor.yaml that go with it; None where there are none."""

    answer: CaseAnswer
    machine: Machine | None = None
    sensor: Sensor | None = None
