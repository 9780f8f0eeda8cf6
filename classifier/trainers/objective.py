"""What a training rule moves on: the error of a stack of networks over the calibration records.

With fewer records than features, the gradient by the first layer's weights lies in the span of the records:
∂E/∂W1 = Δ1 X. Whatever a rule builds from gradients, inner products and lengths stays in that span too, so
such a rule is run there, on the coordinates L of the records:

    X = L Qᵀ (Q orthonormal, as many columns as records),    W1(epoch) = W1(start) + (V(epoch) − V(start)) Qᵀ,
    V = W1 Q

This is a rotation: errors, lengths and inner products are those of all features, at the cost of the records.
The part of W1(start) outside the span does not reach the calibration records; to the control records it adds
a constant, the offset.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import NamedTuple, Protocol

import torch
from torch import Tensor
from torch.nn.functional import pad

from classifier.network import Mlp

TILE = 64
"""Networks evaluated in one go on a CPU: enough to outweigh the cost of a call, few enough for its cache."""


class Examples(NamedTuple):
    """Scaled features (m, inputs) and targets of the output nodes (m, outputs) of one subset, float64."""

    inputs: Tensor
    targets: Tensor


class Point(NamedTuple):
    """Where a stack of n networks stands: parameters (n, count), their mean square errors (n,) and gradients
    (n, count).
    """

    parameters: Tensor
    error: Tensor
    gradient: Tensor


class Objective(Protocol):
    """Any function of n rows of parameters, each row by itself."""

    def evaluate(self, parameters: Tensor) -> Point:
        """The point at parameters (n, count)."""
        ...


def keep(old: Point, new: Point, rows: Tensor) -> Point:
    """The new point, but the old one in the rows of a mask (n,)."""
    return Point(*(torch.where(rows.view(-1, *[1] * (a.ndim - 1)), a, b) for a, b in zip(old, new, strict=True)))


class Padded(NamedTuple):
    """Examples with rows and columns of zeros added to even numbers of both; `records` are real."""

    inputs: Tensor
    targets: Tensor
    records: int


class NetworkError:
    """Mean square error of networks over the calibration records, in the span of these where asked for.

    network, calibration  as the rule sees them; with the coordinates of the records for features where `in_span` is
                          asked for and there are fewer records than features
    width                 numbers per network that the rule moves; network.count, or one idle zero more

    Networks are evaluated TILE at a time, zeros for those missing, and all sizes are even: so each network meets the
    same arithmetic in the same order wherever it stands, and item i of a stack is bit for bit what it is alone.
    (Products of matrices are otherwise summed up in an order that depends on their sizes and alignment.) On a CUDA
    device there is one tile, and equality to rounding.
    """

    def __init__(self, network: Mlp, calibration: Examples, control: Examples, *, in_span: bool) -> None:
        self._full, self._control_features = network, control.inputs
        records, features = calibration.inputs.shape
        self._basis: Tensor | None = None
        if in_span and records < features:
            self._basis = _even_columns(torch.linalg.qr(calibration.inputs.T).Q)
        elif features % 2:
            self._basis = _even_columns(torch.eye(features).to(calibration.inputs))
        inputs = features if self._basis is None else self._basis.shape[1]
        self.network = dataclasses.replace(network, inputs=inputs)
        self.width = self.network.count + self.network.count % 2
        self.calibration, self._control = self._padded(calibration), self._padded(control)

    def _padded(self, examples: Examples) -> Padded:
        inputs = examples.inputs if self._basis is None else examples.inputs @ self._basis
        odd = len(inputs) % 2
        return Padded(pad(inputs, (0, 0, 0, odd)), pad(examples.targets, (0, 0, 0, odd)), len(inputs))

    def enter(self, parameters: Tensor) -> tuple[Tensor, Tensor | None]:
        """Parameters (n, width) that stand for those of whole networks (n, count), and the offset of each network on
        the control records.
        """
        # Copies, since a row's place in memory would else depend on its number.
        pairs = [self._enter_one(one[None].clone()) for one in parameters]
        working, offset = zip(*pairs, strict=True)
        return torch.cat(working), None if self._basis is None else torch.cat(offset)

    def _enter_one(self, parameters: Tensor) -> tuple[Tensor, Tensor | None]:
        idle = (0, self.width - self.network.count)
        if self._basis is None:
            return pad(parameters, idle), None
        w1, *others = self._full.layers(parameters)
        inside = w1 @ self._basis
        offset = (w1 - inside @ self._basis.T) @ self._control_features.T
        working = torch.cat([part.flatten(1) for part in (inside, *others)], dim=1)
        return pad(working, idle), pad(offset, (0, len(self._control.inputs) - self._control.records))

    def leave(self, parameters: Tensor, start: Tensor) -> Tensor:
        """Whole networks (n, count) that started at `start` (n, count) and have come to `parameters` (n, width)."""
        pairs = zip(parameters.split(1), start.split(1), strict=True)
        return torch.cat([self._leave_one(one.clone(), began.clone()) for one, began in pairs])

    def _leave_one(self, parameters: Tensor, start: Tensor) -> Tensor:
        if self._basis is None:
            return parameters[:, : self.network.count]
        w1, *others = self.network.layers(parameters)
        began = self._full.layers(start).w1
        w1 = began + (w1 - began @ self._basis) @ self._basis.T
        return torch.cat([part.flatten(1) for part in (w1, *others)], dim=1)

    def evaluate(self, parameters: Tensor) -> Point:
        """The point at parameters (n, width)."""
        network, (inputs, targets, records) = self.network, self.calibration
        error, gradient = parameters.new_empty(len(parameters)), torch.empty_like(parameters)
        gradient[:, network.count :] = 0.0
        for rows, tile in _tiles(parameters):
            layers = network.layers(tile)
            hidden, output = network.forward(layers, inputs)
            miss = output - targets.T
            if records % 2:
                miss[:, :, records:] = 0.0
            delta2 = network.functions[1].slope(output).mul_(miss).mul_(2 / (records * network.outputs))
            here = rows.stop - rows.start
            error[rows] = miss.square_().sum(dim=(1, 2))[:here] / (records * network.outputs)
            gradient[rows, : network.count] = network.backward(layers, inputs, hidden, delta2)[:here]
        return Point(parameters, error, gradient)

    def control_error(self, parameters: Tensor, offset: Tensor | None) -> Tensor:
        """Mean square errors (n,) over the control records."""
        network, (inputs, targets, records) = self.network, self._control
        error = parameters.new_empty(len(parameters))
        for rows, tile in _tiles(parameters):
            added, missing = None if offset is None else offset[rows], len(tile) - rows.stop + rows.start
            if added is not None and missing:
                added = pad(added, (0, 0, 0, 0, 0, missing))
            miss = network.forward(network.layers(tile), inputs, added).output - targets.T
            if records % 2:
                miss[:, :, records:] = 0.0
            error[rows] = miss.square_().sum(dim=(1, 2))[: rows.stop - rows.start] / (records * network.outputs)
        return error


def _even_columns(matrix: Tensor) -> Tensor:
    return pad(matrix, (0, matrix.shape[1] % 2))


def _tiles(parameters: Tensor) -> Iterator[tuple[slice, Tensor]]:
    """Rows of a stack and their parameters, filled up with zeros to whole tiles."""
    n = len(parameters)
    size = TILE if parameters.device.type == "cpu" else n
    for first in range(0, n, size):
        rows = slice(first, min(first + size, n))
        missing = first + size - rows.stop
        yield rows, pad(parameters[rows], (0, 0, 0, missing)) if missing else parameters[rows]
