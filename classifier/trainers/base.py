"""What all training rules share: the loop over epochs, early stopping, and the leaving of those that are
done.

A rule is a frozen dataclass of its numbers that says how to `begin` and how to take one `step`; everything it
must remember between steps is a NamedTuple of tensors whose first axis counts networks. Each network lives
its own life: its error, its step size and its end depend on no other row, so that training it alone gives the
same network.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import torch
from torch import Tensor

from classifier.network import Mlp
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse


class Examples(NamedTuple):
    """Scaled features (m, inputs) and target outputs (m, outputs) of one subset, float64."""

    inputs: Tensor
    targets: Tensor


class Point(NamedTuple):
    """Where a stack of n networks stands: parameters (n, count), their mean square errors (n,) and gradients
    (n, count).
    """

    parameters: Tensor
    error: Tensor
    gradient: Tensor


@dataclass(frozen=True)
class Training:
    """What a training leaves of a stack of n networks; epoch 0 is the start.

    parameters         (n, count) float64 of each network at the epoch of its lowest control error
    best_epoch         (n,) that epoch
    epochs             (n,) epochs trained
    stopped_by         n words: "control" (early stopping), "epochs", "goal" or "gradient"
    calibration_error  (epochs + 1, n) mean square errors, NaN after a network has stopped
    control_error      (epochs + 1, n) the same on the control subset
    """

    parameters: Tensor
    best_epoch: np.ndarray
    epochs: np.ndarray
    stopped_by: tuple[str, ...]
    calibration_error: np.ndarray
    control_error: np.ndarray

    @property
    def best(self) -> int:
        """The network with the lowest control error (paper §4.1: "performance rating")."""
        return int(np.argmin(np.nanmin(self.control_error, axis=0)))


@dataclass(frozen=True)
class Trainer(ABC):
    """A training rule with its stopping rules.

    epochs            most epochs
    patience          epochs without a new lowest control error after which a network stops (early stopping,
                      paper §4.1)
    goal              calibration error (mean square) at which a network stops
    minimum_gradient  length of the gradient below which a network stops

    Raises ParameterError.
    """

    kind: ClassVar[str]

    epochs: int = 2000
    patience: int = 50
    goal: float = 0.0
    minimum_gradient: float = 1e-7

    def __post_init__(self) -> None:
        owner = type(self).__name__
        check_integer(owner, "epochs", self.epochs, low=1)
        check_integer(owner, "patience", self.patience, low=1)
        check_number(owner, "goal", self.goal, low=0.0)
        check_number(owner, "minimum_gradient", self.minimum_gradient, low=0.0)

    @abstractmethod
    def begin(self, point: Point) -> Any:
        """Memory of the rule before the first step: a NamedTuple of tensors with first axis n."""

    @abstractmethod
    def step(self, at: Point, memory: Any, evaluate: Callable[[Tensor], Point]) -> tuple[Point, Any]:
        """One epoch: the next point (which may be the same where a step is refused) and the memory after
        it.
        """

    def train(
        self,
        network: Mlp,
        parameters: Tensor,
        calibration: Examples,
        control: Examples,
        progress: Callable[[int, float], None] | None = None,
    ) -> Training:
        """Train a stack from its initial parameters (n, count) on one calibration subset.

        control   subset that is only looked at: it decides when to stop and which epoch is kept
        progress  called after each epoch with its number and the lowest control error so far

        Raises ParameterError for an empty subset.
        """
        for name, examples in (("calibration", calibration), ("control", control)):
            if len(examples.inputs) == 0:
                raise refuse(type(self).__name__, name, "a subset with at least one record", "none")

        def evaluate(candidates: Tensor) -> Point:
            return Point(candidates, *network.error_and_gradient(candidates, *calibration))

        at = evaluate(parameters)
        memory = self.begin(at)
        control_error = network.error(at.parameters, *control)
        n = len(parameters)
        alive = np.arange(n)  # which network each row of the working stack is
        kept, lowest = at.parameters.clone(), control_error.clone()
        best_epoch, epochs, stopped_by = np.zeros(n, int), np.zeros(n, int), ["epochs"] * n
        history = np.full((2, self.epochs + 1, n), np.nan)
        history[:, 0] = at.error, control_error

        for epoch in range(1, self.epochs + 1):
            at, memory = self.step(at, memory, evaluate)
            control_error = network.error(at.parameters, *control)
            epochs[alive] = epoch
            history[:, epoch, alive] = at.error, control_error
            better = control_error < lowest[alive]
            rows = alive[better.numpy()]
            kept[rows], lowest[rows], best_epoch[rows] = at.parameters[better], control_error[better], epoch

            reasons = (
                ("goal", at.error <= self.goal),
                ("gradient", at.gradient.norm(dim=1) < self.minimum_gradient),
                ("control", torch.from_numpy(epoch - best_epoch[alive] >= self.patience)),
            )
            going = torch.ones(len(alive), dtype=torch.bool)
            for reason, stops in reasons:
                for row in alive[(going & stops).numpy()]:
                    stopped_by[row] = reason
                going &= ~stops
            if progress is not None:
                progress(epoch, float(lowest.min()))
            if not going.all():
                alive = alive[going.numpy()]
                at = Point(*(part[going] for part in at))
                memory = type(memory)(*(part[going] for part in memory))
            if len(alive) == 0:
                break

        last = int(epochs.max()) + 1
        return Training(kept, best_epoch, epochs, tuple(stopped_by), history[0, :last], history[1, :last])
