"""What records say of the effects that a model lacks: a search, the grades of what it found, and what remains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from discrepancy.criteria import Criteria
from discrepancy.estimates import Calibration, Estimate, FoundEffect, estimates_of
from discrepancy.grades import DISMISSED, ESTABLISHED, FAMILY, NAMED, Evidence, graded
from discrepancy.held_out import held_places
from discrepancy.model import NONE, Model
from discrepancy.problem import Point, Problem
from discrepancy.search import Fitted, Search, Selection

VERDICTS = ("found", "nothing missing", "only a remainder")
"""found: an effect is established, or a family of them; nothing missing: the calibrated model is at the noise; only a
remainder: something is left to which no effect of the library gives a name."""

_QUARTILE = 0.25
"""Of the differences between repeats: what a missed start state or station adds to single ones must not count."""

_LEAST_PAIRS = 4
"""Repeats of the same station from which on only they count."""

_TEMPER = 3.0
"""Factor by which a score is taken for less than it says, as what a model gets wrong repeats."""


@dataclass(frozen=True)
class Finding:
    """One effect, or a family of them.

    Attributes
    ----------
    grade : str
        One of `grades.GRADES` but the last.
    effects : tuple of FoundEffect
        The effect with its size; of a family all members, the best first.
    probability : float
        That it, or one of the family, is missing.
    closes : float
        Share of the gap on records held out that it closes beside the others.
    why : str
        The sentence of its grade.
    rivals : tuple of (str, float)
        Effects that were fitted in its place, and by how much they score worse.
    """

    grade: str
    effects: tuple[FoundEffect, ...]
    probability: float
    closes: float
    why: str
    rivals: tuple[tuple[str, float], ...]

    @property
    def name(self) -> str:
        """Its effect's name; of a family the members'."""
        return " or ".join(effect.name for effect in self.effects)


@dataclass(frozen=True)
class Remains:
    """What is left beside all that was found.

    Attributes
    ----------
    level : float
        rms over the noise as stated or estimated, on records held out.
    noise : float
        rms of what does not repeat, over the same noise: where the two differ, the noise was taken for too small, or
        something acts that is not locked to the machine.
    looks_like : str
        The effect of the library that would lessen it most, though not enough; "" where none does.
    """

    level: float
    noise: float
    looks_like: str

    @property
    def joint(self) -> str:
        """Where that effect acts: "input", "output", "base" or "sensor"; "" where none looks like it. A sensor on the
        table cannot tell a torque on the table from one of the joint before it."""
        family = self.looks_like.partition(".")[0]
        return {"": "", "drive": "input", "input": "input", "base": "base", "sensor": "sensor"}.get(family, "output")

    @property
    def times_noise(self) -> float:
        """rms over what does not repeat."""
        return self.level / self.noise


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the records are explained by.

    Attributes
    ----------
    verdict : str
        One of VERDICTS.
    findings : tuple of Finding
        Established effects, families and what stands in, in that order.
    remains : Remains
    base, best : Fitted
        The model as it came, and the set with everything that was selected.
    accepted : Fitted
        The set of what is established, of a family its best member.
    held : mapping of str to Point
        Places on the records held out by the sets' names.
    before, after : float
        Level (rms over noise) on the records held out, of the model as it came and with what is accepted.
    calibration : Calibration
        The machine's parameters with what is accepted.
    held_back : str
        Why the calibrated machine is not written; "" where it is.
    selection : Selection
    criteria : Criteria
    model, held_out : Model
    """

    verdict: str
    findings: tuple[Finding, ...]
    remains: Remains
    base: Fitted
    best: Fitted
    accepted: Fitted
    held: dict[str, Point]
    before: float
    after: float
    calibration: Calibration
    held_back: str
    selection: Selection
    criteria: Criteria
    model: Model
    held_out: Model

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects that are accepted."""
        return self.accepted.place.hypothesis.names

    @property
    def closed_share(self) -> float:
        """Share of the gap on the records held out that what is accepted closes; NaN where there was none."""
        floor = self.remains.noise**2
        gap = self.before**2 - floor
        return (self.before**2 - self.after**2) / gap if gap > 0.0 else math.nan


def explain(model: Model, held_out: Model, criteria: Criteria | None = None) -> Explanation:
    """Find the effects that a model lacks, by its records and records held out (the same model, other conditions)."""
    # The normal equations are small: on a busy machine the threads of a matrix library wait for each other, 30 times as
    # long as one takes.
    with threadpool_limits(limits=1, user_api="blas"):
        return _explained(model, held_out, criteria or Criteria())


def _explained(model: Model, held_out: Model, criteria: Criteria) -> Explanation:
    search = Search(model, criteria)
    selection = search.run()
    best, base = (search.on_all(fitted) for fitted in (selection.best, selection.base))
    sets = [base, best, *selection.without]
    held = {f.name: place for f, place in zip(sets, held_places([f.place for f in sets], held_out), strict=True)}
    floor = _unrepeated([(model, best.place), (held_out, held[best.name])])
    numbers = estimates_of(model, best.place)
    judged = []
    for k, effect in enumerate(best.effects):
        found = numbers.effect(effect.name, tuple(effect.fixed.items()))
        evidence = _evidence(selection, k, found, held, floor, held_out, criteria)
        judged.append((k, found, evidence, *graded(evidence, criteria)))
    kept = [k for k, _, _, grade, _ in judged if grade in NAMED]
    accepted = best if len(kept) == len(best.effects) else search.on_all(search.only(selection.best, kept))
    if accepted.name not in held:
        held[accepted.name] = held_places([accepted.place], held_out, [held[best.name]])[0]
    findings = tuple(
        _finding(selection, k, found, evidence, grade, why)
        for k, found, evidence, grade, why in sorted(judged, key=lambda row: _order(row[3]))
        if grade != DISMISSED
    )
    remains = Remains(held[best.name].level(held_out), math.sqrt(floor), _looks_like(selection, findings))
    return Explanation(
        _verdict(findings, remains, criteria), findings, remains, base, best, accepted, held,
        held[base.name].level(held_out), held[accepted.name].level(held_out),
        estimates_of(model, accepted.place).calibration(len(model.parameters)),
        _held_back(accepted, held[accepted.name], held_out), selection, criteria, model, held_out,
    )  # fmt: skip


def _order(grade: str) -> int:
    return (ESTABLISHED, FAMILY).index(grade) if grade in NAMED else len(NAMED)


def _verdict(findings: Sequence[Finding], remains: Remains, criteria: Criteria) -> str:
    if any(finding.grade in NAMED for finding in findings):
        return "found"
    nothing = not findings and remains.level**2 - 1.0 < criteria.at_noise
    return "nothing missing" if nothing else "only a remainder"


def _looks_like(selection: Selection, findings: Sequence[Finding]) -> str:
    """The leading effect that was not enough: what stands in, else what the last round would have added."""
    hints = [finding.name for finding in findings if finding.grade not in NAMED]
    if hints:
        return hints[0]
    return selection.tried[0].effects[-1].name if selection.tried else ""


def _unrepeated(places: Sequence[tuple[Model, Point]]) -> float:
    """Mean square, at least 1, of what differs between windows that see the same, in units of the noise's: half the
    lower quartile of the differences' mean squares."""
    same: list[float] = []
    next_to: list[float] = []
    for model, place in places:
        residual = Problem(model, place.hypothesis).residuals(place.z[None], place.states[None])[0]
        for pairs, found in zip(model.repeats(), (same, next_to), strict=True):
            for a, b in pairs:
                n = int(min(model.counts[a], model.counts[b]))
                found.append(0.5 * float(((residual[a, :n] - residual[b, :n]) ** 2).mean()))
    differences = same if len(same) >= _LEAST_PAIRS else same + next_to
    return max(1.0, float(np.quantile(differences, _QUARTILE))) if differences else 1.0


