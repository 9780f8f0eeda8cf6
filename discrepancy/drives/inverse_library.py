"""The standard effects that the inverse form can have, as hypotheses, sized by what a fit has left of the records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.both_forms import adrift
from discrepancy.drives.library import check_slopes, done_by_model, hypotheses_of, proposals, sensible, sized, without
from discrepancy.model import NONE, Hypothesis

if TYPE_CHECKING:
    from discrepancy.drives.inverse import InverseModel

_NUDGE = 1e-4
"""Relative to a parameter's scale, for the slopes of the model's own parameters."""


def library_of(model: InverseModel) -> tuple[dict[str, tuple[Hypothesis, ...]], tuple[str, ...]]:
    """Effects that may be missing, sensible for the channels; and those left out as the model's own parameters can do
    the same."""
    zero, slopes, inside = np.zeros(len(model.parameters)), _slopes(model), np.concatenate(model.inside)
    check_slopes(model.drive, slopes[: model.own])
    slopes = _apart(model, slopes)
    tracks, left = [model.tracks[k] for k in model.windows.tracks], _left_by(model, slopes, inside)
    found, done = {}, []
    placed = not adrift(model.drive, "q", len(model.tracks))
    for effect in sensible(model.drive.effects, model.scales, {one.name: one for one in model.known}, placed):
        choices = hypotheses_of(effect, model.scales, proposals(effect, tracks, left))
        if not choices:
            continue
        start = np.concatenate([zero, choices[0].coordinates(choices[0].starts[0])])
        response = _plain(model, choices[0], start) - _plain(model, NONE, zero)
        if effect.load and not response.any():
            continue  # a law of the joint that the model has none of
        if effect.acts != "dry" and done_by_model(response, slopes):
            done.append(effect.name)
            continue
        found[effect.name] = choices
    return found, tuple(done)


def proposed_by(
    model: InverseModel, library: Mapping[str, tuple[Hypothesis, ...]], residual: np.ndarray
) -> dict[str, tuple[Hypothesis, ...]]:
    """The library with the wavelengths and sizes that a fit's residuals (w, n) ask for."""
    left = [np.zeros(len(row)) for row in model.measured]
    windows = model.windows
    for w, (group, first, count) in enumerate(zip(model.groups, windows.first, windows.count, strict=True)):
        left[group][first : first + count] = -residual[w, :count] * model.noise[group]
    tracks = [model.tracks[k] for k in windows.tracks]
    found = dict(library)
    for name in found:
        if proposed := proposals(model.effects[name], tracks, left):
            found[name] = hypotheses_of(model.effects[name], model.scales, proposed)
    zero, inside = np.zeros(len(model.parameters)), np.concatenate(model.inside)
    slopes = slopes_of(model)[:, inside]
    plain, whole = _plain(model, NONE, zero), without(np.concatenate(left)[inside], slopes)

    def response(one: Hypothesis, values: tuple[float, ...]) -> np.ndarray:
        given = _plain(model, one, np.concatenate([zero, one.coordinates(values)]))
        return without((given - plain)[inside], slopes)

    return {name: tuple(sized(one, response, whole) for one in choices) for name, choices in found.items()}


def _plain(model: InverseModel, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
    """Readings (n,) of all records at a point, one after the other."""
    return np.concatenate([model.compared(group, hypothesis, point)[0] for group in range(len(model.measured))])


def _slopes(model: InverseModel) -> np.ndarray:
    """Derivatives (slots, n) of all readings by the model's own numbers, each at once on all records."""
    zero = np.zeros(len(model.parameters))
    plain, slopes = _plain(model, NONE, zero), []
    for places in model.slots.at.T:
        nudged = zero.copy()
        nudged[places] += _NUDGE
        slopes.append((_plain(model, NONE, nudged) - plain) / _NUDGE)
    return np.array(slopes)


def slopes_of(model: InverseModel) -> np.ndarray:
    """Derivatives (g, n) of all readings by the parameters of the fit."""
    return _apart(model, _slopes(model))


def _apart(model: InverseModel, slopes: np.ndarray) -> np.ndarray:
    """The same (g, n) by the parameters of the fit: record by record where each has its own."""
    owner = np.repeat(np.arange(len(model.measured)), [len(row) for row in model.measured])
    out = np.zeros((len(model.parameters), slopes.shape[1]))
    for k, places in enumerate(model.slots.at.T):
        out[places[owner], np.arange(len(owner))] = slopes[k]
    return out


def _left_by(model: InverseModel, slopes: np.ndarray, inside: np.ndarray) -> list[np.ndarray]:
    """What the model with plain friction and an offset leaves of each record fitted: where waves are looked for."""
    tracks = [model.tracks[k] for k in model.windows.tracks]
    v, side = (np.concatenate([t.thinned(row) for t in tracks for row in (getattr(t, name),)])
               for name in ("v", "direction"))  # fmt: skip
    columns = np.stack([*slopes, v, side, np.ones_like(v)], axis=1)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    target = np.concatenate(model.measured) - _plain(model, NONE, np.zeros(len(model.parameters)))
    fitted, *_ = np.linalg.lstsq(columns[inside], target[inside], rcond=1e-10)
    edges = np.cumsum([len(row) for row in model.measured])[:-1]
    return np.split(np.where(inside, target - columns @ fitted, 0.0), edges)
