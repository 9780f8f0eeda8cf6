"""What the parts of a model say, as nodes: one function a kind, which gives the same columns as its `assess`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from classifier.export.graph import Graph
from classifier.network import TARGETS, Mlp
from classifier.tasks.confidence import Confidence
from classifier.tasks.novelty import NEIGHBOURS, Novelty
from classifier.tasks.range import OUTSIDE, Range, octave_count
from classifier.tasks.regression import KernelRidge
from classifier.tasks.remaining import Remaining
from classifier.tasks.severity import Severity


class Column(NamedTuple):
    """A column that a graph gives out: its tensor (n, *widths), of float64 unless it is a flag."""

    tensor: str
    widths: tuple[int, ...] = ()
    flag: bool = False


Columns = dict[str, Column]


def add_network(graph: Graph, network: Mlp, parameters: np.ndarray, inputs: str) -> str:
    """Outputs (n, outputs) of a network with parameters (count,), on the scale of the bits, for inputs (n, inputs)."""
    hidden, outputs = network.hidden, network.outputs
    sizes = np.cumsum([hidden * network.inputs, hidden, outputs * hidden])
    w1, b1, w2, b2 = np.split(parameters, sizes)
    functions = {"logistic": "Sigmoid", "tanh": "Tanh", "linear": "Identity"}
    layer = inputs
    for weights, biases, function in (
        (w1.reshape(hidden, -1), b1, network.hidden_function),
        (w2.reshape(outputs, -1), b2, network.output_function),
    ):
        layer = graph.add(functions[function], graph.add("Add", graph.add("MatMul", layer, weights.T), biases))
    low, high = TARGETS[network.targets]
    return graph.add("Div", graph.add("Sub", layer, low), high - low)


def add_scaling(graph: Graph, low: np.ndarray, high: np.ndarray, features: str) -> str:
    """Scaled features; those that did not vary over the calibration records are 0."""
    span = high - low
    factor = np.where(span == 0.0, 0.0, 1.0 / np.where(span == 0.0, 1.0, span))
    return graph.add("Mul", graph.add("Sub", features, low), factor)


def _confidence(graph: Graph, part: Confidence, scaled: str, outputs: str) -> Columns:
    inside = graph.add("Clip", outputs, 1e-6, 1.0 - 1e-6)
    ones = graph.add("MatMul", graph.add("Log", inside), part.codes.T)
    zeros = graph.add("MatMul", graph.add("Log", graph.add("Sub", 1.0, inside)), (1.0 - part.codes).T)
    logits = graph.add("Div", graph.add("Add", ones, zeros), part.temperature)
    probabilities = graph.add("Softmax", logits, axis=-1)
    nearest = graph.add("Unsqueeze", nearest_code(graph, part.codes, outputs)[0], np.array([1]))
    named = graph.add("GatherElements", probabilities, nearest, axis=1)
    return {
        "probability": Column(graph.add("Squeeze", named, np.array([1]))),
        "class_probability": Column(probabilities, (len(part.codes),)),
        "bit_probability": Column(graph.add("MatMul", probabilities, part.codes), part.codes.shape[1:]),
    }


def nearest_code(graph: Graph, codes: np.ndarray, outputs: str) -> tuple[str, str]:
    """Positions (n,) of the nearest codes to outputs (n, bits), and the distances (n, classes) of all."""
    apart = graph.add("Sub", graph.add("Unsqueeze", outputs, np.array([1])), codes[None])
    distances = graph.add("ReduceL2", apart, axes=[-1], keepdims=0)
    return graph.add("ArgMin", distances, axis=-1, keepdims=0), distances


def _compressed(graph: Graph, knee: np.ndarray, scaled: str) -> str:
    """asinh(x / m), as sign(x) ln(|x| + sqrt(x² + 1)): runtimes lack the function in float64."""
    ratio = graph.add("Div", scaled, knee)
    size = graph.add("Abs", ratio)
    root = graph.add("Sqrt", graph.add("Add", graph.add("Mul", ratio, ratio), 1.0))
    return graph.add("Mul", graph.add("Sign", ratio), graph.add("Log", graph.add("Add", size, root)))


def _novelty(graph: Graph, part: Novelty, scaled: str, outputs: str) -> Columns:
    whitening = part.whitening
    centred = graph.add("Sub", _compressed(graph, part.compression.knee, scaled), whitening.centre)
    components = graph.add("MatMul", centred, whitening.axes)
    if part.score == "neighbours":
        apart = graph.add("Sub", graph.add("Unsqueeze", components, np.array([1])), part.reference[None])
        distances = graph.add("ReduceL2", apart, axes=[-1], keepdims=0)
        score = graph.add("ReduceMean", graph.smallest(distances, NEIGHBOURS), axes=[-1], keepdims=0)
    elif part.score == "distance":
        score = graph.add("ReduceL2", components, axes=[-1], keepdims=0)
    else:
        directions = whitening.axes / np.linalg.norm(whitening.axes, axis=0)
        inside = graph.add("MatMul", graph.add("MatMul", centred, directions), directions.T)
        rest = graph.add("ReduceL2", graph.add("Sub", centred, inside), axes=[-1], keepdims=0)
        score = graph.add("Div", rest, max(whitening.spread, float(np.finfo(np.float64).tiny)))
    novelty = graph.add("Div", score, part.threshold)
    return {"novelty": Column(novelty), "is_novel": Column(graph.add("Greater", novelty, 1.0), flag=True)}


def add_range(graph: Graph, part: Range, record: str) -> Columns:
    """Columns of the range of records (n, samples), see `classifier.tasks.range.octaves`."""
    rest = graph.add("Sub", record, graph.add("ReduceMean", record, axes=[-1], keepdims=1))
    squares, samples = [graph.add("ReduceMean", graph.add("Mul", rest, rest), axes=[-1], keepdims=1)], part.samples
    for octave in range(octave_count(part.samples)):
        places = np.arange(samples // 2)
        even, odd = (graph.add("Gather", rest, 2 * places + side, axis=1) for side in (0, 1))
        if octave > 0:
            half = graph.add("Div", graph.add("Sub", even, odd), 2.0)
            squares.append(graph.add("ReduceMean", graph.add("Mul", half, half), axes=[-1], keepdims=1))
        rest, samples = graph.add("Div", graph.add("Add", even, odd), 2.0), samples // 2
    least = float(np.finfo(np.float64).tiny)
    logarithms = graph.add("Log", graph.add("Max", graph.add("Concat", *squares, axis=1), least))
    apart = graph.add("Sub", graph.add("Div", logarithms, 2.0 * float(np.log(10.0))), part.middle)
    farthest = graph.add("ReduceMax", graph.add("Div", graph.add("Abs", apart), part.reach), axes=[-1], keepdims=0)
    level = graph.add(
        "Pow", 10.0, graph.add("Squeeze", graph.add("Gather", apart, np.array([0]), axis=1), np.array([1]))
    )
    outside = Column(graph.add("Greater", farthest, 1.0), flag=True)
    return {"level": Column(level), "range": Column(farthest), OUTSIDE: outside}


def _kernels(graph: Graph, regression: KernelRidge, inputs: str) -> str:
    """Values (n, k) of a kernel ridge regression at inputs (n, d); |x − c|² as |x|² − 2 x·c + |c|²."""
    own = graph.add("ReduceSumSquare", inputs, axes=[-1], keepdims=1)
    across = graph.add("MatMul", inputs, -2.0 * regression.centres.T)
    apart = graph.add("Add", graph.add("Add", own, across), (regression.centres**2).sum(axis=1))
    bells = graph.add("Exp", graph.add("Div", apart, -2.0 * regression.width**2))
    return graph.add("Add", graph.add("MatMul", bells, regression.weights), regression.offset)


def _severity(graph: Graph, part: Severity, scaled: str, outputs: str) -> Columns:
    flat = part.standard.deviation == 0.0
    factor = np.where(flat, 0.0, 1.0 / np.where(flat, 1.0, part.standard.deviation))
    compressed = _compressed(graph, part.compression.knee, scaled)
    inputs = graph.add("Mul", graph.add("Sub", compressed, part.standard.mean), factor)
    middle = graph.add("Mul", _kernels(graph, part.value, inputs), part.span)
    unit = graph.add("Max", _kernels(graph, part.error, inputs), part.floor)
    reach = graph.add("Mul", unit, part.span * part.quantile)
    ends = {"": middle, "_low": graph.add("Sub", middle, reach), "_high": graph.add("Add", middle, reach)}
    columns = {}
    for place, name in enumerate(part.names):
        high = min(part.quantities[name].high, np.finfo(np.float64).max)
        for ending, values in ends.items():
            one = graph.add("Gather", values, np.array(place), axis=1)
            columns[name + ending] = Column(graph.add("Clip", one, 0.0, high))
    return columns


ADDERS: dict[str, Callable[[Graph, Any, str, str], Columns]] = {
    Confidence.kind: _confidence,
    Novelty.kind: _novelty,
    Severity.kind: _severity,
    Remaining.kind: _severity,
}
"""Adds the columns of a part by its kind, from scaled features (n, count) and outputs (n, bits)."""
