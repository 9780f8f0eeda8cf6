"""Derivatives of every single output, for the rule that needs them.

J (n, outputs·m, count) holds ∂y/∂parameters, rows counted outputs first, then records; e (n, outputs·m) the
misses y − t in the same order. S = Σ e² = m · outputs · E has the gradient 2 Jᵀe and, near a good fit, the
Hessian 2 JᵀJ.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from classifier.network import Layers, Mlp
from classifier.trainers.objective import Padded


@dataclass(frozen=True)
class Linearised:
    """A stack of networks at their parameters (n, count): layers, values of the hidden nodes (n, hidden, m),
    slopes of the output nodes (n, outputs, m) and misses (n, outputs·m).
    """

    network: Mlp
    inputs: Tensor
    layers: Layers
    hidden: Tensor
    slope: Tensor
    miss: Tensor

    def by_hidden(self) -> Tensor:
        """Derivatives (n, outputs·m, hidden) of the outputs by the sums of the hidden nodes."""
        by_sum = self.layers.w2[:, :, :, None] * self.network.functions[0].slope(self.hidden)[:, None]
        return (by_sum * self.slope[:, :, None]).transpose(2, 3).flatten(1, 2)

    def jacobian(self) -> Tensor:
        """J, written out."""
        n, outputs, m = self.slope.shape
        rows = self.by_hidden()
        first = rows[:, :, :, None] * self.inputs.repeat(outputs, 1)[:, None, :]
        own = torch.eye(outputs, dtype=rows.dtype, device=rows.device)[:, None, :] * self.slope[:, :, :, None]
        second = own[..., None] * self.hidden.transpose(1, 2)[:, None, :, None, :]
        blocks = (first.flatten(2), rows, second.reshape(n, outputs * m, -1), own.reshape(n, outputs * m, -1))
        return torch.cat(blocks, dim=2)

    def gram(self) -> Tensor:
        """J Jᵀ (n, outputs·m, outputs·m) without J: two outputs share the first layer, and where they belong
        to the same node the second.
        """
        n, outputs, m = self.slope.shape
        rows = self.by_hidden()
        gram = (rows @ rows.transpose(1, 2)).view(n, outputs, m, outputs, m)
        gram *= (self.inputs @ self.inputs.T + 1)[:, None, :]
        same = self.hidden.transpose(1, 2) @ self.hidden + 1
        for k in range(outputs):
            gram[:, k, :, k, :] += same * self.slope[:, k, :, None] * self.slope[:, k, None, :]
        return gram.reshape(n, outputs * m, outputs * m)

    def back(self, v: Tensor) -> Tensor:
        """Jᵀ v (n, count) for v (n, outputs·m), by back-propagation."""
        into = v.new_empty(len(v), self.network.count)
        return self.network.backward(self.layers, self.inputs, self.hidden, self.slope * v.view_as(self.slope), into)


def linearised(network: Mlp, parameters: Tensor, examples: Padded) -> Linearised:
    """A stack at its parameters (n, count), with the misses on examples."""
    layers = network.layers(parameters)
    hidden, output = network.forward(layers, examples.inputs)
    slope, miss = network.functions[1].slope(output), output - examples.targets.T
    for part in (slope, miss):
        part[:, :, examples.records :] = 0.0
    return Linearised(network, examples.inputs, layers, hidden, slope, miss.flatten(1))
