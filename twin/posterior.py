"""What healthy records leave open: the joint law of machine, effects, loads and gain at a fitted place.

The normal law at that place (Laplace), start states eliminated (Schur complement), with the stated loads' common error
and the gain of the sensor as nuisance parameters beside the machine's:

    z ~ N(ẑ, S^-1/2 max(S^-1/2 M S^-1/2, s²) S^-1/2)

S is the information with the priors, M the covariance of the windows' pulls (White's sandwich, windows as clusters), s²
the median mean square of the windows; the maximum is taken of eigenvalues. The common scale of all inertias,
stiffnesses, dampings and torques is told by the load alone, so it stays as wide as load and drawing leave it. The error
of the stated loads is one factor for all records, as one instrument or one estimate states them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from datagen.campaigns.own import LOAD_FACTOR
from discrepancy.arrow import arrow
from discrepancy.indexer import IndexerModel
from discrepancy.indexer.library import HOUSING
from discrepancy.indexer.parameters import UNCERTAINTY, torque_power
from discrepancy.indexer.together import GAIN
from discrepancy.indexer.windows import Experiment
from discrepancy.model import Hypothesis
from discrepancy.place import Point
from discrepancy.problem import Problem
from indexer_env.effects.sensor import SensorBracketResonance, SensorGain
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from twin.turns import PASSING

_STEP = 1e-4
"""Change of a scaled parameter, to both sides, by which derivatives are taken: the error of one-sided or larger
differences, squared, looks like information."""

_NUDGE = 1e-2
"""Relative change of the load, to both sides, by which its derivative is taken: the motion is nearly linear in it."""


@dataclass(frozen=True)
class Uncertain:
    """What the records' metadata leave open, as relative standard deviations [-]: load, gain, housing inertia; and the
    common scale, where the parameters' own uncertainties leave it out."""

    load: float
    gain: float
    housing_inertia: float
    scale: float = 0.0


@dataclass(frozen=True, eq=False)
class Joint:
    """Mean and covariance of the scaled parameters in `rows` of the place, then of the loads' and the gain's error, and
    the factors that loads and gain came to."""

    rows: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    load: float
    gain: float


def joint_of(model: IndexerModel, place: Point, uncertain: Uncertain) -> Joint:
    """The posterior at a fitted place; one Gauss–Newton step moves it where the loads or the gain are off."""
    problem = Problem(model, place.hypothesis)
    r, ahead, by_local = problem.linearised(place, _STEP)
    by_global = 0.5 * (ahead + problem.linearised(place, -_STEP)[1])
    heavier, lighter = (
        Problem(_with_loads(model, 1.0 + nudge), place.hypothesis).left(place) for nudge in (_NUDGE, -_NUDGE)
    )
    by_load = (heavier - lighter) / (2.0 * _NUDGE) * uncertain.load
    reading = model.readings(place.hypothesis, problem._everywhere(place.z[None], place.states[None])).reshape(r.shape)
    columns = np.concatenate([by_global, by_load[None], reading[None] * uncertain.gain])
    weights = np.minimum(1.0, 2.0 * problem.weights((r**2).sum(axis=1)))
    system = arrow(r, columns, by_local, weights)
    extra = 2
    z = np.concatenate([place.z, np.zeros(extra)])
    precision = np.concatenate([problem.precision, np.ones(extra)])
    system = dataclasses.replace(system, A=system.A + np.diag(precision), a=system.a + precision * z)
    reduced, right, inverse = system.reduced()
    free = np.concatenate([problem.movable, np.ones(extra, dtype=bool)]) & (np.diag(system.A) > 1e-12)
    pulls = np.einsum("gwn,wn,w->wg", columns, r, weights) - np.einsum("wgi,wij,wj->wg", system.C, inverse, system.b)
    within = np.ix_(free, free)
    information = reduced[within]
    step = np.zeros(len(z))
    step[free] = -np.linalg.solve(information, right[free])
    moved = np.clip(place.z + step[: len(place.z)], problem.low, problem.high)
    covariance = np.zeros((len(z), len(z)))
    level = max(1.0, float(np.median(place.squares / model.counts)))
    covariance[within] = _covariance(information, np.diag(precision)[within], pulls[:, free], level)
    own = np.flatnonzero(problem.of_machine)
    rows = np.concatenate([own, len(place.z) + np.arange(extra)])
    load, gain = 1.0 + step[-2] * uncertain.load, 1.0 + step[-1] * uncertain.gain
    mean = np.concatenate([moved[own], step[-extra:]])
    return Joint(own, mean, covariance[np.ix_(rows, rows)], float(load), float(gain))


