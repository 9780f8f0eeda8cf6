"""A trained classifier: from records to outputs, and to and from a folder.

A folder holds `model.safetensors` (all numbers of the network and the scaling, float64) and `model.yaml` (all
that is needed to use them, and where they come from). Each file knows the other's SHA-256, so that a
truncated or edited one is refused. Nothing is ever unpickled.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
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
from classifier.conditions import Conditions
from classifier.features import Features, Scaling, describe_features, make_features
from classifier.network import Mlp
from classifier.parts import GUARDS, Part, known_parts
from indexer_env.checks import check_choice
from indexer_env.errors import IndexerError, ParameterError

MODEL_YAML = "model.yaml"
MODEL_TENSORS = "model.safetensors"
FORMAT = 3


UNGUARDED = "unguarded: the model gives any record a name, noise too; train with the part range or novelty"
"""What is said of a model without a part of GUARDS."""


class ModelFileError(IndexerError, ValueError):
    """A stored model cannot be used; the message names the file and the reason."""


@dataclass(frozen=True, eq=False)
class Model:
    """A trained classifier and what a record must be to be fed to it.

    parameters           (network.count,) float64
    sample_rate, samples rate [Hz] and length of the records it was trained on: one table turn; of each channel
    quantity, unit       of these records
    conditions           under what they were taken
    mean_densities       (classes, frequencies) mean PSD of the calibration records per class [unit²/Hz], for
                         pictures
    mean_features        (count,) mean of the scaled features of the calibration records: what an explanation compares
                         a record with
    provenance           data set, seed, training rule, versions
    metrics              scores per subset
    parts                what it says beyond its outputs
    left_out             what it cannot say or compare, with the reason: parts and conditions by name
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
    conditions: Conditions
    mean_densities: np.ndarray
    mean_features: np.ndarray
    provenance: dict[str, Any]
    metrics: dict[str, Any]
    parts: tuple[Part, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def guards(self) -> tuple[str, ...]:
        """Kinds of the parts that tell a record unlike all that was taught; (): it gives every record a name."""
        return tuple(part.kind for part in self.parts if part.kind in GUARDS)

    def items_learnt(self, manifest: str, rows: str | None = None) -> float:
        """How many items, from the first on, of the data set with a manifest of this SHA-256 and rows of this one
        (`classifier.dataset.rows_sha256`) its training or a fine-tuning had; infinite for the whole of it."""
        told = self.provenance
        sets = [one for one in (told.get("data"), told.get("fine_tuned_on"), *told.get("fine_tuned_before", ())) if one]
        if any(one.get("manifest_sha256") == manifest for one in sets):
            return math.inf
        return max((one["count"] for one in sets if rows and one.get("rows_sha256") == rows), default=0)

    def shortcomings(self) -> list[str]:
        """What the model cannot say, a line each; the last one where nothing tells a strange record."""
        told = [f"{name}: {reason}" for name, reason in self.left_out.items()]
        return told if self.guards else [*told, UNGUARDED]

    @property
    def channels(self) -> int:
        """Channels of a record."""
        return len(self.mean_features) // len(self.features.frequencies(self.sample_rate))

    @property
    def frequencies(self) -> np.ndarray:
        """Frequency (count,) of each feature [Hz], channel after channel."""
        return np.tile(self.features.frequencies(self.sample_rate), self.channels)

    def scaled(self, records: np.ndarray) -> np.ndarray:
        """Features (n, count) as the network sees them, for records (n, samples), of several channels
        (n, channels, samples), at the model's rate, in its unit."""
        return self.scaling.apply(self.features.compute(records, self.sample_rate))

    def outputs_of(self, scaled: np.ndarray) -> np.ndarray:
        """Outputs (n, bits) for scaled features (n, count), on the scale of the bits: 0 and 1 are the targets, whatever
        the network's own are.
        """
        outputs = self.network.outputs_of(self.parameters[None], torch.from_numpy(scaled))[0]
        return self.network.bits_of(outputs).numpy()

    def outputs(self, records: np.ndarray) -> np.ndarray:
        """Outputs (n, bits), on the scale of the bits, for records (n, samples) at the model's rate, in its unit."""
        return self.outputs_of(self.scaled(records))

    def assess(self, scaled: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """What all parts say of records (n, samples) with scaled features (n, count) and outputs (n, bits): named
        columns, see `Part.assess`."""
        return {name: column for part in self.parts for name, column in part.assess(scaled, outputs, records).items()}


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
        "conditions": model.conditions.to_dict(),
        "features": describe_features(model.features),
        "network": asdict(model.network),
        "classes": [
            {"class": label, "name": name, "code": code}
            for label, name, code in zip(model.codes.classes, model.codes.names, model.codes.codes, strict=True)
        ],
        "parts": [{"kind": part.kind, **part.body()} for part in model.parts],
        "left_out": dict(model.left_out),
        "metrics": model.metrics,
        "provenance": model.provenance,
    }
    tensors = {
        **{name: part[0].contiguous() for name, part in model.network.layers(model.parameters[None])._asdict().items()},
        "scaling.low": torch.tensor(model.scaling.low),
        "scaling.high": torch.tensor(model.scaling.high),
        "mean_densities": torch.from_numpy(np.ascontiguousarray(model.mean_densities)),
        "mean_features": torch.from_numpy(np.ascontiguousarray(model.mean_features)),
        **{
            f"{_prefix(place, part.kind)}{name}": torch.from_numpy(np.array(array, order="C"))
            for place, part in enumerate(model.parts)
            for name, array in part.arrays().items()
        },
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
    try:
        with safetensors.safe_open(folder / MODEL_TENSORS, framework="pt") as file:
            saved_with = (file.metadata() or {}).get("body_sha256")
    except safetensors.SafetensorError:
        raise _damaged(folder / MODEL_TENSORS, "it holds no tensors") from None
    if _digest(body) != saved_with:
        raise _damaged(folder / MODEL_YAML, "its contents are not those that were saved with the weights")

    # Whoever writes new digests too can still leave out or misshape what is inside.
    try:
        return _model(body, {name: tensor.numpy() for name, tensor in load_tensors(data).items()})
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        reason = f"it lacks {error}" if isinstance(error, KeyError) else str(error).rstrip(".")
        raise _damaged(folder / MODEL_YAML, reason) from None


def _model(body: dict[str, Any], tensors: dict[str, np.ndarray]) -> Model:
    record, classes = body["record"], body["classes"]
    network = Mlp(**body["network"])
    parameters = np.concatenate([tensors[name].ravel() for name in ("w1", "b1", "w2", "b2")])
    scaling = Scaling(tensors["scaling.low"], tensors["scaling.high"])
    for name, got, wanted in (
        ("the number of weights", parameters.size, network.count),
        ("the number of scaled features", scaling.low.size, network.inputs),
        ("the number of mean features", tensors["mean_features"].size, network.inputs),
        ("the number of bits", len(classes[0]["code"]), network.outputs),
    ):
        if got != wanted:
            raise ParameterError(f"{name} is {got} where the network has {wanted}.")
    return Model(
        features=make_features(body["features"]),
        scaling=scaling,
        codes=CodeBook(*(tuple(entry[key] for entry in classes) for key in ("class", "name", "code"))),
        network=network,
        parameters=torch.from_numpy(parameters),
        conditions=Conditions.from_dict(body["conditions"]),
        mean_densities=tensors["mean_densities"],
        mean_features=tensors["mean_features"],
        provenance=body["provenance"],
        metrics=body["metrics"],
        parts=tuple(_part(place, dict(entry), tensors) for place, entry in enumerate(body["parts"])),
        left_out=dict(body["left_out"]),
        **record,
    )


def _part(place: int, body: dict[str, Any], tensors: dict[str, np.ndarray]) -> Part:
    kind = body.pop("kind")
    check_choice("parts", "kind", kind, known_parts())
    prefix = _prefix(place, kind)
    arrays = {name.removeprefix(prefix): array for name, array in tensors.items() if name.startswith(prefix)}
    return known_parts()[kind].restore(body, arrays)


def _prefix(place: int, kind: str) -> str:
    """How the names of a part's tensors begin in the file."""
    return f"parts.{place}.{kind}."


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
