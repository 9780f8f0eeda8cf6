"""Which part of each record is held out where no whole one is."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from discrepancy.indexer import Experiment
from discrepancy.indexer.windows import LEAST_WINDOWS, windows_of
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.signal import Signal

_CUTS = ((2.0 / 3.0, True), (0.5, True), (1.0 / 3.0, False), (0.5, False))
"""Where a record may be cut, over its length, and whether the part behind the cut is held out; the first is preferred.
"""

_ROUNDS = 2
"""Times that each record's cut is chosen, the others' given."""


def divided(made: Sequence[Experiment], machine: Machine) -> tuple[tuple[Experiment, ...], tuple[Experiment, ...]]:
    """Parts of all records to fit and to hold out: a third or a half of each, its end or its beginning, so that both
    have cam turns enough, and as many stations as possible are seen by both. What acts at one station alone is proved
    only where it is."""
    parts = [[_cut(one, machine, *cut) for cut in _CUTS] for one in made]
    seen = [[_stations(pair, machine) for pair in pairs] for pairs in parts]
    chosen = [0] * len(made)
    for _ in range(_ROUNDS):
        for k, mine in enumerate(seen):
            others = sum((seen[i][c] for i, c in enumerate(chosen) if i != k), np.zeros((2, machine.stations)))
            good = [_goodness(others + own) if own.any(axis=1).all() else (-1, 0) for own in mine]
            chosen[k] = max(range(len(_CUTS)), key=good.__getitem__)
    fitted, held = zip(*(pairs[c] for pairs, c in zip(parts, chosen, strict=True)), strict=True)
    return tuple(fitted), tuple(held)


def _goodness(seen: np.ndarray) -> tuple[int, int]:
    """Cam turns of both parts up to what each needs, and stations that both see, by how often they do (2, stations)."""
    return int(np.minimum(seen.sum(axis=1), LEAST_WINDOWS).sum()), int((seen > 0).all(axis=0).sum())


def _stations(pair: tuple[Experiment, Experiment], machine: Machine) -> np.ndarray:
    """How often the part fitted and the part held out see each station (2, stations)."""
    turns = [windows_of([one], machine.reduction).turn for one in pair]
    return np.array([np.bincount(turn % machine.stations, minlength=machine.stations) for turn in turns])


def _cut(experiment: Experiment, machine: Machine, share: float, behind: bool) -> tuple[Experiment, Experiment]:
    """The part fitted and the part held out.

    A speed that drifts by d from one end of a record to the other, at its mean as stated, is on the average of a first
    share c slower by d (1 - c)/2, of the rest faster by d c/2, and at the cut the cam is d c (1 - c)/2 of all that it
    turns behind.
    """
    signal, point = experiment.signal, experiment.operating_point
    first = int(share * len(signal.values))
    cam_rate, drift = machine.reduction * point.motor_speed, experiment.drift_uncertainty
    turned, turned_first = cam_rate * signal.duration, cam_rate * first / signal.sample_rate
    known, speed = experiment.start_uncertainty, experiment.speed_uncertainty
    known_later = math.hypot(known, 0.5 * drift * share * (1.0 - share) * turned, speed * turned_first)
    one, other = (
        dataclasses.replace(
            experiment,
            signal=Signal(values, signal.sample_rate, unit=signal.unit, source=signal.source),
            operating_point=OperatingPoint(point.motor_speed, point.load_torque, start),
            start_uncertainty=start_known_to,
            speed_uncertainty=math.hypot(speed, 0.5 * drift * (1.0 - part)),
            drift_uncertainty=drift * part,
            begun=since,
        )
        for values, start, start_known_to, part, since in (
            (signal.values[:first], point.start_angle, known, share, 0.0),
            (signal.values[first:], point.start_angle + turned_first, known_later, 1.0 - share,
             first / signal.sample_rate),
        )
    )  # fmt: skip
    return (one, other) if behind else (other, one)
