"""Which frequencies spoke for a class: integrated gradients of a network's agreement with its code.

    A(x) = 1/B Σ_b a_b(x),   a_b = y_b where the bit is 1, 1 − y_b where it is 0
    c_i  = (x_i − m_i) ∫₀¹ ∂A/∂x_i (m + t (x − m)) dt,        Σ_i c_i = A(x) − A(m)

x are the scaled features of a record, m their mean over the calibration records, y the outputs on the scale of the
bits. So c_i is by how much feature i moved the agreement away from that of the mean record.
Source: M. Sundararajan, A. Taly, Q. Yan, Axiomatic Attribution for Deep Networks, ICML 2017 (eq. 1; completeness:
proposition 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import torch

from classifier.model import Model
from classifier.network import TARGETS

COMPLETE = 1e-9
"""Largest difference between the sum of the contributions and what they must sum to."""

BANDS = 10
"""Bands of equal width into which contributions are summed."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_MOST_PANELS = 2**11


@dataclass(frozen=True)
class Band:
    """A band of frequencies and how much the features in it added to the agreement with the named class.

    low_hz, high_hz  its edges [Hz]; the upper one belongs to the next band, but for the last
    contribution     Σ c_i [-], negative where it spoke against
    """

    low_hz: float
    high_hz: float
    contribution: float


def contributions(model: Model, features: np.ndarray, position: int) -> np.ndarray:
    """Contributions c (count,) of scaled features (count,) to the agreement with the class at `position` of the code
    book.

    The integral is taken by Gauss and Legendre on panels that are quartered until the contributions are complete to
    COMPLETE, and `_MOST_PANELS` at most: of features a hundred times those that were taught they stay incomplete.
    """
    network, mean = model.network, model.mean_features
    layers = network.layers(model.parameters[None])
    (first, second), (low, high) = network.functions, TARGETS[network.targets]
    code = torch.from_numpy(2.0 * model.codes.matrix[position] - 1.0) / (network.outputs * (high - low))
    start, end = (layers.w1[0] @ torch.from_numpy(x) + layers.b1[0] for x in (mean, features))

    def run(t: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        hidden = first.in_place(start[:, None] + t * (end - start)[:, None])
        return hidden, second.in_place(torch.addmm(layers.b2[0][:, None], layers.w2[0], hidden))

    _, ends = run(torch.tensor([0.0, 1.0], dtype=torch.float64))
    whole = float(code @ (ends[:, 1] - ends[:, 0]))
    panels = 8
    while True:
        nodes, weights = _quadrature(panels)
        hidden, output = run(nodes)
        delta = first.slope(hidden) * (layers.w2[0].T @ (second.slope(output) * code[:, None]))
        found = (features - mean) * (layers.w1[0].T @ (delta @ weights)).numpy()
        if abs(found.sum() - whole) <= COMPLETE or panels >= _MOST_PANELS:
            return found
        panels *= 4


def bands_of(model: Model, contribution: np.ndarray) -> tuple[Band, ...]:
    """Contributions (count,) summed over BANDS bands, over all channels; a band without a feature is left out."""
    frequencies = model.features.frequencies(model.sample_rate)
    frequencies = np.tile(frequencies, len(contribution) // len(frequencies))
    edges = np.linspace(frequencies[0], frequencies[-1], BANDS + 1)
    places = np.clip(np.searchsorted(edges, frequencies, side="right") - 1, 0, BANDS - 1)
    sums = np.bincount(places, contribution, minlength=BANDS)
    return tuple(
        Band(float(edges[place]), float(edges[place + 1]), float(sums[place])) for place in np.unique(places).tolist()
    )


@cache
def _quadrature(panels: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Nodes and weights on [0, 1], each (panels · 16,)."""
    begins = np.arange(panels)[:, None] / panels
    nodes = (begins + (_NODES + 1) / (2 * panels)).ravel()
    return torch.from_numpy(nodes), torch.from_numpy(np.tile(_WEIGHTS / (2 * panels), panels))
