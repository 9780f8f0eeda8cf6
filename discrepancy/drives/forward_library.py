"""The standard effects that the forward form can have, as hypotheses, each at each joint."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.both_forms import adrift
from discrepancy.drives.course import Course
from discrepancy.drives.effects.friction import LOAD_FRICTION
from discrepancy.drives.effects.ripple import lines
from discrepancy.drives.library import hypotheses_of, sized, without
from discrepancy.drives.scales import Scales
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis
from discrepancy.problem import Problem
from indexer_env.effects.sensor import SensorMainsHum

if TYPE_CHECKING:
    from discrepancy.drives.forward import ForwardModel

LINE = SensorMainsHum.name
_SLIGHT = 0.05
"""Share of a start's size at which its response is taken: at its whole size the drive may stand where it moved."""

_BAND = 0.8
"""Highest frequency at which a line is looked for, of half the sampling rate."""


def library_of(model: ForwardModel) -> dict[str, tuple[Hypothesis, ...]]:
    """Hypotheses of the effects that the integrator has and the model has not yet."""
    known = {one.name for one in model.known}
    found: dict[str, tuple[Hypothesis, ...]] = {}
    for effect in model.drive.effects:
        if effect.name in known or not effect.forward:
            continue
        if effect.name == LINE:
            if model.courses[0].u.shape[1]:
                choices = lines_of(model, model.residuals(NONE, model.jobs(np.zeros(len(model.parameters)))))
                found.update({LINE: choices} if choices else {})
            continue
        if effect.acts == "reading":
            if model.courses[0].u.shape[1]:
                found[effect.name] = hypotheses_of(effect, _of_input(next(iter(model.scales)), model.courses))
            continue
        at_joints: list[Hypothesis] = []
        for j, (joint, scales) in enumerate(zip(model.drive.joints, model.scales, strict=True)):
            if effect.rotary and scales.position_unit != "rad":
                continue
            if effect.placed and adrift(model.drive, joint.position, len(model.courses)):
                continue
            if effect.name == LOAD_FRICTION and model.courses[0].input_unit != scales.force_unit:
                continue
            wavelengths = [(0.1 * scales.F, k / scales.Q, 0.0) for k in (6.3, 12.6, 25.1)]
            wavelengths = wavelengths if effect.name == "cogging" else []
            mine = hypotheses_of(effect, scales, wavelengths)
            if len(model.scales) > 1:
                mine = tuple(dataclasses.replace(h, fixed={**h.fixed, "joint": float(j)}, effects=()) for h in mine)
            at_joints += mine
        if at_joints:
            found[effect.name] = tuple(at_joints)
    return found


def lines_of(model: ForwardModel, residual: np.ndarray) -> tuple[Hypothesis, ...]:
    """Lines on the command at the frequencies that stand out of what a fit has left, residuals (w, n): of the first
    channel of the longest record."""
    scales, left = _of_input(model.scales[0], model.courses), -residual * model.courses[0].noise[0]
    windows, channel = model.windows, int(model.measured[0])
    k = max(windows.tracks, key=lambda k: len(model.courses[k].u))
    mine = np.flatnonzero(windows.track == k)
    t = np.concatenate([windows.first[w] + np.arange(windows.count[w]) for w in mine]) / model.courses[k].rate
    row = np.concatenate([left[w, : windows.count[w]] for w in mine])
    slowest = 6.0 * math.pi * model.courses[k].rate / float(windows.count[mine].min())
    # of a sine of the force: the acceleration follows it, the speed a quarter later, the position the other way
    joint = model.drive.joints[0]
    late = {-1: math.pi, model.drive.states.index(joint.speed): -0.5 * math.pi}.get(channel, 0.0)
    proposed = [
        (0.1 * scales.F, omega / (2.0 * math.pi), phase + late)
        for _, omega, phase in lines(t, row, slowest, _BAND * math.pi * model.courses[k].rate)
    ]
    return hypotheses_of(model.effects[LINE], scales, proposed)


def sized_by(
    model: ForwardModel, library: Mapping[str, tuple[Hypothesis, ...]], residual: np.ndarray
) -> dict[str, tuple[Hypothesis, ...]]:
    """The library with starts of the sizes that a fit's residuals (w, n) ask for beside the model's own parameters and
    the windows' start states."""
    problem = Problem(model, NONE)
    zero = np.zeros(len(model.parameters))
    plain, by_global, by_local = problem.linearised(
        problem.point(zero, np.zeros((len(model.counts), model.local_count(NONE))))
    )
    bases = [np.linalg.qr(by_local[:, w].T)[0] for w in range(len(plain))]

    def apart(rows: np.ndarray) -> np.ndarray:
        """Rows (w, n) without what start states can give of them."""
        return np.concatenate([row - base @ (base.T @ row) for row, base in zip(rows, bases, strict=True)])

    slopes = np.array([apart(rows) for rows in by_global])
    left = without(apart(-residual), slopes)

    def response(one: Hypothesis, values: tuple[float, ...]) -> np.ndarray:
        point = np.concatenate([zero, one.coordinates((_SLIGHT * values[0], *values[1:]))])
        jobs = Jobs.at(point, np.arange(len(plain)), np.zeros((len(plain), model.local_count(one))))
        return without(apart(model.residuals(one, jobs) - plain), slopes) / _SLIGHT

    return {name: tuple(sized(one, response, left) for one in choices) for name, choices in library.items()}


def _of_input(scales: Scales, courses: Sequence[Course]) -> Scales:
    """Scales for what is done to the command: F is its rms."""
    u = np.concatenate([course.u[:, 0] for course in courses])
    return dataclasses.replace(scales, F=float(np.sqrt(np.mean(u**2))), force_unit="unit of the input")
