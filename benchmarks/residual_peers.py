"""The gap closed beside models that learn the residual: ``python -m benchmarks.residual_peers [--cases N] [--seed S]``

Each case is one of `indexer_experiments.challenge`: an effect hidden in a machine, records of two conditions to learn
from, one at a speed and load never fitted. The same calibrated base model is extended three ways:

    named     by the effect that `explain` names, as the command does
    sparse    by a torque on the table that is sparse in a library of functions (pysindy's STLSQ, as in SINDy: Brunton,
              Proctor and Kutz, PNAS 113 (2016)), its threshold chosen by leaving out windows
    Gaussian  by a Gaussian process on the same inputs (scikit-learn), its length scales by maximum likelihood

Inputs are what is known beforehand at any speed: cam phase, table angle, the law's rate and acceleration of the table,
the base model's own acceleration, motor speed, load. What is shown is the share of the closable gap that closes on the
record held out; below 0 a model makes things worse. Needs the extra [peers].
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from discrepancy import NONE, explain
from discrepancy.held_out import held_place
from discrepancy.indexer import IndexerModel
from discrepancy.place import Point
from discrepancy.problem import Problem
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env import Sensor
from indexer_experiments.challenge.draw import KNOWN_TO, Order, draw
from indexer_experiments.challenge.records import read_case, write_records

_TURN = 2.0 * math.pi
_HARMONICS = 8
_THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.5)
"""Of STLSQ, over the spread of the torque; columns are normalised."""

_POINTS = 1000
"""Samples that the Gaussian process learns from: its cost grows with their cube."""


@dataclass(frozen=True, eq=False)
class Samples:
    """What a residual model learns from: inputs (n, k), torque (n,) [N m], window of each (n,), noise of the torque."""

    inputs: np.ndarray
    torque: np.ndarray
    window: np.ndarray
    noise: np.ndarray


def samples_of(model: IndexerModel, place: Point) -> Samples:
    """Every sample of a model's windows, the base model at a place."""
    residual = Problem(model, NONE).left(place)
    w = model.windows
    rows = []
    for k, (record, first, count) in enumerate(zip(w.record, w.first, w.count, strict=True)):
        experiment = model.experiments[record]
        point, signal = experiment.operating_point, experiment.signal
        measured, noise = signal.values[first : first + count], experiment.noise_level
        cam_rate = model.machine.reduction * point.motor_speed
        cam = point.start_angle + cam_rate * (first + np.arange(count)) / signal.sample_rate
        law = model.machine.motion_law.evaluate(cam, model.machine.stations, model.machine.motion_share)
        table = law[0]
        simulated = measured + noise * residual[k, :count]
        columns = [cam, table, law[1] * cam_rate, law[2] * cam_rate**2, simulated, np.full(count, cam_rate)]
        columns += [np.full(count, point.load_torque), measured - simulated, np.full(count, k), np.full(count, noise)]
        rows.append(np.stack(columns))
    *inputs, left, window, noise = np.concatenate(rows, axis=1)
    inertia = model.machine.table_inertia
    return Samples(np.stack(inputs, axis=1), inertia * left, window, inertia * noise)


def library(inputs: np.ndarray) -> np.ndarray:
    """Candidate functions (n, f) of the sparse model, each over its largest value."""
    cam, table, rate, acceleration, simulated, cam_rate, load = inputs.T
    columns = [np.ones_like(cam), rate, rate**2, rate**3, np.tanh(rate / 0.02), acceleration, simulated]
    columns += [np.maximum(simulated, 0.0), simulated**2, simulated**3, load, np.sin(table), np.cos(table)]
    for k in range(1, _HARMONICS + 1):
        columns += [np.sin(k * cam), np.cos(k * cam), np.sin(k * cam) * cam_rate**2, np.cos(k * cam) * cam_rate**2]
    return np.stack(columns, axis=1)


def sparse(learned: Samples, held: Samples) -> np.ndarray:
    """Torque on the record held out (n,) by sparse regression."""
    import pysindy

    X, spread = library(learned.inputs), learned.torque.std()
    # What did not vary while it learned, the load, say, cannot have been learned from; the constant stays.
    varied = np.flatnonzero((np.ptp(X, axis=0) > 1e-9 * np.abs(X).max(axis=0)) | (np.arange(X.shape[1]) == 0))
    scale = np.abs(X[:, varied]).max(axis=0)
    X = X[:, varied] / scale

    def fitted(threshold: float, mine: np.ndarray) -> np.ndarray:
        optimizer = pysindy.STLSQ(threshold=threshold * spread, alpha=1e-3)
        with warnings.catch_warnings():
            # STLSQ warns where nothing reaches the threshold; that model is then 0, as it should be.
            warnings.simplefilter("ignore")
            optimizer.fit(X[mine], learned.torque[mine, None])
        return np.asarray(optimizer.coef_)[0]

    fold = learned.window.astype(int) % 4

    def error(threshold: float) -> float:
        left = [
            ((X[fold == k] @ fitted(threshold, fold != k) - learned.torque[fold == k]) ** 2).sum() for k in range(4)
        ]
        return float(sum(left))

    best = min(_THRESHOLDS, key=error)
    return (library(held.inputs)[:, varied] / scale) @ fitted(best, np.ones(len(X), dtype=bool))


