"""The gap before and after on records never fitted, as normalised rms and as share of what could be closed.

With r_w the residuals of window w over the noise, y the record, N its samples whose residuals tell anything
(`Model.told`) and f the mean square of what does not repeat, over the noise's:

    gap = rms(simulated - measured) / rms(measured),   closed = (E_before - E_after) / E_before,   E = Σ r² - f N

Intervals come from windows drawn again with replacement (bootstrap), wider where they are few: by the quantile of
Student's law of w - 1 degrees of freedom over the normal law's, and by √(w/(w - 1)). One window tells no interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from discrepancy.model import Model
from discrepancy.place import Point
from discrepancy.subjects.base import View

_DRAWS = 2000
_ENDS = (0.025, 0.975)

_NO_GAP = 0.1
"""Excess of the mean square before, over f, up to which there was no gap to close."""


@dataclass(frozen=True)
class Share:
    """A number with its 95 % interval, whose ends are NaN where one window tells none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Gap:
    """The gap on records held out.

    Attributes
    ----------
    noise_floor, before, after : Share
        rms over the rms of the record [-]; the floor's interval is that of the record's level alone.
    closed_share : Share or None
        [-]; None where there was no gap to close.
    """

    noise_floor: Share
    before: Share
    after: Share
    closed_share: Share | None

    metric = "rms(simulated - measured) / rms(measured), on records that were not fitted"


def gap_of(before: Point, after: Point, model: Model, view: View, floor: float, rng: np.random.Generator) -> Gap:
    """The gap of two places on the records of a model and their `view`: the model as it came, and with what was found;
    f as above."""
    told_before, told_after = (model.told(place.hypothesis, place.z) for place in (before, after))
    noise = view.noise[view.groups]
    energy = np.where(view.inside, view.measured**2, 0.0).sum(axis=1)
    excess_before, excess_after = before.squares - floor * told_before, after.squares - floor * told_after
    sums = {
        "samples": told_before, "open": excess_before, "left": excess_after, "record": energy,
        "noise": told_after * noise**2, "before": before.squares * noise**2, "after": after.squares * noise**2,
    }  # fmt: skip
    w = len(energy)
    picked = np.array([rng.integers(0, w, w) for _ in range(_DRAWS)])
    drawn = {name: row[picked].sum(axis=1) for name, row in sums.items()}
    whole = {name: row.sum() for name, row in sums.items()}
    noise_floor, old, new = (
        _share(np.sqrt(whole[name] / whole["record"]), np.sqrt(drawn[name] / drawn["record"]), w)
        for name in ("noise", "before", "after")
    )
    if whole["open"] <= _NO_GAP * floor * whole["samples"]:
        return Gap(noise_floor, old, new, None)
    closed = _share(_closed(whole), _closed(drawn), w, low=-math.inf, high=1.0)
    return Gap(noise_floor, old, new, closed)


def _closed(sums: Mapping[str, np.ndarray]) -> np.ndarray:
    gap = sums["open"]
    closed = (gap - sums["left"]) / np.where(gap > 0.0, gap, math.nan)
    # Chance may bring the residual below the noise floor; no more than the gap can be closed.
    return np.minimum(closed, 1.0)


def _share(value: np.ndarray, drawn: np.ndarray, windows: int, low: float = 0.0, high: float = math.inf) -> Share:
    """A value with its interval, which ends where no value can lie: beyond `low` and `high`."""
    if windows < 2:
        return Share(float(value), math.nan, math.nan)
    ends = np.nanquantile(drawn, _ENDS)
    # few windows drawn again differ too little, and tell little of how far they differ: Student's law
    wider = math.sqrt(windows / (windows - 1)) * stdtrit(windows - 1, _ENDS[1]) / ndtri(_ENDS[1])
    ends = value + wider * (ends - value)
    return Share(float(value), max(low, float(ends[0])), min(high, float(ends[1])))
