"""A trained classifier: from records to outputs, and to and from a folder.

A folder holds `model.safetensors` (all numbers of the network and the scaling, float64) and `model.yaml` (all
that is needed to use them, and where they come from). Each file knows the other's SHA-256, so that a
truncated or edited one is refused. Nothing is ever unpickled.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import torch
import yaml
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors
from torch import Tensor

from classifier.codes import CodeBook
from classifier.features import Features, Scaling, describe_features, make_features
from classifier.network import Mlp
from indexer_env.errors import IndexerError

MODEL_YAML = "model.yaml"
MODEL_TENSORS = "model.safetensors"
FORMAT = 1


class ModelFileError(IndexerError, ValueError):
    """A stored model cannot be used; the message names the file and the reason."""


@dataclass(frozen=True, eq=False)
class Model:
    """A trained classifier and what a record must be to be fed to it.

    parameters           (network.count,) float64
    sample_rate, samples rate [Hz] and length of the records it was trained on: one table turn
    quantity, unit       of these records
    mean_densities       (classes, frequencies) mean PSD of the calibration records per class [unit²/Hz], for
                         pictures
    provenance           data set, seed, training rule, versions
    metrics              scores per subset
    """

    features: Features
    scaling: Scaling
    codes: CodeBook
    network: Mlp
    parameters: Tensor
    sample_rate: float
    samples: int
    quantity: str
    unit: str
    mean_densities: np.ndarray
    provenance: dict[str, Any]
    metrics: dict[str, Any]

    def outputs(self, records: np.ndarray) -> np.ndarray:
        """Outputs (n, bits) for records (n, samples) at the model's rate, in its unit, on the scale of the bits:
        0 and 1 are the targets, whatever the network's own are.
        """
        scaled = self.scaling.apply(self.features.compute(records, self.sample_rate))
        outputs = self.network.outputs_of(self.parameters[None], torch.from_numpy(scaled))[0]
        return self.network.bits_of(outputs).numpy()


def save_model(model: Model, folder: Path) -> None:
    """Write both files of a model into an existing folder."""
    body = {
        "format": FORMAT,
        "record": {
            "sample_rate": model.sample_rate,
            "samples": model.samples,
            "quantity": model.quantity,
            "unit": model.unit,
        },
        "features": describe_features(model.features),
        "network": asdict(model.network),
        "classes": [
            {"class": label, "name": name, "code": code}
            for label, name, code in zip(model.codes.classes, model.codes.names, model.codes.codes, strict=True)
        ],
        "metrics": model.metrics,
        "provenance": model.provenance,
    }
    tensors = {
        **{name: part[0].contiguous() for name, part in model.network.layers(model.parameters[None])._asdict().items()},
        "scaling.low": torch.tensor(model.scaling.low),
        "scaling.high": torch.tensor(model.scaling.high),
        "mean_densities": torch.from_numpy(np.ascontiguousarray(model.mean_densities)),
    }
    data = save_tensors(tensors, metadata={"body_sha256": _digest(body)})
    (folder / MODEL_TENSORS).write_bytes(data)
    body["tensors_sha256"] = hashlib.sha256(data).hexdigest()
    text = yaml.safe_dump(body, sort_keys=False, allow_unicode=True, width=100)
    (folder / MODEL_YAML).write_text(text, encoding="utf-8")


def load_model(path: str | Path) -> Model:
    """Model from a folder written by `save_model`; its outputs are those of the saved one, bit for bit.

    Raises ModelFileError for a missing, truncated or edited file and for another format.
    """
    folder = Path(path)
    for name in (MODEL_YAML, MODEL_TENSORS):
        if not (folder / name).is_file():
            raise ModelFileError(f"model must be a folder that holds {name}, got {str(folder)!r}; train one first.")
    body = _read_yaml(folder / MODEL_YAML)
    stated = body.pop("tensors_sha256", None)
    if stated is None:
        raise _damaged(folder / MODEL_YAML, "it states no SHA-256 of the weights")
    data = (folder / MODEL_TENSORS).read_bytes()
    if hashlib.sha256(data).hexdigest() != stated:
        raise _damaged(folder / MODEL_TENSORS, "its SHA-256 is not the one that model.yaml states")
    with safetensors.safe_open(folder / MODEL_TENSORS, framework="pt") as file:
        saved_with = (file.metadata() or {}).get("body_sha256")
    if _digest(body) != saved_with:
        raise _damaged(folder / MODEL_YAML, "its contents are not those that were saved with the weights")

    tensors = load_tensors(data)
    record, classes = body["record"], body["classes"]
    return Model(
        features=make_features(body["features"]),
        scaling=Scaling(tensors["scaling.low"].numpy(), tensors["scaling.high"].numpy()),
        codes=CodeBook(*(tuple(entry[key] for entry in classes) for key in ("class", "name", "code"))),
        network=Mlp(**body["network"]),
        parameters=torch.cat([tensors[name].flatten() for name in ("w1", "b1", "w2", "b2")]),
        mean_densities=tensors["mean_densities"].numpy(),
        provenance=body["provenance"],
        metrics=body["metrics"],
        **record,
    )


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        body = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError):
        raise _damaged(path, "it is not YAML") from None
    if not isinstance(body, dict) or "format" not in body:
        raise _damaged(path, "it states no format")
    if body["format"] != FORMAT:
        raise ModelFileError(f"{path}: format must be {FORMAT}, got {body['format']!r}; train the model again.")
    return body


def _damaged(path: Path, reason: str) -> ModelFileError:
    return ModelFileError(
        f"{path} must be as it was written, but {reason}; restore both files or train the model again."
    )


def _digest(body: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
