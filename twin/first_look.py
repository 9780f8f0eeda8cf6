"""What the calibrated machine leaves of each healthy file, before anything is simulated: which one does not belong to
the others, or was not taken under the load that is stated."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from discrepancy.indexer import Experiment
from indexer_cli.words import joined
from indexer_env.errors import ParameterError, SimulationError
from indexer_env.operating_point import OperatingPoint
from twin.card import turns_of
from twin.check import PREDICTED, level_of
from twin.faults import peak_torque
from twin.learn import View
from twin.remains import remains_of
from twin.turns import Healthy, shift_shapes, without_shift

_FAR = 3.0
"""Standard deviations of the stated load from which on another one is told."""

_EXPLAINED = 0.75
"""Share of what is left (mean square) that another load must explain to be told: a machine that is another one than the
drawing's may look loaded a little otherwise."""

_SCANS, _TRIED = 3, 15
"""Scans for the load, and loads tried in each: to 1/343 of the peak torque."""

_Turns = list[tuple[OperatingPoint, np.ndarray]]
"""Operating point and whole turns (k, stations, cells) of the parts of a file that hold any."""


def by_file(experiments: Sequence[Experiment], healthy: Healthy) -> dict[str, _Turns]:
    """The turns of each file; none of one without a whole turn."""
    found: dict[str, _Turns] = {}
    for one in experiments:
        turns = turns_of(one, healthy)
        if len(turns):
            found.setdefault(one.signal.source, []).append((one.operating_point, turns))
    return found


def levels(
    fitted: Mapping[str, _Turns], files: Mapping[str, _Turns], healthy: Healthy, view: View
) -> dict[str, float]:  # fmt: skip
    """How many times the noise (rms) is left of each file, with what the other files that were fitted left of the
    machine: a file would explain itself. `fitted` are the parts that were fitted, `files` all of them."""
    found = {}
    for file, parts in files.items():
        others = [part for name, theirs in fitted.items() if name != file for part in theirs]
        others = others or [part for theirs in fitted.values() for part in theirs]
        remains = remains_of([turns for _, turns in others], [point for point, _ in others], view.shift, healthy)
        seen = dataclasses.replace(view, remains=remains)
        each = [level_of(turn, healthy.turn(point), point, seen) for point, turns in parts for turn in turns]
        found[file] = float(np.sqrt(np.mean(np.square(each))))
    return found


def sentences(found: Mapping[str, float]) -> tuple[str, str]:
    """The line that tells the levels of all files, and the warning of the one that belongs to them least, and of others
    beyond the limit; no text where there is none."""
    line = ", ".join(f"{file} {level:.1f}" for file, level in found.items())
    line = f"left of each file, in times the noise: {line}"
    odd = max(found, key=found.__getitem__)
    if found[odd] <= PREDICTED:
        return line, ""
    others = [f"{file} by {level:.1f}" for file, level in found.items() if level > PREDICTED and file != odd]
    also = f" ({joined(others)})" if others else ""
    return line, (
        f"{odd} differs from its prediction by {found[odd]:.1f} times the noise{also}, more than {PREDICTED:g}: it may "
        "be of a faulty machine or rattle in its play as no other file does, or the drawing, or what is stated of the "
        "record, is wrong; stop and look, or leave it out"
    )


def wrong_load(files: Mapping[str, _Turns], healthy: Healthy, view: View, uncertainty: float) -> tuple[str, ...]:
    """A note on the file whose load is farthest from the stated one, `uncertainty` its relative standard deviation; on
    no other, as one wrong load bends the machine until others look wrong beside it."""
    as_stated = dataclasses.replace(healthy, load_factor=1.0)
    farthest, notes = _FAR, tuple[str, ...]()
    for file, parts in files.items():
        point, turns = max(parts, key=lambda part: len(part[1]))
        stated, known_to = point.load_torque, uncertainty * abs(point.load_torque)
        load, explained = _load(point, turns, as_stated, view)
        far = abs(load - stated) / max(known_to, 1e-9)
        if far > farthest and explained > _EXPLAINED:
            farthest = far
            notes = (
                f"{file}: the load is {load:.3g} N m by the record, {stated:g} N m stated, known to ±"
                f"{known_to:.2g} N m; correct load_torque if it was another one",
            )
    return notes


def _load(point: OperatingPoint, turns: np.ndarray, healthy: Healthy, view: View) -> tuple[float, float]:
    """The load [N m] that leaves least of turns, no farther from the stated one than the index's peak torque, and the
    share of what is left at the stated one that it explains. It is looked for in ever finer scans: where there is play,
    what is left is too rough for derivatives."""
    mean, noise = turns.mean(axis=0), view.remains.sigma(point) / math.sqrt(len(turns))

    def left(load: float) -> float:
        try:
            reference = healthy.turn(OperatingPoint(point.motor_speed, load))
        except (ParameterError, SimulationError):
            return math.inf  # the machine cannot run under such a load
        return float((without_shift(mean - reference, shift_shapes(reference, view.shift), noise) ** 2).mean())

    load, width, stated = point.load_torque, peak_torque(healthy.machine, point.motor_speed), left(point.load_torque)
    for _ in range(_SCANS):
        tried = load + width * np.linspace(-1.0, 1.0, _TRIED)
        load = min(tried.tolist(), key=left)
        width *= 2.0 / (_TRIED - 1)
    return load, 1.0 - left(load) / max(stated, 1e-300)