def gaussian(learned: Samples, held: Samples, rng: np.random.Generator) -> np.ndarray:
    """Torque on the record held out (n,) by a Gaussian process."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    def inputs(samples: Samples) -> np.ndarray:
        cam, table, rate, _, simulated, cam_rate, load = samples.inputs.T
        waves = [f(k * cam) for k in (1, 2) for f in (np.sin, np.cos)] + [np.sin(table), np.cos(table)]
        return np.stack([*waves, rate, simulated, cam_rate, load], axis=1)

    varied = inputs(learned).std(axis=0) > 1e-9
    X = inputs(learned)[:, varied]
    middle, scale = X.mean(axis=0), X.std(axis=0)
    chosen = rng.choice(len(X), min(_POINTS, len(X)), replace=False)
    spread = learned.torque.std()
    # Length scales begin where neighbours are alike: from shorter ones the likelihood leads to noise alone.
    kernel = ConstantKernel(1.0) * RBF(np.full(X.shape[1], 4.0), (0.05, 1e3)) + WhiteKernel(0.1, (1e-4, 10.0))
    process = GaussianProcessRegressor(kernel, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit((X[chosen] - middle) / scale, learned.torque[chosen] / spread)
    return spread * process.predict((inputs(held)[:, varied] - middle) / scale)


def closed(held: Samples, predicted: np.ndarray) -> float:
    """Share of the closable gap that a predicted torque closes."""
    before = float(((held.torque / held.noise) ** 2).sum())
    after = float((((held.torque - predicted) / held.noise) ** 2).sum())
    return (before - after) / (before - len(held.torque))


def case(order: Order, number: int) -> tuple[str, dict[str, float]]:
    """One case: what was hidden and found, and the shares closed."""
    drawn = draw(order, number)
    with tempfile.TemporaryDirectory() as folder:
        write_records(drawn, order.turns, Path(folder))
        records = read_case(Path(folder), drawn.nominal)
    parts = records.fitted, records.held_out
    model, held_out = (IndexerModel(drawn.nominal, part, uncertainty=KNOWN_TO) for part in parts)
    subject = IndexerSubject(drawn.nominal, Sensor(), records, KNOWN_TO)
    answer = explain(model, held_out, None, subject.forms(), subject.elsewhere)
    # with the noise that is believed
    model, held_out, base = answer.model, answer.held_out, answer.base.place
    learned, held = samples_of(model, base), samples_of(held_out, held_place(base, held_out))
    shares = {
        # as the peers', over the noise stated, and below 0 where a name makes things worse
        "named": (answer.before**2 - answer.after**2) / (answer.before**2 - 1.0),
        "sparse": closed(held, sparse(learned, held)),
        "Gaussian": closed(held, gaussian(learned, held, np.random.default_rng(number))),
    }
    hidden = " + ".join(effect.name for effect in drawn.hidden)
    return f"{hidden:26s} gap {answer.before:5.2f}  {answer.verdict:11s} {' + '.join(answer.names):26s}", shares


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=22)
    parser.add_argument("--seed", type=int, default=2000)
    parser.add_argument("--play", default="healthy")
    options = parser.parse_args()
    order = Order(options.cases, options.seed, play=options.play, gap=(3.0, 10.0))
    rows: list[dict[str, float]] = []
    for number in range(options.cases):
        started = time.process_time()
        line, shares = case(order, number)
        rows.append(shares)
        text = "  ".join(f"{name} {100.0 * share:7.1f} %" for name, share in shares.items())
        print(f"{line}  {text}  {time.process_time() - started:.0f} s", flush=True)
    for name in rows[0]:
        values = np.array([row[name] for row in rows])
        low, middle, high = np.quantile(values, (0.25, 0.5, 0.75))
        print(f"{name:9s} median {100 * middle:6.1f} %, quartiles {100 * low:.1f} to {100 * high:.1f} %")


if __name__ == "__main__":
    main()
