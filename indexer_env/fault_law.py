"""How faults come into an episode: fixed, drawn by a law, setting in at a time, or growing with the work done."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env.build import from_mapping
from indexer_env.checks import check_number
from indexer_env.errors import ParameterError, refuse
from indexer_env.faults import MOST_BACKLASH, NO_CRACK, NO_CRACK_REMEDY, Faults, fault_keys, fault_laws
from indexer_env.laws import Fixed, Law, Sobol

TIGHT_LOOSENESS = 0.01
"""Looseness [-] of screws that are going to let go, until they do. A machine's model cannot change while it runs: one
whose screws will let go runs on its base from the start, and a hundredth of full looseness puts the housing at 120 Hz,
the stiffest base that a step of 0.25 ms resolves."""

_PART_OF = {"cracked_station": "roller_crack", "loose_at": "screw_looseness"}
"""What makes no fault without another attribute."""

_NEEDS = {
    "cracked_station": ("roller_crack", NO_CRACK, NO_CRACK_REMEDY),
    "crack_at": ("roller_crack", NO_CRACK, NO_CRACK_REMEDY),
    "loose_at": (
        "screw_looseness",
        "left out where no screws are loose",
        "add faults.screws=loose, or faults.screw_looseness=0.5",
    ),
}
"""What is refused where another attribute is always 0: that attribute, the rule and the remedy."""


@dataclass(frozen=True)
class Course:
    """The faults of one episode and how they come about.

    Attributes
    ----------
    faults : Faults
        As they are once all have set in, without wear.
    crack_at, loose_at : float
        Time in the episode [s] at which the roller cracks and the screws let go, >= 0; 0: they have before it begins.
    backlash_per_joule : float
        Backlash that a joule transmitted by the input joint adds [rad at the motor shaft per J], >= 0.
    """

    faults: Faults = Faults()
    crack_at: float = 0.0
    loose_at: float = 0.0
    backlash_per_joule: float = 0.0

    def __post_init__(self) -> None:
        check_number("Course", "crack_at", self.crack_at, low=0.0, unit="s")
        check_number("Course", "loose_at", self.loose_at, low=0.0, unit="s")
        check_number("Course", "backlash_per_joule", self.backlash_per_joule, low=0.0, unit="rad/J")

    @property
    def changes(self) -> bool:
        """Whether the faults are not the same throughout."""
        cracks = self.crack_at > 0.0 and self.faults.roller_crack > 0.0
        return cracks or self.backlash_per_joule > 0.0 or (self.loose_at > 0.0 and self.faults.screw_looseness > 0.0)

    def at(self, time: float, work: float, most: float = MOST_BACKLASH) -> Faults:
        """The faults at a time [s], when so much work [J] has been transmitted; wear ends at `most` backlash [rad at
        the motor shaft]."""
        full = self.faults
        if not self.changes:
            return full
        return dataclasses.replace(
            full,
            roller_crack=full.roller_crack if time >= self.crack_at else 0.0,
            screw_looseness=full.screw_looseness
            if time >= self.loose_at
            else min(full.screw_looseness, TIGHT_LOOSENESS),
            backlash=max(full.backlash, min(full.backlash + self.backlash_per_joule * work, most)),
        )

    @property
    def worst(self) -> Faults:
        """Every fault that the course can reach, for what must be ready from the start."""
        return self.worst_of(MOST_BACKLASH)

    def worst_of(self, most: float) -> Faults:
        """The same of a machine whose wear ends at `most` backlash."""
        return self.at(math.inf, math.inf if self.backlash_per_joule > 0.0 else 0.0, most)


@dataclass(frozen=True)
class FaultLaw:
    """The law by which each episode draws its `Course`; drawn in the order of the attributes.

    Attributes
    ----------
    roller_crack, cracked_station, screw_looseness, backlash
        As in `Faults`.
    crack_at, loose_at, backlash_per_joule
        As in `Course`.
    """

    roller_crack: Law = Fixed(0.0)
    cracked_station: Law = Fixed(None)
    screw_looseness: Law = Fixed(0.0)
    backlash: Law = Fixed(0.0)
    crack_at: Law = Fixed(0.0)
    loose_at: Law = Fixed(0.0)
    backlash_per_joule: Law = Fixed(0.0)

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            law = getattr(self, field.name)
            if not isinstance(law, Law) or isinstance(law, Sobol) or law.needs_nominal:
                rule = "a law that needs no data set and no nominal value (no sobol, no {around: share})"
                raise refuse("FaultLaw", field.name, rule, law)
            if field.name == "cracked_station" and not law.lists:
                raise refuse("FaultLaw", field.name, "a station or a choice of stations", law)
            for value in law.extremes:
                self._with(field.name, value)
            whole, rule, remedy = _NEEDS.get(field.name, ("", "", ""))
            if whole and law != field.default and max(getattr(self, whole).extremes) == 0.0:
                raise refuse("FaultLaw", field.name, rule, law, remedy)

    def draw(self, rng: np.random.Generator) -> Course:
        """The course of one episode."""
        return self._same or _course(
            {field.name: getattr(self, field.name).draw(rng) for field in dataclasses.fields(self)}
        )

    @functools.cached_property
    def _same(self) -> Course | None:
        """The course of every episode, where nothing of it is drawn."""
        laws = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        if not all(isinstance(law, Fixed) for law in laws.values()):
            return None
        return _course({name: law.centre for name, law in laws.items()})

    def extremes(self) -> Iterator[tuple[str, float, Course]]:
        """Each fault alone at the ends of its law, as its name, its value and its course; what is no fault is left out.
        A cracked station comes with the worst crack, the time at which screws let go with the loosest screws."""
        for field in dataclasses.fields(self):
            for value in getattr(self, field.name).extremes:
                values = {field.name: value}
                if field.name in _PART_OF:
                    whole = _PART_OF[field.name]
                    values[whole] = max(getattr(self, whole).extremes)
                course = _course(values)
                if course.worst != Faults():
                    yield field.name, value, course

    def _with(self, name: str, value: Any) -> None:
        """Raise what `Faults` or `Course` has against a value, in the law's name."""
        try:
            _course({name: value})
        except ParameterError as error:
            if error.out_of_range is not None:
                raise error.out_of_range.given_as("FaultLaw", name).error() from None
            raise ParameterError(f"FaultLaw.{str(error).partition('.')[2]}") from None


