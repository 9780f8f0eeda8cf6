"""The network: one hidden layer, logistic both times, written for a whole stack of networks at once.

A stack of n networks of one shape is a matrix of parameters (n, count); row i holds network i:

    [ W1 (hidden × inputs) | b1 (hidden) | W2 (outputs × hidden) | b2 (outputs) ],  matrices row by row

so that a training rule moves rows and never needs to know about layers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from indexer_env.checks import check_integer


class Layers(NamedTuple):
    """The four parameter blocks of a stack of n networks, as views of its parameter matrix."""

    w1: Tensor  # (n, hidden, inputs)
    b1: Tensor  # (n, hidden)
    w2: Tensor  # (n, outputs, hidden)
    b2: Tensor  # (n, outputs)


@dataclass(frozen=True)
class Mlp:
    """Three-layer feed-forward network (paper §3, §4.1).

        y = σ(W2 σ(W1 x + b1) + b2),   σ(s) = 1 / (1 + e^(−s))

    inputs, hidden, outputs  number of features, hidden nodes and output nodes

    Raises ParameterError.
    """

    inputs: int
    hidden: int
    outputs: int

    def __post_init__(self) -> None:
        for name in ("inputs", "hidden", "outputs"):
            check_integer("Mlp", name, getattr(self, name), low=1)

    @property
    def count(self) -> int:
        """Number of parameters of one network."""
        return self.hidden * (self.inputs + 1) + self.outputs * (self.hidden + 1)

    def layers(self, parameters: Tensor) -> Layers:
        """Views of a stack's parameters (n, count) as weights and biases."""
        sizes = (self.hidden * self.inputs, self.hidden, self.outputs * self.hidden, self.outputs)
        w1, b1, w2, b2 = parameters.split(sizes, dim=1)
        return Layers(w1.unflatten(1, (self.hidden, -1)), b1, w2.unflatten(1, (self.outputs, -1)), b2)

    def initial(self, networks: int, generator: torch.Generator) -> Tensor:
        """Random start of a stack, float64 (networks, count), by the rule of Nguyen and Widrow.

        For a layer of H nodes with N inputs in [−1, 1] and hyperbolic tangents, the rule draws each weight
        vector in a random direction with length 0.7 H^(1/N) and each bias uniformly within ± that length, so
        that the active parts of the nodes share the input space. Inputs here lie in [0, 1] and
        σ(2z) = (1 + tanh z) / 2, hence W = 4 W' and b = 2 (b' − Σ W').

        Networks are drawn one after the other: the first ones do not depend on how many follow.
        Source: D. Nguyen, B. Widrow, Proc. IJCNN 3 (1990) 21–26.
        """
        rows = []
        for _ in range(networks):
            blocks = []
            for nodes, inputs in ((self.hidden, self.inputs), (self.outputs, self.hidden)):
                length = 0.7 * nodes ** (1 / inputs)
                # uniform in ±1 per weight, then normalised; uniform in ±length per bias
                w = 2 * torch.rand(nodes, inputs, generator=generator, dtype=torch.float64) - 1
                b = length * (2 * torch.rand(nodes, generator=generator, dtype=torch.float64) - 1)
                w = length * w / w.norm(dim=1, keepdim=True)
                blocks += [(4 * w).flatten(), 2 * (b - w.sum(dim=1))]
            rows.append(torch.cat(blocks))
        return torch.stack(rows)

    def _forward(self, layers: Layers, inputs: Tensor) -> tuple[Tensor, Tensor]:
        """Hidden (n, hidden, m) and output (n, outputs, m) values; the first layers of all networks are one
        product.
        """
        n = len(layers.b1)
        hidden = layers.w1.reshape(n * self.hidden, self.inputs) @ inputs.T
        hidden = torch.sigmoid(hidden.view(n, self.hidden, -1) + layers.b1[:, :, None])
        return hidden, torch.sigmoid(torch.baddbmm(layers.b2[:, :, None], layers.w2, hidden))

    def outputs_of(self, parameters: Tensor, inputs: Tensor) -> Tensor:
        """Outputs (n, m, outputs), each in [0, 1], of a stack for inputs (m, inputs)."""
        return self._forward(self.layers(parameters), inputs)[1].transpose(1, 2)

    def error(self, parameters: Tensor, inputs: Tensor, targets: Tensor) -> Tensor:
        """Mean square error (n,) over the m rows and all outputs, for inputs (m, inputs) and targets (m,
        outputs).
        """
        return (self._forward(self.layers(parameters), inputs)[1] - targets.T).square().mean(dim=(1, 2))

    def error_and_gradient(self, parameters: Tensor, inputs: Tensor, targets: Tensor) -> tuple[Tensor, Tensor]:
        """Mean square error E (n,) and ∂E/∂parameters (n, count), by back-propagation.

        Δ2 = 2/(m·outputs) (y − t) y (1 − y)      ∂E/∂W2 = Δ2 hᵀ    ∂E/∂b2 = Σ Δ2
        Δ1 = W2ᵀ Δ2 · h (1 − h)                   ∂E/∂W1 = Δ1 xᵀ    ∂E/∂b1 = Σ Δ1
        """
        layers = self.layers(parameters)
        n, m = len(parameters), len(inputs)
        h, y = self._forward(layers, inputs)
        miss = y - targets.T
        delta2 = (2 / (m * self.outputs)) * miss * y * (1 - y)
        delta1 = layers.w2.transpose(1, 2) @ delta2 * h * (1 - h)
        blocks = (
            (delta1.reshape(n * self.hidden, m) @ inputs).view(n, -1),
            delta1.sum(dim=2),
            (delta2 @ h.transpose(1, 2)).flatten(1),
            delta2.sum(dim=2),
        )
        return miss.square().mean(dim=(1, 2)), torch.cat(blocks, dim=1)
