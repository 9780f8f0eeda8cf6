"""Drawing and healthy records -> the calibrated and extended machine, by `discrepancy`, and draws of what is open."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy import Criteria, Explanation, explain
from discrepancy import Finding as Found
from discrepancy.grades import ESTABLISHED, STANDS_IN
from discrepancy.indexer import IndexerModel
from discrepancy.indexer.parameters import UNCERTAINTY
from discrepancy.model import Hypothesis
from discrepancy.selection import Fitted
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env.effects import EFFECTS
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_env.units import behind_number
from twin.posterior import Uncertain, columns_of, joint_of, logs_of, rescaled, whole

CRITERIA = Criteria(closes=0.75)
"""Neither tables nor other causes are asked here, which keep the name from what imitates an effect and closes less."""

_CLOSES = 0.5
"""Share of the gap on held-out records that an effect without a name must close to stand in."""

SD_OF_95 = 2.0 * 1.96
"""Standard deviations in a 95 % interval."""

_LEAST_SPREAD = 2e-3
"""Least relative standard deviation of a parameter as a prior [-]: what a machine changes by from day to day."""


@dataclass(frozen=True)
class Finding:
    """An effect that was found.

    Attributes
    ----------
    effect : str
    grade : str
        Of `discrepancy.grades`; what stands in is added as well, as a twin must predict, but is not told as a name.
    values : mapping
        Value of each of its parameters [SI], the discrete ones too.
    interval : (float, float)
        95 % interval of its size parameter [SI].
    size : str
        Name of the size parameter.
    rivals : tuple of str
        The other members of its family.
    """

    effect: str
    grade: str
    values: Mapping[str, float]
    interval: tuple[float, float]
    size: str
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The machine as its healthy records tell it.

    Attributes
    ----------
    machine, sensor : Machine, Sensor
        At the mean of the posterior, with what was found.
    load_factor : float
        Loads over loads as they are stated [-], at that mean.
    paths : tuple of str
        Quantities of the joint draws, by path as `datagen.quantities` has them.
    units : tuple of str
    draws : ndarray (n, k)
        Joint draws [SI].
    findings : tuple of Finding
    verdict, headline : str
        Of the search for what the drawing lacks.
    level : float
        rms of the residual of held-out records over the noise.
    noise_share : float
        Noise that the calibrated machine shows over that which the records alone seem to show; 1 where it was left.
    scale_spread : float
        Relative standard deviation of the common scale [-].
    spread : mapping
        Relative standard deviation of each of the machine's parameters beside the common scale [-].
    notes : tuple of str
        What was put right or assumed of the records.
    """

    machine: Machine
    sensor: Sensor
    load_factor: float
    paths: tuple[str, ...]
    units: tuple[str, ...]
    draws: np.ndarray
    findings: tuple[Finding, ...]
    verdict: str
    headline: str
    level: float
    noise_share: float
    scale_spread: float
    spread: Mapping[str, float]
    notes: tuple[str, ...]


def calibrated(
    subject: IndexerSubject, uncertain: Uncertain, count: int, seed: int, *, extend: bool = True
) -> Calibrated:
    """Calibrate and extend the machine of a subject, and draw `count` machines from what its records leave open."""
    answer = explain(subject.model, subject.held_out, CRITERIA)
    base, model = accepted(answer) if extend else answer.base, answer.model
    assert isinstance(model, IndexerModel)
    joint = joint_of(model, base.place, uncertain)
    rng = np.random.default_rng(seed)
    z = rng.multivariate_normal(joint.mean, joint.covariance, size=count, method="eigh")
    columns = columns_of(model, base.place.hypothesis, joint, z, uncertain, subject.machine, rng)
    place = dataclasses.replace(base.place, z=whole(base.place.z, joint))
    machine, sensor = model.machine_at(place.hypothesis, place.z)
    sensor = dataclasses.replace(sensor, gain=sensor.gain * joint.gain)
    paths, units, values = zip(*columns, strict=True)
    if uncertain.scale > 0.0:
        values = rescaled(paths, units, values, np.exp(uncertain.scale * rng.standard_normal(count)))
    drawn = dict(zip(paths, values, strict=True))
    had = (Finding(one.name, ESTABLISHED, dict(one.fixed), (0.0, 0.0), _size_of(one), ()) for one in model.known)
    findings = tuple(_in_draws(finding, drawn) for finding in (*had, *map(finding_of, told(answer, base))))
    logs = logs_of(model, z)
    scale = np.mean([own for name, own in logs.items()], axis=0)
    spread = {name: max(float(np.std(own - scale)), _LEAST_SPREAD) for name, own in logs.items()}
    for path, column in zip(paths, values, strict=True):
        name = path.removeprefix("machine.")
        if name in UNCERTAINTY and name not in spread:
            spread[name] = max(float(np.std(column) / np.mean(column)), _LEAST_SPREAD)
    headline = _headline(answer, findings[len(model.known) :], findings[: len(model.known)])
    return Calibrated(
        machine, sensor, joint.load, paths, units, np.column_stack(values), findings, answer.verdict, headline,
        answer.held[base.name].level(answer.held_out), answer.noise_share,
        math.hypot(float(np.std(scale)), uncertain.scale), spread, tuple(subject.notes),
    )  # fmt: skip


