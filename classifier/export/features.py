"""Records -> features as nodes: the Fourier transform of each segment is a product with a matrix.

    re_j = Σ_t (x_t − x̄) w_t cos(2π j t / L),   im_j = Σ_t (x_t − x̄) w_t sin(2π j t / L)

The angles are reduced to one turn before the cosine is taken, so that the sums agree with an FFT to rounding.
"""

from __future__ import annotations

import numpy as np
import scipy.signal

from classifier.export.graph import Graph
from classifier.features import Features, Fft, Psd
from indexer_env.errors import refuse


def add_features(graph: Graph, features: Features, record: str, samples: int, sample_rate: float) -> str:
    """Features (n, count) of records (n, samples) at a rate [Hz]. Raises ParameterError for features of another kind
    than "psd" and "fft"."""
    if isinstance(features, Psd):
        return _psd(graph, features, record, samples, sample_rate)
    if isinstance(features, Fft):
        return _fft(graph, features, record, sample_rate)
    raise refuse("export", "features", "of the kind psd or fft", features.kind, "export with input=features")


def _psd(graph: Graph, features: Psd, record: str, samples: int, sample_rate: float) -> str:
    length, count = features.segment(sample_rate), len(features.frequencies(sample_rate))
    window = np.asarray(scipy.signal.get_window("hann", length), np.float64)
    weights = np.full(count, 2.0) / (sample_rate * (window**2).sum())
    weights[0] /= 2.0
    if length % 2 == 0 and count == length // 2 + 1:
        weights[-1] /= 2.0
    begins = np.arange(0, samples - length + 1, length - length // 2)
    segments = graph.add("Gather", record, begins[:, None] + np.arange(length), axis=1)
    power = _power(graph, segments, _transforms(length, np.arange(count), window))
    density = graph.add("Mul", graph.add("ReduceMean", power, axes=[1], keepdims=0), weights)
    if features.scale == "linear":
        return density
    logarithm = graph.add("Log", graph.add("Max", density, float(np.finfo(np.float64).tiny)))
    return graph.add("Div", logarithm, float(np.log(10.0)))


def _fft(graph: Graph, features: Fft, record: str, sample_rate: float) -> str:
    length, count = features.segment(sample_rate), len(features.frequencies(sample_rate))
    used = graph.add("Slice", record, np.array([0]), np.array([length]), np.array([1]))
    power = _power(graph, used, _transforms(length, np.arange(1, count + 1), np.ones(length)))
    return graph.add("Mul", graph.add("Sqrt", power), 2.0 / length)


def _power(graph: Graph, segments: str, transforms: tuple[np.ndarray, np.ndarray]) -> str:
    """re² + im² of segments (…, L) that have lost their means."""
    mean = graph.add("ReduceMean", segments, axes=[-1], keepdims=1)
    centred = graph.add("Sub", segments, mean)
    real, imaginary = (graph.add("MatMul", centred, transform) for transform in transforms)
    return graph.add("Add", graph.add("Mul", real, real), graph.add("Mul", imaginary, imaginary))


def _transforms(length: int, lines: np.ndarray, window: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices (length, lines) that give re and im of a windowed segment."""
    angles = 2.0 * np.pi / length * ((np.arange(length)[:, None] * lines) % length)
    return window[:, None] * np.cos(angles), window[:, None] * np.sin(angles)
