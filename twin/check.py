"""The last stage: healthy turns to which no size was fitted must come out healthy, not novel, and as predicted. Which
effects are added, the range and how noisy a record usually is, these turns have a part in."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import nn

from indexer_env import OperatingPoint
from twin.judge import Judge, ensemble
from twin.learn import View
from twin.synthesis import Synthesis
from twin.turns import Healthy, in_phase
from twin.weigh import ACCEPTED, Weights

_CHANCE = 0.05
"""Probability below which so many alarms are no chance."""

PREDICTED = 2.0
"""rms of a turn's difference from the prediction over the noise above which it was not predicted."""


@dataclass(frozen=True)
class Check:
    """What the check found.

    Attributes
    ----------
    trusted : bool
    reason : str
    turns : sequence of mapping
        file, alarm (above 0: called faulty), novelty (above 1: novel), level (rms over the noise) of each turn.
    """

    trusted: bool
    reason: str
    turns: Sequence[dict[str, Any]]

    def plain(self) -> dict[str, Any]:
        """As YAML knows it."""
        return dataclasses.asdict(self)


def level_of(turn: np.ndarray, reference: np.ndarray, point: OperatingPoint, view: View) -> float:
    """How many times the noise (rms) a turn differs from its prediction, in whichever phase of a subharmonic it is."""
    predicted = in_phase(reference, turn)
    return float(np.sqrt((view.measured(turn - predicted, predicted, point) ** 2).mean()))


def checked(
    turns: Sequence[np.ndarray], points: Sequence[OperatingPoint], files: Sequence[str], healthy: Healthy, view: View,
    networks: Sequence[nn.Module], judge: Judge, synthesis: Synthesis, weights: Weights, false_alarms: float, own: bool,
    stations_known: bool,
) -> Check:  # fmt: skip
    """The check on turns (k, stations, cells) of each record; `own`: they are those that were fitted."""
    from scipy.stats import binom

    rows = []
    for mine, point, file in zip(turns, points, files, strict=True):
        if not len(mine):
            continue
        reference = healthy.turn(point)
        x = np.array([view.measured(turn - reference, reference, point) for turn in mine])
        conditions = torch.from_numpy(view.conditions([point] * len(x)))
        told = ensemble(networks, torch.from_numpy(x.astype(np.float32)), conditions)
        of = synthesis if stations_known else synthesis.of_mean()
        strange = weights.oddness(of.unexplained(x), stations_known=stations_known)
        for k in range(len(x)):
            level = level_of(mine[k], reference, point, view)
            alarm = float(told["any"][k] - judge.alarm)
            rows.append({"file": file, "alarm": alarm, "novelty": float(strange[k]), "level": level})
    if not rows:
        return Check(
            False, "No healthy record holds a whole turn of the table to check the twin with; record more.", []
        )
    count = len(rows)
    alarms, novel = sum(row["alarm"] > 0.0 for row in rows), sum(row["novelty"] > 1.0 for row in rows)
    off = [row for row in rows if row["level"] > PREDICTED]
    where = "healthy turns that were fitted" if own else "healthy turns that were held out"
    if float(binom.sf(alarms - 1, count, false_alarms)) < _CHANCE and alarms:
        said = f"{alarms} of {count} {where} are called faulty; one of the records may be of a faulty machine"
        return Check(
            False, f"Not to be trusted: {said}, or more than the drawing lacks has changed between them.", rows
        )
    if float(binom.sf(novel - 1, count, 1.0 - ACCEPTED)) < _CHANCE and novel:
        said = f"{novel} of {count} {where} are like none of the simulated ones"
        return Check(
            False, f"Not to be trusted: {said}; record at the speeds and loads at which you will diagnose.", rows
        )
    if off:
        said = f"{off[0]['file']} differs from its prediction by {off[0]['level']:.1f} times the noise"
        why = "the drawing, or what was stated of the record, is wrong"
        if not stations_known:
            why += ", or stations differ, as by an imbalance, and nothing tells them: record a once-per-turn pulse"
        return Check(False, f"Not to be trusted: {said}; {why}.", rows)
    sound = sum(row["alarm"] <= 0.0 and row["novelty"] <= 1.0 for row in rows)
    found = f"All {count} {where} come out healthy, not novel and as predicted."
    if sound < count:
        found = f"{sound} of {count} {where} come out healthy and not novel; the others are no more than chance allows."
    none = " None of the records held out holds a whole turn, so this proves little: record a longer one."
    return Check(True, found + (none if own else ""), rows)