def accepted(answer: Explanation) -> Fitted:
    """The set of effects that a twin is extended by: what has a name, else what closes most of the gap without one."""
    if answer.names:
        return answer.accepted
    closes = max((found.closes for found in answer.findings), default=0.0)
    return answer.best if closes > _CLOSES else answer.base


def told(answer: Explanation, fitted: Fitted) -> tuple[Found, ...]:
    """The findings about the effects of a set."""
    return tuple(found for found in answer.findings if found.effects[0].name in fitted.place.hypothesis.names)


def finding_of(found: Found) -> Finding:
    effect, *others = found.effects
    values = {e.name: e.value for e in effect.parameters} | {k: float(v) for k, v in effect.choices}
    size = effect.parameters[0]
    rivals = tuple(other.name for other in others)
    return Finding(effect.name, found.grade, values, (size.low, size.high), size.name, rivals)


def _size_of(effect: Hypothesis) -> str:
    return effect.parameters[0].name.removeprefix(f"{effect.name}.")


def left(answer: Explanation) -> str:
    """Why nothing more is said, in words."""
    why = " ".join(found.why for found in answer.findings)
    return why or f"{answer.remains.times_noise:.1f} times the noise is left, and no effect of the library lessens it."


def _in_draws(finding: Finding, drawn: Mapping[str, np.ndarray]) -> Finding:
    """The finding with values and interval of the joint draws, in which the common scale, the loads and the gain take
    part; where these leave it open whether there is anything at all, it has no name."""
    own = f"effects.{finding.effect}."
    values = {path.removeprefix(own): float(np.mean(column)) for path, column in drawn.items() if path.startswith(own)}
    low, high = np.quantile(drawn[own + finding.size], (0.025, 0.975))
    grade = STANDS_IN if low <= 0.0 <= high else finding.grade
    return dataclasses.replace(
        finding, grade=grade, values={**finding.values, **values}, interval=(float(low), float(high))
    )


def _headline(answer: Explanation, findings: Sequence[Finding], had: Sequence[Finding]) -> str:
    """What the drawing lacks, and what of it was known before."""
    known = f" Known before and fitted anew: {' and '.join(map(_sized, had))}." if had else ""
    if findings:
        return f"The drawing lacks {' and '.join(f'{_sized(f)[:-1]}; {f.grade})' for f in findings)}.{known}"
    if answer.verdict == "nothing missing":
        return f"The drawing, calibrated, explains the healthy records down to the noise.{known}"
    return f"Something remains that no effect of the library explains: {left(answer)}{known}"


def _sized(finding: Finding) -> str:
    """ "friction.coulomb (5.1 N m, 4.6 to 5.5)"."""
    low, high = finding.interval
    name = " or ".join((finding.effect, *finding.rivals))
    return f"{name} ({finding.values[finding.size]:.3g}{_unit(finding)}, {low:.3g} to {high:.3g})"


def _unit(finding: Finding) -> str:
    fields = {field.name: field.metadata for field in dataclasses.fields(EFFECTS[finding.effect])}
    return behind_number(fields[finding.size]["unit"])