def _evidence(
    selection: Selection, k: int, found: FoundEffect, held: dict[str, Point], floor: float, held_out: Model,
    criteria: Criteria,
) -> Evidence:  # fmt: skip
    place, other = held[selection.best.name], held[selection.without[k].name]
    left, open_ = _excess(place, other, held_out, floor)
    better = place.squares < other.squares
    groups = held_out.groups
    size = found.parameters[0]
    return Evidence(
        name=found.name,
        closes=(open_ - left) / max(open_, 1e-9) if open_ > left else 0.0,
        remains=math.sqrt(1.0 + left / floor),
        better=min(float(better[groups == g].mean()) for g in np.unique(groups)),
        size=_words(size),
        zero=size.low <= size.nominal <= size.high,
        bound=found.bound,
        alike=tuple(
            one.place.hypothesis.names[-1]
            for one in selection.instead[k]
            if selection.gap(one) < criteria.margin
        ),
    )  # fmt: skip


def _excess(place: Point, other: Point, model: Model, floor: float) -> tuple[float, float]:
    """Mean squares above the floor that two places leave, without the window that the first one leaves worst: a start
    state that was missed spoils one window."""
    level = place.squares / model.counts
    kept = np.arange(len(level)) != int(level.argmax()) if len(level) > _LEAST_PAIRS else np.full(len(level), True)
    samples = float(model.counts[kept].sum())
    left, open_ = (float(p.squares[kept].sum()) / samples - floor for p in (place, other))
    return max(left, 0.0), max(open_, 0.0)


def _words(e: Estimate) -> str:
    unit = "" if e.unit == "-" else f" {e.unit}"
    return f"{e.name} {e.value:.3g}{unit}, {e.low:.3g} to {e.high:.3g}"


def _finding(selection: Selection, k: int, found: FoundEffect, evidence: Evidence, grade: str, why: str) -> Finding:
    """The finding; its probability is the share of the sets compared that hold it, by their scores."""
    gaps = {one: selection.gap(one) for one in (*selection.instead[k], selection.without[k])}
    weights = {one: math.exp(-0.5 * max(gap, 0.0) / _TEMPER) for one, gap in gaps.items()}
    members = [one for one in selection.instead[k] if grade == FAMILY and _last(one) in evidence.alike]
    total = 1.0 + sum(weights.values())
    among = (1.0 + sum(weights[one] for one in members)) / total
    others = []
    for one in members:
        numbers = estimates_of(selection.model, one.place)
        effect = next(h for h in one.effects if h.name == _last(one))
        others.append(numbers.effect(effect.name, tuple(effect.fixed.items())))
    rivals = tuple((_last(one), gaps[one]) for one in selection.instead[k])
    return Finding(grade, (found, *others), among * evidence.closes, evidence.closes, why, rivals)


def _last(fitted: Fitted) -> str:
    return fitted.place.hypothesis.names[-1]


def _held_back(accepted: Fitted, held: Point, held_out: Model) -> str:
    """Why the nominal machine is better for a record held out than the accepted one; "" where it is not."""
    problem = Problem(held_out, NONE, frozen=True)
    zeros = np.zeros(len(problem.parameters))
    states = held_out.states_for(NONE, held.states)
    nominal = problem.searched(problem.point(zeros, states))
    for g in np.unique(held_out.groups):
        mine = held_out.groups == g
        if held.squares[mine].sum() > nominal.squares[mine].sum():
            return f"it predicts record {int(g) + 1} of those held out worse than the nominal machine does"
    return ""
