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
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar

import torch
from torch import Tensor
from torch.nn.functional import pad

from classifier.network import Activity, Layers, Mlp, Scratch

TILE = 64
"""Networks evaluated in one go on a CPU: enough to outweigh the cost of a call, few enough for its cache."""


class Examples(NamedTuple):
    """Scaled features (m, inputs) and targets of the output nodes (m, outputs) of one subset."""

    inputs: Tensor
    targets: Tensor


class Point(NamedTuple):
    """Where a stack of n networks stands: parameters (n, count), their mean square errors (n,) and gradients
    (n, count).
    """

    parameters: Tensor
    error: Tensor
    gradient: Tensor


class Judged(NamedTuple):
    """A point with its mean square errors (n,) on the control subset."""

    parameters: Tensor
    error: Tensor
    gradient: Tensor
    control: Tensor


AnyPoint = TypeVar("AnyPoint", Point, Judged)


class Objective(Protocol):
    """Any function of n rows of parameters, each row by itself."""

    def evaluate(self, parameters: Tensor) -> Point:
        """The point at parameters (n, count)."""
        ...


class RoomyObjective(Protocol):
    """An objective that is told where to leave its gradients."""

    def evaluate(self, parameters: Tensor, room: Tensor | None = None) -> Point:
        """The point at parameters (n, count); its gradient is written into `room` of that shape where given."""
        ...


def keep(old: AnyPoint, new: AnyPoint, rows: Tensor) -> AnyPoint:
    """The new point, but the old one in the rows of a mask (n,)."""
    return type(new)(*(torch.where(rows.view(-1, *[1] * (a.ndim - 1)), a, b) for a, b in zip(old, new, strict=True)))


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
        self._both = torch.cat([self.calibration.inputs, self._control.inputs])
        self._scratch = Scratch()

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

    def evaluate(self, parameters: Tensor, room: Tensor | None = None) -> Point:
        """The point at parameters (n, width); its gradient is written into `room` (n, width) where given."""
        error, gradient = self._empty(parameters, room)
        for rows, tile in _tiles(parameters):
            layers = self.network.layers(tile)
            activity = self.network.forward(layers, self.calibration.inputs, scratch=self._scratch)
            self._descend(layers, activity, error[rows], gradient[rows])
        return Point(parameters, error, gradient)

    def judge(self, parameters: Tensor, offset: Tensor | None, room: Tensor | None = None) -> Judged:
        """The point at parameters (n, width) and its errors on the control records, by one product for both subsets."""
        error, gradient = self._empty(parameters, room)
        control, taught = torch.empty_like(error), len(self.calibration.inputs)
        for rows, tile in _tiles(parameters):
            layers = self.network.layers(tile)
            hidden, output = self.network.forward(layers, self._both, _filled(offset, rows, len(tile)), self._scratch)
            control[rows] = self._mean_square(output[:, :, taught:], self._control)[1][: rows.stop - rows.start]
            self._descend(layers, Activity(hidden[:, :, :taught], output[:, :, :taught]), error[rows], gradient[rows])
        return Judged(parameters, error, gradient, control)

    def control_error(self, parameters: Tensor, offset: Tensor | None) -> Tensor:
        """Mean square errors (n,) over the control records."""
        error = parameters.new_empty(len(parameters))
        for rows, tile in _tiles(parameters):
            layers = self.network.layers(tile)
            output = self.network.forward(
                layers, self._control.inputs, _filled(offset, rows, len(tile)), self._scratch
            ).output
            error[rows] = self._mean_square(output, self._control)[1][: rows.stop - rows.start]
        return error

    def _empty(self, parameters: Tensor, room: Tensor | None) -> tuple[Tensor, Tensor]:
        """Room for errors and gradients; the idle numbers of a gradient are zero."""
        gradient = torch.empty_like(parameters) if room is None else room
        gradient[:, self.network.count :] = 0.0
        return parameters.new_empty(len(parameters)), gradient

    def _mean_square(self, output: Tensor, examples: Padded) -> tuple[Tensor, Tensor]:
        """Misses (n, outputs, m), zero where padded, and mean square errors (n,)."""
        miss = output - examples.targets.T
        if examples.records % 2:
            miss[:, :, examples.records :] = 0.0
        return miss, miss.square().sum(dim=(1, 2)) / (examples.records * self.network.outputs)

    def _descend(self, layers: Layers, activity: Activity, error: Tensor, gradient: Tensor) -> None:
        """Write errors and gradients of a tile's networks, as many as there is room for."""
        network, (inputs, _, records) = self.network, self.calibration
        miss, mean_square = self._mean_square(activity.output, self.calibration)
        error.copy_(mean_square[: len(error)])
        delta2 = miss.mul_(network.functions[1].slope(activity.output)).mul_(2 / (records * network.outputs))
        network.backward(layers, inputs, activity.hidden, delta2, gradient, self._scratch)


@dataclass(frozen=True)
class JudgedError:
    """The error of a stack of networks with these offsets, which tells the control error of every point as well."""

    error: NetworkError
    offset: Tensor | None

    def evaluate(self, parameters: Tensor, room: Tensor | None = None) -> Judged:
        """The point at parameters (n, width), one row for each offset."""
        return self.error.judge(parameters, self.offset, room)


def _filled(offset: Tensor | None, rows: slice, size: int) -> Tensor | None:
    """The offsets of some rows, filled up with zeros to a whole tile."""
    if offset is None:
        return None
    missing = size - rows.stop + rows.start
    return pad(offset[rows], (0, 0, 0, 0, 0, missing)) if missing else offset[rows]


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