def _course(values: Mapping[str, Any]) -> Course:
    own = {field.name for field in dataclasses.fields(Course)}
    faults = Faults(**{name: value for name, value in values.items() if name not in own})
    return Course(faults, **{name: value for name, value in values.items() if name in own})


def fault_law(given: object) -> FaultLaw:
    """The law from what a user gives.

    A `FaultLaw`; a `Course` or `Faults`, which are then the same in every episode; None, no faults; or a mapping (YAML)
    of attributes of `FaultLaw` to a value or a law (`indexer_env.laws`). A key that ends in ``_deg`` (``backlash_deg``,
    ``backlash_per_joule_deg``) is in degrees; ``roller: cracked`` and ``screws: loose`` name a severity
    (`faults.STATES`).

    Raises
    ------
    ParameterError
        An unknown fault or law, or a value out of a fault's range.
    """
    if isinstance(given, FaultLaw):
        return given
    if given is None:
        return FaultLaw()
    if isinstance(given, Faults):
        given = Course(given)
    if isinstance(given, Course):
        fields = {
            **_values(given.faults),
            **{key: getattr(given, key) for key in ("crack_at", "loose_at", "backlash_per_joule")},
        }
        return FaultLaw(**{name: Fixed(value) for name, value in fields.items()})
    if not isinstance(given, Mapping):
        raise ParameterError(f"faults must be a mapping of faults to their values or laws, got {given!r}.")
    fields = tuple(field.name for field in dataclasses.fields(FaultLaw))
    mapping = {str(key): value for key, value in given.items()}
    return from_mapping(FaultLaw, fault_laws(mapping, fields), "faults", fault_keys(mapping, fields))


def _values(faults: Faults) -> dict[str, Any]:
    return {field.name: getattr(faults, field.name) for field in dataclasses.fields(faults)}
