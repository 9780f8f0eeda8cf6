"""The network: one hidden layer, written for a whole stack of networks at once.

A stack of n networks of one shape is a matrix of parameters (n, count); row i holds network i:

    [ W1 (hidden × inputs) | b1 (hidden) | W2 (outputs × hidden) | b2 (outputs) ],  matrices row by row

so that a training rule moves rows and never needs to know about layers.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import refuse


class Layers(NamedTuple):
    """The four parameter blocks of a stack of n networks, as views of its parameter matrix."""

    w1: Tensor  # (n, hidden, inputs)
    b1: Tensor  # (n, hidden)
    w2: Tensor  # (n, outputs, hidden)
    b2: Tensor  # (n, outputs)


class Activity(NamedTuple):
    """Values of all nodes of a stack of n networks for m rows of inputs."""

    hidden: Tensor  # (n, hidden, m)
    output: Tensor  # (n, outputs, m)


class Scratch(threading.local):
    """Tensors for values that are soon forgotten, kept and written anew, as the system first clears fresh memory. Each
    thread has its own.
    """

    def __init__(self) -> None:
        self._tensors: dict[object, Tensor] = {}

    def __call__(self, name: str, like: Tensor, *shape: int) -> Tensor:
        """A tensor of this shape, of the kind of another one, with any content: in the memory of the last of this
        name, if that is large enough."""
        key, size = (name, like.dtype, like.device), math.prod(shape)
        if key not in self._tensors or len(self._tensors[key]) < size:
            self._tensors[key] = like.new_empty(size)
        return self._tensors[key][:size].view(shape)


class Activation(NamedTuple):
    """Function of a layer's nodes.

    in_place  replaces the sums s of a tensor by f(s) and returns it
    slope     f′(s), given f(s); written into the tensor `out` where one is given
    steepness f(s) is a shifted and scaled tanh(s / steepness): 1 for the hyperbolic tangent itself
    low, high least and greatest value
    """

    in_place: Callable[[Tensor], Tensor]
    slope: Callable[..., Tensor]
    steepness: float
    low: float
    high: float


def _logistic_slope(y: Tensor, out: Tensor | None = None) -> Tensor:
    return torch.addcmul(y, y, y, value=-1, out=out)


def _tanh_slope(y: Tensor, out: Tensor | None = None) -> Tensor:
    return torch.mul(y, y, out=out).neg_().add_(1)


def _linear_slope(y: Tensor, out: Tensor | None = None) -> Tensor:
    return torch.ones_like(y) if out is None else out.fill_(1)


ACTIVATIONS = {
    "logistic": Activation(torch.Tensor.sigmoid_, _logistic_slope, 2.0, 0.0, 1.0),
    "tanh": Activation(torch.Tensor.tanh_, _tanh_slope, 1.0, -1.0, 1.0),
    "linear": Activation(lambda s: s, _linear_slope, 1.0, -torch.inf, torch.inf),
}
"""σ(s) = 1 / (1 + e^(−s)), tanh(s) and s; the last one is for outputs only."""

TARGETS = {"binary": (0.0, 1.0), "bipolar": (-1.0, 1.0)}
"""Target of an output node where the bit is 0 and where it is 1 (paper fig. 7)."""


@dataclass(frozen=True)
class Mlp:
    """Three-layer feed-forward network (paper §3, §4.1).

        y = f2(W2 f1(W1 x + b1) + b2)

    inputs, hidden, outputs  number of features, hidden nodes and output nodes
    hidden_function          f1, "logistic" or "tanh"
    output_function          f2, "logistic", "tanh" or "linear" (paper fig. 8: logistic or linear)
    targets                  "binary" (0, 1) or "bipolar" (−1, 1): what the output nodes learn for a bit; a
                             logistic output cannot reach −1 and is refused

    Raises ParameterError.
    """

    inputs: int
    hidden: int
    outputs: int
    hidden_function: str = "logistic"
    output_function: str = "logistic"
    targets: str = "binary"

    def __post_init__(self) -> None:
        for name in ("inputs", "hidden", "outputs"):
            check_integer("Mlp", name, getattr(self, name), low=1)
        check_choice("Mlp", "hidden_function", self.hidden_function, [name for name in ACTIVATIONS if name != "linear"])
        check_choice("Mlp", "output_function", self.output_function, ACTIVATIONS)
        check_choice("Mlp", "targets", self.targets, TARGETS)
        if ACTIVATIONS[self.output_function].low > TARGETS[self.targets][0]:
            rule = "one that reaches bipolar targets, −1 and 1"
            raise refuse("Mlp", "output_function", rule, self.output_function, "use 'tanh' or 'linear'")

    @property
    def count(self) -> int:
        """Number of parameters of one network."""
        return self.hidden * (self.inputs + 1) + self.outputs * (self.hidden + 1)

    @property
    def functions(self) -> tuple[Activation, Activation]:
        """f1 and f2."""
        return ACTIVATIONS[self.hidden_function], ACTIVATIONS[self.output_function]

    @property
    def span(self) -> float:
        """Distance of the targets of 0 and 1; a mean square error of them is its square times that of the bits."""
        low, high = TARGETS[self.targets]
        return high - low

    def targets_of(self, bits: Tensor) -> Tensor:
        """Targets of the output nodes for bits of 0 and 1, any shape."""
        low, high = TARGETS[self.targets]
        return low + (high - low) * bits

    def bits_of(self, outputs: Tensor) -> Tensor:
        """Inverse of `targets_of`, for outputs of any value: what they say on the scale of the bits."""
        low, high = TARGETS[self.targets]
        return (outputs - low) / (high - low)

    def layers(self, parameters: Tensor) -> Layers:
        """Views of a stack's parameters (n, count or more) as weights and biases; further columns are not used."""
        sizes = (self.hidden * self.inputs, self.hidden, self.outputs * self.hidden, self.outputs)
        w1, b1, w2, b2 = parameters[:, : self.count].split(sizes, dim=1)
        return Layers(w1.unflatten(1, (self.hidden, -1)), b1, w2.unflatten(1, (self.outputs, -1)), b2)

    def initial(self, networks: int, generator: torch.Generator) -> Tensor:
        """Random start of a stack, float64 (networks, count), by the rule of Nguyen and Widrow.

        For a layer of H nodes with N inputs in [−1, 1] and hyperbolic tangents, the rule draws each weight
        vector in a random direction with length 0.7 H^(1/N) and each bias uniformly within ± that length, so
        that the active parts of the nodes share the input space. With inputs in [0, 1] and functions
        f(s) ~ tanh(s / c) (c = 2 for the logistic function) the same holds for W = 2c W' and
        b = c (b' − Σ W'); with inputs in [−1, 1] for W = c W' and b = c b'. Linear outputs take c = 1.

        Networks are drawn one after the other: the first ones do not depend on how many follow.
        Source: D. Nguyen, B. Widrow, Proc. IJCNN 3 (1990) 21–26.
        """
        first, second = self.functions
        shapes = (
            (self.hidden, self.inputs, first.steepness, False),
            (self.outputs, self.hidden, second.steepness, first.low < 0),
        )
        rows = []
        for _ in range(networks):
            blocks = []
            for nodes, inputs, steepness, bipolar in shapes:
                length = 0.7 * nodes ** (1 / inputs)
                # uniform in ±1 per weight, then normalised; uniform in ±length per bias
                w = 2 * torch.rand(nodes, inputs, generator=generator, dtype=torch.float64) - 1
                b = length * (2 * torch.rand(nodes, generator=generator, dtype=torch.float64) - 1)
                w = length * w / w.norm(dim=1, keepdim=True)
                if bipolar:
                    blocks += [(steepness * w).flatten(), steepness * b]
                else:
                    blocks += [(2 * steepness * w).flatten(), steepness * (b - w.sum(dim=1))]
            rows.append(torch.cat(blocks))
        return torch.stack(rows)

    def forward(
        self, layers: Layers, inputs: Tensor, offset: Tensor | None = None, scratch: Scratch | None = None
    ) -> Activity:
        """Values of all nodes for inputs (m, inputs); the first layers of all networks are one product.

        offset   (n, hidden, k), added to W1 x of the last k rows where given
        scratch  where the values are kept until it is used for other ones; None: in tensors of their own
        """
        n, m, room = len(layers.b1), len(inputs), Scratch() if scratch is None else scratch
        first, second = self.functions
        w1 = room("w1", inputs, n, self.hidden, self.inputs).copy_(layers.w1)
        hidden = room("hidden", inputs, n, self.hidden, m)
        torch.mm(w1.view(n * self.hidden, -1), inputs.T, out=hidden.view(n * self.hidden, m))
        hidden.add_(layers.b1[:, :, None])
        if offset is not None:
            hidden[:, :, -offset.shape[2] :].add_(offset)
        hidden = first.in_place(hidden)
        output = room("output", inputs, n, self.outputs, m)
        torch.baddbmm(layers.b2[:, :, None], layers.w2, hidden, out=output)
        return Activity(hidden, second.in_place(output))

    def backward(
        self,
        layers: Layers,
        inputs: Tensor,
        hidden: Tensor,
        delta2: Tensor,
        into: Tensor,
        scratch: Scratch | None = None,
    ) -> Tensor:
        """Derivatives by the parameters of a quantity whose derivatives by the sums of the output nodes are delta2
        (n, outputs, m), by back-propagation.

        into     (n or fewer, count or more): where those of the first networks are written; given back
        scratch  for what is needed on the way; None: new tensors

        ∂/∂W2 = Δ2 hᵀ    ∂/∂b2 = Σ Δ2    Δ1 = W2ᵀ Δ2 · f1′    ∂/∂W1 = Δ1 xᵀ    ∂/∂b1 = Σ Δ1
        """
        n, m, room = len(delta2), len(inputs), Scratch() if scratch is None else scratch
        delta1 = torch.bmm(layers.w2.transpose(1, 2), delta2, out=room("delta1", inputs, n, self.hidden, m))
        delta1.mul_(self.functions[0].slope(hidden, out=room("slope1", inputs, n, self.hidden, m)))
        by_w1 = room("by w1", inputs, n, self.hidden, self.inputs)
        torch.mm(delta1.view(n * self.hidden, m), inputs, out=by_w1.view(n * self.hidden, -1))
        blocks = (
            by_w1,
            delta1.sum(dim=2),
            delta2 @ hidden.transpose(1, 2),
            delta2.sum(dim=2),
        )
        for place, block in zip(self.layers(into), blocks, strict=True):
            place.copy_(block[: len(into)])
        return into

    def outputs_of(self, parameters: Tensor, inputs: Tensor) -> Tensor:
        """Outputs (n, m, outputs) of a stack for inputs (m, inputs)."""
        return self.forward(self.layers(parameters), inputs).output.transpose(1, 2)
