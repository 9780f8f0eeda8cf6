"""A whole classifier as an ONNX model, with all that a user must know in its metadata."""

from __future__ import annotations

import json

import numpy as np
import onnx

from classifier.export.features import add_features
from classifier.export.graph import Graph
from classifier.export.parts import ADDERS, Columns, add_network, add_range, add_scaling, nearest_code
from classifier.features import describe_features
from classifier.model import Model
from classifier.tasks.range import Range
from datagen.versions import versions_of
from indexer_env.checks import check_choice
from indexer_env.errors import refuse

INPUTS = ("record", "features")
"""What a graph may begin with: the samples of one turn, or their features before the scaling."""

NAME = "indexer-diagnosis"


def to_onnx(model: Model, begin: str = "record") -> onnx.ModelProto:
    """The classifier from `begin` to all it says, in float64.

    Inputs: ``record`` (n, samples) at the model's rate and in its unit, or ``features`` (n, count), unscaled.
    Outputs: ``outputs`` (n, bits) on the scale of the bits, ``class_label`` (n,) int64 of the nearest code,
    ``distance`` (n,) of the outputs from it, and the columns of the model's parts (see `classifier.parts`).

    Raises ParameterError for another begin, and for features that have no nodes.
    """
    check_choice("export", "input", begin, INPUTS)
    if begin == "record" and model.channels > 1:
        raise refuse("export", "input", f"features for a model of {model.channels} channels", begin)
    graph = Graph()
    record = graph.input("record", model.samples) if begin == "record" else None
    if record is not None:
        features = add_features(graph, model.features, record, model.samples, model.sample_rate)
    else:
        features = graph.input("features", model.network.inputs)
    scaled = add_scaling(graph, model.scaling.low, model.scaling.high, features)
    outputs = add_network(graph, model.network, model.parameters.numpy(), scaled)
    nearest, distances = nearest_code(graph, model.codes.matrix, outputs)
    graph.output("outputs", outputs, model.codes.bits)
    labels = graph.add("Gather", np.array(model.codes.classes), nearest)
    graph.output("class_label", labels, kind=onnx.TensorProto.INT64)
    graph.output("distance", graph.add("ReduceMin", distances, axes=[-1], keepdims=0))
    for part in model.parts:
        if part.kind in ADDERS:
            _give_out(graph, ADDERS[part.kind](graph, part, scaled, outputs))
        elif isinstance(part, Range) and record is not None:
            _give_out(graph, add_range(graph, part, record))
    return graph.model(NAME, _metadata(model, begin))


def _give_out(graph: Graph, columns: Columns) -> None:
    for name, column in columns.items():
        kind = onnx.TensorProto.BOOL if column.flag else onnx.TensorProto.DOUBLE
        graph.output(name, column.tensor, *column.widths, kind=kind)


def left_out(model: Model, begin: str = "record") -> dict[str, str]:
    """What the file cannot say, with the reason: what the model cannot, its parts without nodes, and its checks of a
    record."""
    reasons = {Range.kind: "needs the record, not its features"} if begin == "features" else {}
    without = {
        part.kind: reasons.get(part.kind, "cannot be exported") for part in model.parts if not _has(part.kind, begin)
    }
    return {**model.left_out, **without, "sensor": "the caller checks for dead and clipped sensors, indexing and sign"}


def guards(model: Model, begin: str = "record") -> tuple[str, ...]:
    """Kinds of the parts of the file that tell a record unlike all that was taught."""
    return tuple(kind for kind in model.guards if _has(kind, begin))


def _has(kind: str, begin: str) -> bool:
    return kind in ADDERS or (kind == Range.kind and begin == "record")


def _metadata(model: Model, begin: str) -> dict[str, str]:
    """Texts and JSON by key."""
    classes = [
        {"class": label, "name": name, "code": code}
        for label, name, code in zip(model.codes.classes, model.codes.names, model.codes.codes, strict=True)
    ]
    entries = {
        "input": begin,
        "sample_rate_hz": model.sample_rate,
        "samples": model.samples,
        "quantity": model.quantity,
        "unit": model.unit,
        "conditions": model.conditions.to_dict(),
        "features": describe_features(model.features),
        "classes": classes,
        "parts": [part.kind for part in model.parts if _has(part.kind, begin)],
        "guards": guards(model, begin),
        "left_out": left_out(model, begin),
        "data": model.provenance.get("data", {}),
        "versions": versions_of((NAME, "numpy", "onnx")),
    }
    texts = {key: value if isinstance(value, str) else json.dumps(value) for key, value in entries.items()}
    return {f"{NAME}.{key}": text for key, text in texts.items()}
