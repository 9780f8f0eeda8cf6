"""What a table of motion cannot satisfy: findings that make it unusable, and findings a user should know.

All look at the table's own differences, not at its spline, which would show its ringing instead of the cause:
D1 = first and D2 = second divided differences of beta over u. A smooth table has D2 that changes little from
point to point; rounding throws it up and down at every other point. e, the difference of D2 from the line
between its two neighbours, therefore keeps its sign where a table is smooth and alternates where it is noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from indexer_env.errors import ParameterError, refuse
from indexer_env.motion_law.pieces import LawPieces
from indexer_env.motion_law.table_spline import Stretch, Values, dwelling, stretches

OWNER = "TableLaw"
# Below this number of intervals beta'' of the four named laws is missed by more than 1 % of its peak.
FEWEST_PER_MOTION = 12
FEWEST_FOR_DIFFERENCES = 8  # points
# Peak error of the spline's beta'' over the alternating part of e: 4 to 6 for the named laws, 91 to 1441
# points a turn, rounded to 2 to 6 decimals of a degree.
SPLINE_GAIN = 5.0
NOISE_KNOWN, NOISE_FATAL = 0.01, 0.5  # of the peak of beta''
SPIKE_KNOWN, SPIKE_FATAL = 0.1, 0.6  # of the peak of beta''; a step of the velocity alone gives 0.5
STAIRCASE = 0.05  # share of points with a fatal spike: so many are the steps of rounding, no stray points
JUMP_KNOWN = 0.15  # of the peak; the edge fits err by up to 0.1 at the fewest points per motion
JUMP_COARSE = 0.5  # with fewer points only a jump of the velocity can be told from a steep start
OVERSHOOT_KNOWN, OVERSHOOT_FATAL = 1e-4, 1e-2  # of the advance per turn


class Finding(NamedTuple):
    """One sentence about the table, and whether no law can be made from it."""

    fatal: bool
    error: ParameterError


def findings(u: Values, beta: Values, pieces: LawPieces) -> Iterator[Finding]:
    """All findings about a table u (n,) in cam turns, beta (n,) rad, and its spline; causes come first."""
    found = stretches(u, beta)
    motions = found or [Stretch(0, u, beta)]
    for motion in motions:
        yield from _coarse(motion)
        if found:
            yield from _edges(motion)
        yield from _noise(motion)
    yield from _reversal(u, beta)
    yield from _overshoot(u, beta, pieces)


def _deg(cam_turns: float) -> float:
    return round(360.0 * cam_turns % 360.0, 6)


def _name(motion: Stretch) -> str:
    return f"the motion from {_deg(motion.u[0]):g} to {_deg(motion.u[-1]) or 360:g} deg of the cam"


def _coarse(motion: Stretch) -> Iterator[Finding]:
    if motion.u.size - 1 < FEWEST_PER_MOTION:
        rule = f"given at {FEWEST_PER_MOTION} intervals or more in {_name(motion)}"
        remedy = "the acceleration is uncertain by more than 1 %"
        yield Finding(False, refuse(OWNER, "cam_angle", rule, motion.u.size - 1, remedy))


class _Differences(NamedTuple):
    """What D2 and e say about a motion of n points, and the scales they are judged by."""

    spikes: Values  # (n - 6,), least of three neighbouring e that alternate, share of the peak acceleration
    velocity: float  # peak, rad / turn
    acceleration: float  # peak, rad / turn^2
    noise: float  # of the spline's beta'', share of the peak acceleration


def _differences(motion: Stretch) -> _Differences:
    width, step = np.diff(motion.u), np.diff(motion.beta)
    second = 2.0 * np.diff(step / width) / (width[1:] + width[:-1])
    place = (motion.u[2:] + motion.u[1:-1] + motion.u[:-2]) / 3.0  # where D2 equals beta'' to second order
    share = (place[1:-1] - place[:-2]) / (place[2:] - place[:-2])
    e = second[1:-1] - (1.0 - share) * second[:-2] - share * second[2:]
    velocity = float(np.abs(step / width).max())
    # No motion from rest to rest needs less than velocity / duration; a straight line has no peak of its own.
    acceleration = max(float(np.abs(second).max()), velocity / motion.duration)
    noise = SPLINE_GAIN * float(np.median(np.sqrt(np.maximum(-e[1:] * e[:-1], 0.0)))) / acceleration
    flips = (e[1:-1] * e[:-2] < 0.0) & (e[1:-1] * e[2:] < 0.0)
    least = np.minimum(np.minimum(np.abs(e[:-2]), np.abs(e[2:])), np.abs(e[1:-1]))
    spikes = np.where(flips, least, 0.0) / acceleration
    if np.count_nonzero(spikes > SPIKE_FATAL) > max(3.0, STAIRCASE * spikes.size):
        noise = max(noise, 1.0)
    return _Differences(spikes, velocity, acceleration, noise)


def _noise(motion: Stretch) -> Iterator[Finding]:
    if motion.u.size < FEWEST_FOR_DIFFERENCES:
        return
    spikes, _, _, noise = _differences(motion)
    if noise > NOISE_KNOWN:
        got = f"noise near {100 * min(noise, 1.0):.0f} % of the peak acceleration"
        rule = f"smooth to {100 * NOISE_KNOWN:g} % of its peak acceleration in {_name(motion)}"
        remedy = "give the follower angles with more digits, or the table at wider points"
        yield Finding(noise > NOISE_FATAL, refuse(OWNER, "follower_angle", rule, got, remedy))
        return
    worst = int(np.argmax(spikes))
    if spikes[worst] > SPIKE_KNOWN:
        rule = f"without a kink or stray point at {_deg(motion.u[worst + 3]):g} deg of the cam"
        got = f"a spike of {100 * spikes[worst]:.0f} % of the peak acceleration"
        error = refuse(OWNER, "follower_angle", rule, got, "check that point")
        yield Finding(bool(spikes[worst] > SPIKE_FATAL), error)


def _edges(motion: Stretch) -> Iterator[Finding]:
    if motion.u.size < FEWEST_FOR_DIFFERENCES:
        return
    _, velocity, acceleration, noise = _differences(motion)
    coarse = motion.u.size - 1 < FEWEST_PER_MOTION
    u, beta = motion.u, motion.beta
    for edge, x, y in ((u[0], u - u[0], beta - beta[0]), (u[-1], (u[-1] - u)[::-1], (beta[-1] - beta)[::-1])):
        at = f"at the edge of the dwell, {_deg(edge):g} deg of the cam"
        jump = abs(_first_term(x, y, 1)) / velocity
        if jump > max(JUMP_COARSE if coarse else JUMP_KNOWN, noise):
            rule, got = f"free of a jump of the velocity {at}", f"a jump of {100 * jump:.0f} % of its peak"
            remedy = "a cam cannot follow it; use a law that starts and ends at rest"
            yield Finding(True, refuse(OWNER, "follower_angle", rule, got, remedy))
            continue
        jump = 2.0 * abs(_first_term(x, y, 2)) / acceleration
        if not coarse and jump > max(JUMP_KNOWN, 2.0 * noise):
            rule = f"free of a jump of the acceleration {at}"
            got = f"a jump of {100 * jump:.0f} % of its peak"
            remedy = (
                "the spline rises steeply over a few points instead; if the law has no jump, "
                "give the point where the motion meets the dwell, and more digits"
            )
            yield Finding(False, refuse(OWNER, "follower_angle", rule, got, remedy))


def _first_term(x: Values, y: Values, power: int) -> float:
    """c of y = c x^power + three higher powers, least squares over the first six points after the edge."""
    scale = float(x[6])
    powers = (x[1:7, None] / scale) ** np.arange(power, power + 4)
    return float(np.linalg.lstsq(powers, y[1:7], rcond=None)[0][0]) / scale**power


def _reversal(u: Values, beta: Values) -> Iterator[Finding]:
    back = np.flatnonzero(np.diff(beta) < -1e-9 * (beta[-1] - beta[0]))
    if back.size:
        rule = f"rising throughout, also at {_deg(float(u[back[0]])):g} deg of the cam"
        got = f"{back.size} falling steps"
        remedy = "no fault if the cam is meant to turn the follower back"
        yield Finding(False, refuse(OWNER, "follower_angle", rule, got, remedy))


def _overshoot(u: Values, beta: Values, pieces: LawPieces) -> Iterator[Finding]:
    inside = np.arange(1, 16) / 16.0
    low, high = np.minimum(beta[:-1], beta[1:]), np.maximum(beta[:-1], beta[1:])
    value = pieces.evaluate(u[:-1, None] + np.diff(u)[:, None] * inside)[0]
    beyond = np.maximum(value.max(axis=1) - high, low - value.min(axis=1))
    # Beside a turning point the law rightly passes beyond its points; a dwell on one side is no turning
    # point.
    step = np.where(dwelling(u, beta), 0.0, np.diff(beta))
    beyond[(step * np.roll(step, 1) < 0.0) | (step * np.roll(step, -1) < 0.0)] = 0.0
    worst = int(np.argmax(beyond))
    share = float(beyond[worst] / (beta[-1] - beta[0]))
    if share > OVERSHOOT_KNOWN:
        rule = f"given closely enough at {_deg(u[worst]):g} deg of the cam to keep between its points"
        got = f"an overshoot of {math.degrees(beyond[worst]):.4g} deg"
        yield Finding(
            share > OVERSHOOT_FATAL,
            refuse(OWNER, "follower_angle", rule, got, "give closer points there or check that point"),
        )