def _covariance(information: np.ndarray, prior: np.ndarray, pulls: np.ndarray, level: float) -> np.ndarray:
    """The sandwich, no direction of it narrower than the curvature and the misfit leave it."""
    values, vectors = np.linalg.eigh(information)
    root = (vectors / np.sqrt(np.maximum(values, 1e-9))) @ vectors.T
    windows = len(pulls)
    between = prior + windows / max(1, windows - 1) * pulls.T @ pulls
    spread, axes = np.linalg.eigh(root @ between @ root)
    return root @ (axes * np.maximum(spread, level)) @ axes.T @ root


def whole(z: np.ndarray, joint: Joint) -> np.ndarray:
    whole = z.copy()
    whole[joint.rows] = joint.mean[:-2]
    return whole


def _with_loads(model: IndexerModel, factor: float) -> IndexerModel:
    def changed(experiment: Experiment) -> Experiment:
        point = experiment.operating_point
        heavier = OperatingPoint(point.motor_speed, point.load_torque * factor, point.start_angle)
        return dataclasses.replace(experiment, operating_point=heavier, noise=experiment.noise_level)

    loaded = [changed(experiment) for experiment in model.experiments]
    return IndexerModel(model.machine, loaded, model.sensor, model.uncertainty, model.without, model.known)


def columns_of(
    model: IndexerModel, hypothesis: Hypothesis, joint: Joint, z: np.ndarray, uncertain: Uncertain,
    drawing: Machine, rng: np.random.Generator,
) -> list[tuple[str, str, np.ndarray]]:  # fmt: skip
    """Path, unit and values (n,) of each drawn quantity."""
    parameters = model.parameters + hypothesis.parameters
    columns: list[tuple[str, str, np.ndarray]] = []
    for place, row in enumerate(joint.rows):
        p = parameters[row]
        section = "machine" if p.name in (*UNCERTAINTY, HOUSING) else "effects"
        columns.append((f"{section}.{p.name}", p.unit, np.array([p.value(value) for value in z[:, place]])))
    for effect in (*model.known, *hypothesis.effects):
        for name, value in effect.fixed.items():
            columns.append((f"effects.{effect.name}.{name}", "-", np.full(len(z), float(value))))
    columns += _bracket(model.sensor, [path for path, _, _ in columns], len(z))
    columns.append((LOAD_FACTOR, "-", 1.0 + uncertain.load * z[:, -2]))
    columns.append((GAIN, "-", model.sensor.gain * (1.0 + uncertain.gain * z[:, -1])))
    if all(path != f"machine.{HOUSING}" for path, _, _ in columns):
        housing = drawing.housing_inertia * np.exp(uncertain.housing_inertia * rng.standard_normal(len(z)))
        columns.append((f"machine.{HOUSING}", "kg m²", housing))
    return columns


def _bracket(sensor: Sensor, drawn: Sequence[str], count: int) -> list[tuple[str, str, np.ndarray]]:
    """The bracket that the sensor stands on as it is, so that a loose sensor is one that stands looser than that."""
    effect = SensorBracketResonance.of_sensor(sensor)
    if effect is None:
        return []
    rows = [(f"effects.{effect.name}.{f.name}", f.metadata["unit"], getattr(effect, f.name)) for f in fields(effect)]
    return [(path, unit, np.full(count, value)) for path, unit, value in rows if path not in drawn]


def simulated(draws: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The joint draws as turns are simulated from them: an error of the gain that was found is part of the gain, so
    that a wrong gain is an error of what the sensor has, and what does not repeat from turn to turn has no part."""
    passing = tuple(f"effects.{name}." for name in PASSING)
    kept = {path: column for path, column in draws.items() if not path.startswith(passing)}
    error = kept.pop(f"effects.{SensorGain.name}.error", None)
    return kept if error is None else {**kept, GAIN: kept[GAIN] * (1.0 + error)}


def rescaled(
    paths: Sequence[str], units: Sequence[str], values: Sequence[np.ndarray], factor: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Draws with all inertias, stiffnesses, torques and loads times one factor (n,) each: the motion stays."""
    powers = [1 if path == LOAD_FACTOR else torque_power(unit) for path, unit in zip(paths, units, strict=True)]
    return tuple(column * factor**power for column, power in zip(values, powers, strict=True))


def logs_of(model: IndexerModel, z: np.ndarray) -> dict[str, np.ndarray]:
    """ln of each of the machine's parameters that scale with torque (n,)."""
    return {
        p.name: p.scale * z[:, k]
        for k, p in enumerate(model.parameters)
        if p.name in UNCERTAINTY and p.logarithmic and torque_power(p.unit)
    }
