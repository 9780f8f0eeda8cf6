"""Training: from a labelled data set to a classifier, its scores and its record of how it came about."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import torch

from classifier.dataset import SUBSETS, Dataset
from classifier.evaluate import Score, score
from classifier.features import Features, Scaling, describe_features
from classifier.model import Model
from classifier.network import Mlp
from classifier.parts import fit_parts
from classifier.trainers import Examples, Trainer, Training
from datagen.versions import versions_of
from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import refuse


@dataclass(frozen=True, eq=False)
class Result:
    """A trained classifier with all that was seen on the way.

    model     the network with the lowest control error among the restarts
    kept      which of the restarts it is
    training  the training of the whole stack of restarts
    scores    per subset, one Score per restart
    """

    model: Model
    kept: int
    training: Training
    scores: dict[str, tuple[Score, ...]]

    def score(self, subset: str) -> Score:
        """Score of the kept network on one subset."""
        return self.scores[subset][self.kept]

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean square errors (epochs, restarts) of the calibration and of the control records, on the scale of the bits
        as the scores are; those of the training are of the network's own targets."""
        span = self.model.network.span**2
        return self.training.calibration_error / span, self.training.control_error / span

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists for results.json: the kept network, every restart, the training curve,
        provenance.
        """
        training = self.training
        last = int(training.epochs[self.kept]) + 1
        calibration, control = (error[:last, self.kept].tolist() for error in self.errors())
        return {
            "kept": self.kept,
            "best_epoch": int(training.best_epoch[self.kept]),
            "scores": {subset: self.score(subset).to_dict() for subset in SUBSETS},
            "restarts": [
                {
                    "epochs": int(training.epochs[i]),
                    "best_epoch": int(training.best_epoch[i]),
                    "stopped_by": training.stopped_by[i],
                    **{f"{subset}_mse_percent": self.scores[subset][i].mse_percent for subset in SUBSETS},
                    **{
                        f"{subset}_misclassified_percent": self.scores[subset][i].misclassified_percent
                        for subset in SUBSETS
                    },
                }
                for i in range(len(training.epochs))
            ],
            "curve": {"calibration_mse": calibration, "control_mse": control},
            "provenance": self.model.provenance,
        }


def train(
    dataset: Dataset,
    features: Features,
    trainer: Trainer,
    hidden: int = 20,
    seed: int = 0,
    restarts: int = 10,
    *,
    hidden_function: str = Mlp.hidden_function,
    output_function: str = Mlp.output_function,
    targets: str = Mlp.targets,
    parts: Sequence[str] | None = None,
    device: str = "cpu",
    progress: Callable[[int, float], None] | None = None,
) -> Result:
    """Train `restarts` networks from different starts as one stack and keep the best on the control subset.

    dataset   labelled records; scaling and weights are fitted to its calibration subset alone, its control
              subset decides when to stop and which restart is kept, its validation subset is only scored
    hidden    nodes of the hidden layer
    seed      of the random start; the networks of a smaller number of restarts are the first ones of a larger
    hidden_function, output_function, targets  of the network, see `Mlp`
    parts     kinds of the parts fitted to the kept network, see `fit_parts`; None: all that the data set allows
    device    "cpu" or "cuda": where the networks are trained
    progress  as in `Trainer.train`, with the error on the scale of the bits

    Raises ParameterError.
    """
    _check(seed, restarts, device)
    calibration = dataset.rows("calibration")
    values = features.compute(dataset.records, dataset.sample_rate)
    scaling = Scaling.fit(values[calibration])
    values = scaling.apply(values)
    network = Mlp(values.shape[1], hidden, dataset.codes.bits, hidden_function, output_function, targets)
    examples = _examples(dataset, network, values, device)
    start = network.initial(restarts, torch.Generator().manual_seed(seed)).to(device)
    told = None if progress is None else lambda epoch, error: progress(epoch, error / network.span**2)
    training = trainer.train(network, start, examples["calibration"], examples["control"], told)
    scores, kept = _scores(dataset, network, training, examples), training.best
    model = Model(
        features=features,
        scaling=scaling,
        codes=dataset.codes,
        network=network,
        parameters=training.parameters[kept].cpu(),
        sample_rate=dataset.sample_rate,
        samples=dataset.records.shape[-1],
        quantity=dataset.quantity,
        unit=dataset.unit,
        conditions=dataset.conditions,
        mean_densities=mean_densities(dataset, features),
        mean_features=values[calibration].mean(axis=0),
        provenance={
            "data": dataset.provenance,
            "seed": seed,
            "restarts": restarts,
            "features": describe_features(features),
            "trainer": {"kind": trainer.kind, **asdict(trainer)},
            "versions": versions_of(("indexer-diagnosis", "numpy", "scipy", "torch")),
        },
        metrics={
            "epochs": int(training.epochs[kept]),
            "best_epoch": int(training.best_epoch[kept]),
            **{subset: scores[subset][kept].to_dict() for subset in SUBSETS},
        },
    )
    fitted, left_out = fit_parts(dataset, values, model.outputs_of(values), parts, seed)
    model = replace(model, parts=fitted, left_out={**left_out, **dataset.conditions.left_out()})
    return Result(model, kept, training, scores)


def mean_densities(dataset: Dataset, features: Features) -> np.ndarray:
    """Mean densities (classes, frequencies) [unit²/Hz] of the calibration records of each class."""
    calibration = dataset.rows("calibration")
    densities = features.density(dataset.records[calibration], dataset.sample_rate)
    labels = dataset.classes[calibration]
    return np.stack([densities[labels == label].mean(axis=0) for label in dataset.codes.classes])


def _check(seed: int, restarts: int, device: str) -> None:
    check_integer("train", "seed", seed, low=0, high=2**63 - 1)
    check_integer("train", "restarts", restarts, low=1)
    check_choice("train", "device", device, ("cpu", "cuda"))
    if device == "cuda" and not torch.cuda.is_available():
        raise refuse("train", "device", "one that this machine and its PyTorch offer", device, "use 'cpu'")


def _examples(dataset: Dataset, network: Mlp, scaled: np.ndarray, device: str) -> dict[str, Examples]:
    """Scaled features (n, count) of all records with their targets, by subset, where the networks are trained."""
    inputs = torch.from_numpy(scaled).to(device)
    wanted = network.targets_of(torch.from_numpy(dataset.codes.targets(dataset.classes))).to(device)
    return {subset: Examples(inputs[dataset.rows(subset)], wanted[dataset.rows(subset)]) for subset in SUBSETS}


def _scores(
    dataset: Dataset, network: Mlp, training: Training, examples: dict[str, Examples]
) -> dict[str, tuple[Score, ...]]:
    """Scores of all networks of a training on each subset."""
    found = {}
    for subset, (inputs, _) in examples.items():
        bits = network.bits_of(network.outputs_of(training.parameters, inputs)).cpu().numpy()
        found[subset] = tuple(score(dataset.codes, one, dataset.classes[dataset.rows(subset)]) for one in bits)
    return found
