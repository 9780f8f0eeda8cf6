"""A one-dimensional convolutional network on the record itself."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from classifier.compare.methods.base import Fitted, Method
from classifier.compare.methods.decimate import RATE, Decimated
from classifier.dataset import Dataset


def layers(classes: int) -> nn.Sequential:
    """Four strided convolutions, the mean over time, one linear layer; 44 000 weights."""
    sizes = ((1, 16, 16, 4), (16, 32, 8, 4), (32, 64, 8, 2), (64, 64, 4, 2))
    blocks = [
        part
        for into, out, width, stride in sizes
        for part in (nn.Conv1d(into, out, width, stride), nn.BatchNorm1d(out), nn.ReLU())
    ]
    return nn.Sequential(*blocks, nn.AdaptiveAvgPool1d(1), nn.Flatten(), nn.Dropout(0.2), nn.Linear(64, classes))


@dataclass(frozen=True)
class FittedCnn(Fitted):
    """A trained network."""

    decimated: Decimated
    network: nn.Sequential

    def logits(self, records: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            inputs = torch.from_numpy(self.decimated.apply(records)).float()[:, None]
            return torch.cat([self.network(part) for part in inputs.split(256)]).double().numpy()


@dataclass(frozen=True)
class Cnn(Method):
    """Trained with Adam and early stopping on the control subset; each batch is begun at a random place and read in a
    circle, as a turn has no beginning.

    epochs    most epochs
    patience  epochs without a lower cross entropy on the control subset after which it stops
    batch     records in a step
    rate      learning rate of Adam
    """

    epochs: int = 80
    patience: int = 12
    batch: int = 32
    rate: float = 2e-3

    def fit(self, dataset: Dataset, seed: int) -> FittedCnn:
        decimated = Decimated.fit(dataset, RATE)
        inputs = torch.from_numpy(decimated.apply(dataset.records)).float()[:, None]
        positions = torch.from_numpy(dataset.codes.positions(dataset.classes))
        teach, watch = (torch.from_numpy(np.flatnonzero(dataset.rows(name))) for name in ("calibration", "control"))
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            network = layers(len(dataset.codes.classes))
            best, lowest, since = network.state_dict(), np.inf, 0
            optimiser = torch.optim.Adam(network.parameters(), lr=self.rate)
            for _ in range(self.epochs):
                network.train()
                for rows in teach[torch.randperm(len(teach))].split(self.batch):
                    # Batch normalisation cannot learn from a single record.
                    if len(rows) > 1:
                        self._step(network, optimiser, inputs[rows], positions[rows])
                network.eval()
                error = _error(network, inputs[watch], positions[watch])
                since += 1
                if error < lowest:
                    best, lowest, since = copy.deepcopy(network.state_dict()), error, 0
                elif since >= self.patience:
                    break
        network.load_state_dict(best)
        return FittedCnn(decimated, network.eval())

    def _step(self, network: nn.Sequential, optimiser: torch.optim.Optimizer, inputs: Tensor, wanted: Tensor) -> None:
        rolled = torch.roll(inputs, int(torch.randint(inputs.shape[2], ())), dims=2)
        optimiser.zero_grad()
        nn.functional.cross_entropy(network(rolled), wanted).backward()
        optimiser.step()


def _error(network: nn.Sequential, inputs: Tensor, wanted: Tensor) -> float:
    with torch.no_grad():
        outputs = torch.cat([network(part) for part in inputs.split(256)])
        return float(nn.functional.cross_entropy(outputs, wanted))
