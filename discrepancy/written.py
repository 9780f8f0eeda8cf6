"""The machine that an explanation leaves behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.criteria import Criteria
from discrepancy.estimates import Estimates, FoundEffect
from discrepancy.fit import fit
from discrepancy.held_out import counted, held_places
from discrepancy.model import NONE, Hypothesis, Model, Parameter
from discrepancy.place import Point
from discrepancy.problem import Problem

_STEPS = 12
"""Steps of the fit after parameters at a bound went back to nominal."""


@dataclass(frozen=True, eq=False)
class Written:
    """The machine that is left behind.

    Attributes
    ----------
    place : Point
        On the records fitted.
    held_back : str
        Why it is the nominal machine, with the effects that are named or without, and not the calibrated one; "" where
        it is not.
    remarks : tuple of str
        What must be said of it.
    """

    place: Point
    held_back: str
    remarks: tuple[str, ...]


def written(
    model: Model, told: Estimates, held_out: Model, held: Point, floor: float, criteria: Criteria,
    named: Sequence[FoundEffect] = (),
) -> Written:  # fmt: skip
    """The machine as it is told, with parameters at a bound at nominal and the others fitted again. What is missing has
    bent the parameters towards it where much remains of a record held out, or where the named effects alone leave less
    of one and no more of the others: then the nominal machine with these effects as they were found, or without them
    where they do not serve there. Start states on the records held out begin at the place `held`; `floor` is the mean
    square there that does not repeat. The effects `named` may have been judged beside others, with other sizes."""
    calibrated, at_nominal = _within_bounds(model, told)
    problem = Problem(model, NONE)
    nominal = problem.point(np.zeros(len(problem.parameters)), model.states_for(NONE, calibrated.states))
    there, without = held_places([calibrated, nominal], held_out, [held])
    effects, share, bare = calibrated.hypothesis.effects, 1.0 - criteria.written, None
    rows = _left(there, without, held_out, floor, share)
    why = _against(rows, effects, criteria)
    if effects and (why or any(left >= criteria.at_noise for _, left, _ in rows)):
        place = _at_nominal(model, told.believed)
        (alone,) = held_places([place], held_out, [there, without])
        if _serves(_left(alone, without, held_out, floor, share), criteria):
            bare, why = place, why or _beaten(_left(there, alone, held_out, floor, 1.0), criteria)
    if not why:
        remarks = tuple(
            f"{name} is nominal: the fit holds it at the bound of what is believable, so its number says nothing."
            for name in at_nominal
        )
        return Written(calibrated, "", (*remarks, *_told_otherwise(named, told, calibrated)))
    if bare is not None:
        which = "This is the machine as it was given, with what is named"
        remarks = (f"{which}. The calibrated one is held back: {why}.", *_told_otherwise(named, told, bare))
        return Written(bare, why, remarks)
    return Written(nominal, why, (f"This is the machine as it was given. The calibrated one is held back: {why}.",))


def _at_nominal(model: Model, place: Point) -> Point:
    """A place's effects as they are, on the nominal machine."""
    problem, z = Problem(model, place.hypothesis), place.z.copy()
    z[: len(model.parameters)] = 0.0
    return problem.searched(problem.point(z, place.states))


_Left = list[tuple[str, float, float]]
"""A record, and the mean squares above what does not repeat, over it, that a machine and another one leave of it."""


def _left(place: Point, other: Point, held_out: Model, floor: float, share: float) -> _Left:
    """What a machine and another one leave of each record held out, in the windows that are `counted`."""
    place = Problem(held_out, place.hypothesis, frozen=True).pooled(place, [other])
    kept = counted(place, other, held_out, share)
    places = place, other
    samples = [held_out.told(one.hypothesis, one.z) for one in places]
    found = []
    for g in np.unique(held_out.groups[kept]).tolist():
        mine = kept & (held_out.groups == g)
        left, open_ = (
            float(one.squares[mine].sum()) / max(float(told_by[mine].sum()), 1.0) / floor - 1.0
            for one, told_by in zip(places, samples, strict=True)
        )
        found.append((held_out.record(g), left, open_))
    return found


def _serves(rows: _Left, criteria: Criteria) -> bool:
    """Whether what is named closes more of a record held out than its law may leave, and makes none worse. A record
    that is at the noise either way does not show it."""
    helps = any(left <= (1.0 - criteria.law) * open_ for _, left, open_ in rows if open_ >= criteria.at_noise)
    return helps and not any(left > max(open_, criteria.at_noise) for _, left, open_ in rows)


def _told_otherwise(named: Sequence[FoundEffect], told: Estimates, place: Point) -> list[str]:
    """What must be said of effects whose sizes were found beside a hint that is not in the set of the place, or beside
    a parameter at its bound that is nominal there."""
    here = {p.name: f"{v:.4g}" for p, v in zip(place.hypothesis.parameters, place.values, strict=True)}
    found = []
    for one in named:
        size, alone = one.parameters[0], told.effect(one.name).parameters[0]
        beside = "a hint that takes up a part of it" if alone.value != size.value else "a parameter held at its bound"
        if (value := here[f"{one.name}.{size.name}"]) != f"{size.value:.4g}":
            found.append(
                f"The {size.name} of {one.name} is {value} here, where only what is named stands; it was found as "
                f"{size.value:.4g} beside {beside}."
            )
    return found


def _within_bounds(model: Model, told: Estimates) -> tuple[Point, list[str]]:
    """The place that is told with those parameters of the machine at nominal that a bound holds there, or where the
    others are fitted again, and their names."""
    place, hit = told.believed, list[int]()
    while more := [k for k, p in enumerate(model.parameters) if k not in hit and _held(p, place.z[k])]:
        hit += more
        problem = Problem(model, place.hypothesis, held=hit, dispersion=told.dispersion)
        z = place.z.copy()
        z[hit] = 0.0
        place = fit(problem, problem.searched(problem.point(z, place.states)), steps=_STEPS).place
    return place, [model.parameters[k].name for k in hit]


def _held(parameter: Parameter, z: float) -> bool:
    return not parameter.of_record and parameter.held(z)


def _against(rows: _Left, effects: Sequence[Hypothesis], criteria: Criteria) -> str:
    """What speaks against a calibrated machine; "" where nothing does. What is missing has bent the parameters towards
    it, and at another speed or load they may predict worse than the nominal ones. Where an effect is named, a record
    that is left at the noise does not show it, and says nothing of which is better."""
    for record, left, open_ in rows:
        if left > open_ and (left >= criteria.at_noise or not effects):
            return f"it predicts {record}, which was held out, worse than the one that was given"
        if left > max(criteria.at_noise, (1.0 - criteria.written) * open_):
            return (
                f"it closes {100.0 * (1.0 - left / open_):.0f} % of the gap that the one that was given leaves of "
                f"{record}, which was held out, where {100.0 * criteria.written:.0f} % are needed"
            )
    return ""


def _beaten(rows: _Left, criteria: Criteria) -> str:
    """What speaks for the nominal machine with what is named, given what the calibrated one and that one leave: it
    leaves less of a record and of none more, by `at_noise`."""
    better = [record for record, left, other in rows if left - max(other, 0.0) >= criteria.at_noise]
    if not better or any(other - max(left, 0.0) >= criteria.at_noise for _, left, other in rows):
        return ""
    return f"it predicts {better[0]}, which was held out, worse than the one that was given does with what is named"
