"""Many trainings of one kind on one data set, and what each of them reaches."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch

from classifier.features import Features, Psd, Scaling
from classifier.network import TARGETS, Layers, Mlp
from classifier.trainers import Examples, Trainer, Training
from classifier.trainers.traingdx import TrainGdx
from indexer_experiments.recipes import Labelled

PERFORMANCE = "performance"
"""Mean square error on the control subset after training: the paper's measure (§4.1), lower is better. For targets
of −1 and 1 it is taken on the scale of the bits, like every other one."""


@dataclass(frozen=True)
class Variant:
    """What is compared: features, network and training rule; the paper's choices unless said otherwise.

    label  what tells it apart, on a picture's axis
    x      its place on that axis
    scaled whether features are taken to [0, 1] before training; without, the network starts as the same function of
           the features and learns on these as they are
    """

    label: str
    x: float = 0.0
    features: Features = field(default_factory=Psd)
    hidden: int = 20
    hidden_function: str = Mlp.hidden_function
    output_function: str = Mlp.output_function
    targets: str = Mlp.targets
    trainer: Trainer = field(default_factory=TrainGdx)
    scaled: bool = True


@dataclass(frozen=True, eq=False)
class Trained:
    """Networks of one variant after training on one data set."""

    variant: Variant
    data: Labelled
    scaling: Scaling
    network: Mlp
    training: Training
    seconds: float

    def outputs(self, records: np.ndarray) -> np.ndarray:
        """Outputs (networks, n, bits), on the scale of the bits, for records (n, samples) of the same rate."""
        values = self.variant.features.compute(records, self.data.sample_rate)
        inputs = torch.from_numpy(self.scaling.apply(values) if self.variant.scaled else values)
        outputs = self.network.outputs_of(self.training.parameters, inputs)
        return self.network.bits_of(outputs).numpy()

    def rows(self) -> list[dict[str, Any]]:
        """One row per network: errors and misclassified share of every subset, epochs, what stopped it."""
        outputs = self.outputs(self.data.records)
        errors = (outputs - self.data.targets) ** 2
        wrong = misclassified(outputs, self.data.targets)
        low, high = TARGETS[self.variant.targets]
        rows: list[dict[str, Any]] = [
            {
                "variant": self.variant.label,
                "x": self.variant.x,
                "network": network,
                "epochs": int(self.training.epochs[network]),
                "best_epoch": int(self.training.best_epoch[network]),
                "stopped_by": self.training.stopped_by[network],
                "seconds": self.seconds / len(outputs),
            }
            for network in range(len(outputs))
        ]
        for subset, chosen in self.data.subsets.items():
            for row, error, share in zip(
                rows, errors[:, chosen].mean(axis=(1, 2)), wrong[:, chosen].mean(axis=1), strict=True
            ):
                row |= {f"{subset}_mse": float(error), f"{subset}_misclassified": float(share)}
        for row in rows:
            row[PERFORMANCE] = row["control_mse"]
            row["performance_of_targets"] = row["control_mse"] * (high - low) ** 2
        return rows


def misclassified(outputs: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Whether each output (networks, n, bits) lies nearer to another code than to its own (n, bits); the codes are
    the different targets.
    """
    codes, own = np.unique(targets, axis=0, return_inverse=True)
    return nearest(outputs, codes) != own.ravel()


def nearest(outputs: np.ndarray, codes: np.ndarray) -> np.ndarray:
    """Number (networks, n) of the code (codes, bits) that lies nearest to each output (networks, n, bits)."""
    return np.linalg.norm(outputs[:, :, None, :] - codes, axis=-1).argmin(axis=-1)


def train(data: Labelled, variant: Variant, networks: int, seed: int) -> Trained:
    """Train so many networks of a variant from random starts.

    Scaling and weights are fitted to the calibration subset; the control subset decides when to stop.
    """
    values = variant.features.compute(data.records, data.sample_rate)
    scaling = Scaling.fit(values[data.subsets["calibration"]])
    inputs = torch.from_numpy(scaling.apply(values) if variant.scaled else values)
    network = Mlp(
        inputs.shape[1],
        variant.hidden,
        data.targets.shape[1],
        variant.hidden_function,
        variant.output_function,
        variant.targets,
    )
    wanted = network.targets_of(torch.from_numpy(data.targets))
    subsets = (torch.from_numpy(data.subsets[subset]) for subset in ("calibration", "control"))
    calibration, control = (Examples(inputs[rows], wanted[rows]) for rows in subsets)
    start = network.initial(networks, torch.Generator().manual_seed(seed))
    if not variant.scaled:
        _unscale(network.layers(start), scaling)
    began = time.process_time()
    training = variant.trainer.train(network, start, calibration, control)
    return Trained(variant, data, scaling, network, training, time.process_time() - began)


def _unscale(layers: Layers, scaling: Scaling) -> None:
    """Change first layers for scaled features, in place, to the same functions of features that are not:
    W (x − low) / span + b.
    """
    span = torch.tensor(scaling.high - scaling.low)
    layers.w1.div_(torch.where(span > 0, span, torch.inf))
    layers.b1.sub_(layers.w1 @ torch.tensor(scaling.low))
