"""What all training rules share: the loop over epochs, early stopping, and the leaving of those that are
done.

A rule is a frozen dataclass of its numbers that says how to `begin` and how to take one `step`; everything it
must remember between steps is a (nested) NamedTuple of tensors whose first axis counts networks. Each network
lives its own life: its error, its step size and its end depend on no other row, so that training it alone
gives the same network bit for bit.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
import torch
from torch import Tensor

from classifier.network import Mlp
from classifier.trainers.objective import Examples, Judged, JudgedError, NetworkError, Point
from indexer_env.checks import check_choice, check_integer, check_number
from indexer_env.errors import refuse

STACK = 256
"""Most networks moved at once by one thread: few enough for the processor's cache, and enough that two threads seldom
wait for the interpreter between two products."""

MEMORY = 2**30
"""Bytes that the stacks of all threads may take together; one network per thread is always trained."""


class Step(NamedTuple):
    """What one epoch of a rule gives: the next point, the rule's memory after it, and a mask (n,) of the
    networks that the rule can move no further.
    """

    point: Point
    memory: Any
    stuck: Tensor


@dataclass(frozen=True)
class Training:
    """What a training leaves of a stack of n networks; epoch 0 is the start.

    parameters         (n, count) of each network at the epoch of its lowest control error
    best_epoch         (n,) that epoch
    epochs             (n,) epochs trained
    stopped_by         n words: "control" (early stopping), "epochs", "goal", "gradient" or "step" (the rule
                       finds no step that lowers the error)
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
    goal              calibration error (mean square, on the scale of the targets) at which a network stops
    minimum_gradient  length of the gradient below which a network stops
    precision         "float64", or "float32" for rules of first order: nearly half the time

    Raises ParameterError.
    """

    kind: ClassVar[str]
    first_order: ClassVar[bool] = False
    """Whether the rule goes by the gradient alone and so bears single precision; line searches and second derivatives
    by differences do not."""
    one_point: ClassVar[bool] = False
    """Whether each step evaluates one point, at which it ends or which it gives up: then the control error is had by
    the same product."""
    in_span: ClassVar[bool] = True
    """Whether the rule knows parameters by inner products and lengths alone, so that a rotation of the
    features changes nothing (see `objective`)."""

    epochs: int = 2000
    patience: int = 20
    goal: float = 0.0
    minimum_gradient: float = 1e-7
    precision: str = "float64"

    def __post_init__(self) -> None:
        owner = type(self).__name__
        check_integer(owner, "epochs", self.epochs, low=1)
        check_integer(owner, "patience", self.patience, low=1)
        check_number(owner, "goal", self.goal, low=0.0)
        check_number(owner, "minimum_gradient", self.minimum_gradient, low=0.0)
        check_choice(owner, "precision", self.precision, ("float64", "float32") if self.first_order else ("float64",))

    @abstractmethod
    def begin(self, point: Point) -> Any:
        """Memory of the rule before the first step: a NamedTuple of tensors with first axis n."""

    @abstractmethod
    def step(self, at: Point, memory: Any, objective: Any) -> Step:
        """One epoch: the next point (which may be the same where a step is refused) and what comes with it."""

    def memory_of_one(self, network: Mlp, records: int) -> int:
        """Bytes that one network of a stack takes, about: here some ten vectors of its parameters and its
        activity.
        """
        return 8 * (10 * network.count + 4 * records * (network.hidden + network.outputs))

    def train(
        self,
        network: Mlp,
        parameters: Tensor,
        calibration: Examples,
        control: Examples,
        progress: Callable[[int, float], None] | None = None,
    ) -> Training:
        """Train n networks from their initial parameters (n, count) on one calibration subset.

        control   subset that is only looked at: it decides when to stop and which epoch is kept
        progress  called with the number of epochs and the lowest control error so far, when either has
                  changed

        The networks are trained on the device of `parameters`, in stacks of at most STACK networks and MEMORY bytes, on
        the CPU by as many threads as the tensor library has (`torch.set_num_threads`). What comes back has the
        precision of `parameters`.

        Raises ParameterError for an empty subset.
        """
        for name, examples in (("calibration", calibration), ("control", control)):
            if len(examples.inputs) == 0:
                raise refuse(type(self).__name__, name, "a subset with at least one record", "none")
        precision = getattr(torch, self.precision)
        subsets = (Examples(*(part.to(precision) for part in subset)) for subset in (calibration, control))
        objective = NetworkError(network, *subsets, in_span=self.in_span)
        record = _Record(parameters.to(precision), self.epochs, progress)
        threads = torch.get_num_threads() if parameters.device.type == "cpu" else 1
        one = self.memory_of_one(objective.network, len(calibration.inputs) + len(control.inputs))
        most = max(1, MEMORY // (threads * one))
        if parameters.device.type == "cpu":
            most = min(most, STACK, -(-len(parameters) // threads))
        stacks = np.split(np.arange(len(parameters)), range(most, len(parameters), most))

        # A thread works on a stack of its own: so small products gain nothing from being shared out.
        pool = ThreadPoolExecutor(min(threads, len(stacks)), initializer=torch.set_num_threads, initargs=(1,))
        try:
            for _ in pool.map(lambda rows: self._train_stack(objective, rows, record), stacks):
                pass
        finally:
            record.abandoned = True
            pool.shutdown(cancel_futures=True)
            torch.set_num_threads(threads)
        training = record.training()
        return replace(training, parameters=training.parameters.to(parameters.dtype))

    @torch.inference_mode()
    def _train_stack(self, objective: NetworkError, alive: np.ndarray, record: _Record) -> None:
        """Train the networks `alive`, rows of the record, as one stack until each is done."""
        working, offset = objective.enter(record.start[alive])
        at: Any = self._seen(objective, offset).evaluate(working)
        memory = self.begin(at)
        control_error = _control_error(objective, at, offset)
        lowest, kept, since = control_error, working.clone(), np.zeros(len(alive), int)
        record.look(0, alive, at.error, control_error)

        for epoch in range(1, self.epochs + 1):
            at, memory, stuck = self.step(at, memory, self._seen(objective, offset))
            control_error = _control_error(objective, at, offset)
            record.look(epoch, alive, at.error, control_error)
            better = control_error < lowest
            lowest = torch.where(better, control_error, lowest)
            torch.where(better[:, None], at.parameters, kept, out=kept)
            since = np.where(better.cpu().numpy(), 0, since + 1)

            reasons = {
                "goal": at.error <= self.goal,
                "gradient": at.gradient.norm(dim=1) < self.minimum_gradient,
                "step": stuck,
                "control": torch.from_numpy(since >= self.patience).to(stuck.device),
                "epochs": torch.full_like(stuck, epoch == self.epochs),
            }
            done = torch.stack(list(reasons.values())).any(dim=0)
            record.tell(epoch, lowest)
            if not done.any():
                continue
            leave, stay = done.cpu().numpy(), ~done
            words = [next(word for word, mask in reasons.items() if mask[i]) for i in np.flatnonzero(leave)]
            whole = objective.leave(kept[done], record.start[alive[leave]])
            record.close(alive[leave], whole, epoch, epoch - since[leave], words)
            alive, since = alive[~leave], since[~leave]
            if len(alive) == 0 or record.abandoned:
                return
            at, memory, lowest, kept, offset = rows_of((at, memory, lowest, kept, offset), stay)

    def _seen(self, objective: NetworkError, offset: Tensor | None) -> NetworkError | JudgedError:
        """What the rule itself evaluates."""
        return JudgedError(objective, offset) if self.one_point else objective


def _control_error(objective: NetworkError, at: Point | Judged, offset: Tensor | None) -> Tensor:
    return at.control if isinstance(at, Judged) else objective.control_error(at.parameters, offset)


def rows_of(tensors: Any, rows: Tensor) -> Any:
    """The rows (a mask) of tensors in nested tuples; None stays None."""
    if isinstance(tensors, Tensor):
        return tensors[rows]
    if tensors is None:
        return None
    parts = [rows_of(part, rows) for part in tensors]
    return type(tensors)(*parts) if hasattr(tensors, "_fields") else tuple(parts)


class _Record:
    """What all stacks of a training write down, each its own networks, whichever thread it runs in."""

    def __init__(self, start: Tensor, epochs: int, progress: Callable[[int, float], None] | None) -> None:
        n = len(start)
        self.start, self.abandoned = start, False
        self._kept = torch.empty_like(start)
        self._best_epoch, self._epochs = np.zeros(n, int), np.zeros(n, int)
        self._stopped_by = [""] * n
        self._history = np.full((2, epochs + 1, n), np.nan)
        self._progress, self._told, self._lock = progress, (0, np.inf), threading.Lock()

    def look(self, epoch: int, rows: np.ndarray, calibration: Tensor, control: Tensor) -> None:
        """Write down both errors of an epoch."""
        self._history[0, epoch, rows] = calibration.cpu()
        self._history[1, epoch, rows] = control.cpu()

    def tell(self, epoch: int, lowest: Tensor) -> None:
        """Report an epoch or an error that none has reached before."""
        if self._progress is None:
            return
        with self._lock:
            now = (max(epoch, self._told[0]), min(float(lowest.min()), self._told[1]))
            if now != self._told:
                self._told = now
                self._progress(*now)

    def close(self, rows: np.ndarray, parameters: Tensor, epoch: int, best_epoch: np.ndarray, words: list[str]) -> None:
        """Write down the networks that leave after an epoch."""
        self._kept[torch.from_numpy(rows)] = parameters
        self._epochs[rows], self._best_epoch[rows] = epoch, best_epoch
        for row, word in zip(rows, words, strict=True):
            self._stopped_by[row] = word

    def training(self) -> Training:
        """All that was written down."""
        calibration, control = self._history[:, : int(self._epochs.max()) + 1]
        return Training(self._kept, self._best_epoch, self._epochs, tuple(self._stopped_by), calibration, control)
