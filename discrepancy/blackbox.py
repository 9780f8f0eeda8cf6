"""The control: a model without physics that learns the base model's residuals from the known inputs.

An effect that predicts records held out no better than this has earned no name.
"""

from __future__ import annotations

import math

import numpy as np

from discrepancy.model import NONE, Model
from discrepancy.problem import Point, Problem

_RIDGE = 1.0
"""Prior variance of each coefficient, in units of the noise's, times the number of samples: hardly any."""


def black_box_level(model: Model, base: Point, held_out: Model, held_base: Point) -> float:
    """Level (rms over noise) that ridge regression on `Model.features` reaches on the records held out."""
    learned, features = _residuals(model, base), model.features()
    inside = np.arange(learned.shape[1]) < model.counts[:, None]
    X, y = features[inside], learned[inside]
    coefficients = np.linalg.solve(X.T @ X + _RIDGE * np.eye(X.shape[1]), X.T @ y)
    left = _residuals(held_out, held_base) - held_out.features() @ coefficients
    inside = np.arange(left.shape[1]) < held_out.counts[:, None]
    return math.sqrt(float((left[inside] ** 2).mean()))


def _residuals(model: Model, place: Point) -> np.ndarray:
    return Problem(model, NONE).residuals(place.z[None], place.states[None])[0]
