"""A convolutional network on the record itself, as a second opinion beside the network on features."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from classifier.dataset import Dataset
from classifier.tasks.confidence import LEAST, fit_temperature, softmax
from classifier.tasks.decimate import RATE, Decimated
from classifier.tasks.need import count_independent, independent, need
from indexer_env.errors import SignalError


def layers(classes: int, channels: int = 1) -> nn.Sequential:
    """Four strided convolutions, the mean over time, one linear layer; 44 000 weights for a single channel."""
    sizes = ((channels, 16, 16, 4), (16, 32, 8, 4), (32, 64, 8, 2), (64, 64, 4, 2))
    blocks = [
        part
        for into, out, width, stride in sizes
        for part in (nn.Conv1d(into, out, width, stride), nn.BatchNorm1d(out), nn.ReLU())
    ]
    return nn.Sequential(*blocks, nn.AdaptiveAvgPool1d(1), nn.Flatten(), nn.Dropout(0.2), nn.Linear(64, classes))


LEAST_SAMPLES = 284
"""Fewest samples that the four convolutions take: what is left behind the third must be as long as the fourth."""


@dataclass(frozen=True)
class RecordNetwork:
    """A trained network with what its records go through first."""

    decimated: Decimated
    network: nn.Sequential

    def logits(self, records: np.ndarray) -> np.ndarray:
        """Logits (n, classes) of records (n, samples) or (n, channels, samples)."""
        with torch.no_grad():
            inputs = _inputs(self.decimated, records)
            return torch.cat([self.network(part) for part in inputs.split(256)]).double().numpy()


@dataclass(frozen=True)
class Learning:
    """Adam with early stopping on the control subset; each batch is begun at a random place and read in a circle, as a
    turn has no beginning.

    epochs    most epochs
    patience  epochs without a lower cross entropy on the control subset after which it stops
    batch     records in a step
    rate      learning rate of Adam
    """

    epochs: int = 80
    patience: int = 12
    batch: int = 32
    rate: float = 2e-3

    def fit(self, dataset: Dataset, seed: int, rate: float = RATE) -> RecordNetwork:
        """Learn from the calibration subset at a rate of at least so many Hz; all chance comes from `seed`.

        Raises SignalError for records that are too short.
        """
        samples = dataset.records.shape[-1]
        if samples < LEAST_SAMPLES:
            raise SignalError(
                f"records must have at least {LEAST_SAMPLES} samples for the convolutional network, got {samples}; "
                "leave it out or take longer records."
            )
        decimated = Decimated.fit(dataset, max(rate, dataset.sample_rate * LEAST_SAMPLES / samples))
        inputs = _inputs(decimated, dataset.records)
        positions = torch.from_numpy(dataset.codes.positions(dataset.classes))
        teach, watch = (torch.from_numpy(np.flatnonzero(dataset.rows(name))) for name in ("calibration", "control"))
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            network = layers(len(dataset.codes.classes), inputs.shape[1])
            best, lowest, since = network.state_dict(), np.inf, 0
            optimiser = torch.optim.Adam(network.parameters(), lr=self.rate)
            for _ in range(self.epochs):
                network.train()
                for rows in teach[torch.randperm(len(teach))].split(self.batch):
                    # Batch normalisation cannot learn from a single record.
                    if len(rows) > 1:
                        _step(network, optimiser, inputs[rows], positions[rows])
                network.eval()
                error = _error(network, inputs[watch], positions[watch])
                since += 1
                if error < lowest:
                    best, lowest, since = copy.deepcopy(network.state_dict()), error, 0
                elif since >= self.patience:
                    break
        network.load_state_dict(best)
        return RecordNetwork(decimated, network.eval())


def _inputs(decimated: Decimated, records: np.ndarray) -> Tensor:
    """What the network sees (n, channels, samples) of records (n, samples) or (n, channels, samples)."""
    seen = torch.from_numpy(decimated.apply(records)).float()
    return seen if seen.ndim == 3 else seen[:, None]


def _step(network: nn.Sequential, optimiser: torch.optim.Optimizer, inputs: Tensor, wanted: Tensor) -> None:
    rolled = torch.roll(inputs, int(torch.randint(inputs.shape[2], ())), dims=2)
    optimiser.zero_grad()
    nn.functional.cross_entropy(network(rolled), wanted).backward()
    optimiser.step()


def _error(network: nn.Sequential, inputs: Tensor, wanted: Tensor) -> float:
    with torch.no_grad():
        outputs = torch.cat([network(part) for part in inputs.split(256)])
        return float(nn.functional.cross_entropy(outputs, wanted))


@dataclass(frozen=True, eq=False)
class Convolution:
    """The class that the record itself suggests.

    seen         network with its decimation
    temperature  at which its probabilities fit the control records best, see `fit_temperature` [-]
    names        of the classes, in the order of `codes`
    codes        (classes, bits)
    """

    kind: ClassVar[str] = "convolution"

    seen: RecordNetwork
    temperature: float
    names: tuple[str, ...]
    codes: np.ndarray

    @classmethod
    def fit(cls, dataset: Dataset, features: np.ndarray, outputs: np.ndarray, seed: int) -> Convolution:
        """Trained on the calibration records; its probabilities need as many control records as `Confidence`, else it
        raises NotAvailable."""
        need("independent control records", LEAST, count_independent(dataset, "control"))
        seen, control = Learning().fit(dataset, seed), dataset.rows("control")
        positions = dataset.codes.positions(dataset.classes[control])
        logits = seen.logits(dataset.records[control])
        temperature = fit_temperature(logits, positions, independent(dataset, control))
        return cls(seen, temperature, tuple(dataset.codes.names), dataset.codes.matrix)

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Convolution:
        """The part that gave this body and these arrays; ValueError for weights that are not the network's."""
        weights = {name: torch.from_numpy(array.copy()) for name, array in arrays.items() if name != "codes"}
        if "0.weight" not in arrays:
            raise ValueError(f"the weights of {cls.kind} are not those of its network")
        network = layers(len(body["names"]), arrays["0.weight"].shape[1])
        try:
            network.load_state_dict(weights)
        except RuntimeError:
            raise ValueError(f"the weights of {cls.kind} are not those of its network") from None
        seen = RecordNetwork(Decimated(body["factor"], body["rms"]), network.eval())
        return cls(seen, body["temperature"], tuple(body["names"]), arrays["codes"])

    def body(self) -> dict[str, Any]:
        """All of it that is no array."""
        decimated = self.seen.decimated
        return {
            "factor": decimated.factor, "rms": decimated.rms, "temperature": self.temperature, "names": list(self.names)
        }  # fmt: skip

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        return {"codes": self.codes, **{name: part.numpy() for name, part in self.seen.network.state_dict().items()}}

    def assess(self, features: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """What it says of records (n, samples), given the other network's outputs (n, bits):

        cnn_name         (n,) the class it names
        cnn_probability  (n,) of that class
        cnn_agrees       (n,) whether the other network names the same
        """
        probabilities = softmax(self.seen.logits(records), self.temperature)
        own = probabilities.argmax(axis=1)
        other = np.linalg.norm(outputs[:, None, :] - self.codes[None], axis=-1).argmin(axis=1)
        return {
            "cnn_name": np.array(self.names)[own],
            "cnn_probability": probabilities[np.arange(len(own)), own],
            "cnn_agrees": own == other,
        }
