"""Leave one sensor out, on records that the project's simulator did not make: `python -m benchmarks.several_sensors`.

Four sensors on one rotating machine differ in gain, mounting resonance and noise; the training never sees the one that
is judged. The features that a training takes by itself for measured records are set beside the paper's, and the
paper's network beside the other methods of `classifier.leaveout`.

The machine: a shaft of about 17 Hz with harmonics, broadband noise, and two faults. `cracked` adds bursts that ring at
620 Hz, `loose` raises the harmonics. Nothing of it is a cam, a table or a joint with play.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
import torch
from scipy.signal import lfilter

from classifier.codes import CodeBook
from classifier.dataset import SUBSETS, Dataset
from classifier.feature_choice import Auto
from classifier.features import Features, Psd
from classifier.leaveout import judge, overall, side_by_side, splits
from classifier.leaveout_methods import Learn, cnn, logistic, mlp
from classifier.results import Row
from classifier.train import Result, train
from classifier.trainers.traingdx import TrainGdx

RATE, SAMPLES = 4000.0, 4000
CLASSES = ("intact", "cracked", "loose")
SENSORS = ("S1", "S2", "S3", "S4")
REPEATS = 10
"""Records of each class by each sensor, shared 6, 2 and 2 among the subsets."""


def records_of(seed: int, repeats: int = REPEATS) -> Dataset:
    """Labelled records of all sensors, drawn by the seed; a column `groups` tells the sensor.

    Gain log-uniform over 0.2 to 5, resonance 250 to 1500 Hz with a quality factor of 4 to 20, noise of 3 to 30 % of the
    signal's rms, all by sensor; by record a speed of ± 2 %, a load of ± 30 %, severities of half to once and a half.
    """
    rng = np.random.default_rng(seed)
    rows, sensors, classes = [], [], []
    for sensor in SENSORS:
        gain, noise = np.exp(rng.uniform(np.log(0.2), np.log(5.0))), rng.uniform(0.03, 0.3)
        mounting = _resonance(rng.uniform(250.0, 1500.0), rng.uniform(4.0, 20.0))
        for label, name in enumerate(CLASSES, start=1):
            for _ in range(repeats):
                true = _machine(name, rng)
                read = true + lfilter(*mounting, true)
                read += noise * read.std() * rng.standard_normal(SAMPLES)
                rows.append(gain * read)
                sensors.append(sensor)
                classes.append(label)
    shares = np.repeat(SUBSETS, (round(0.6 * repeats), round(0.2 * repeats), repeats - round(0.8 * repeats)))
    groups = [f'{{"sensor": "{sensor}"}}' for sensor in sensors]
    return Dataset(
        records=np.array(rows, dtype=np.float32),
        classes=np.array(classes),
        subsets=np.tile(shares, len(SENSORS) * len(CLASSES)),
        codes=CodeBook(tuple(range(1, len(CLASSES) + 1)), CLASSES, ("100", "010", "001")),
        sample_rate=RATE,
        quantity="table_acceleration",
        unit="m/s^2",
        provenance={"folder": "several sensors", "seed": seed},
        table=pa.table({"groups": groups, "kind": ["measured"] * len(rows)}),
    )


def _machine(name: str, rng: np.random.Generator) -> np.ndarray:
    """Acceleration (SAMPLES,) of the machine itself."""
    time, size = np.arange(SAMPLES) / RATE, rng.uniform(0.5, 1.5)
    shaft, load = 17.0 * rng.uniform(0.98, 1.02), rng.uniform(0.7, 1.3)
    raised = 1.0 + (2.0 * size if name == "loose" else 0.0)
    harmonics = sum(
        (raised if order > 1 else 1.0) / order * np.sin(2.0 * np.pi * order * shaft * time + rng.uniform(0.0, 6.28))
        for order in range(1, 9)
    )
    bursts = np.zeros(SAMPLES)
    if name == "cracked":
        bursts[np.round(np.arange(rng.uniform(0, 1), time[-1] * 2.2 * shaft) / (2.2 * shaft) * RATE).astype(int)] = size
        bursts = np.asarray(lfilter(*_resonance(620.0, 12.0), bursts))
    return load * (np.asarray(harmonics) + 0.3 * rng.standard_normal(SAMPLES) + 1.5 * bursts)


def _resonance(frequency: float, quality: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of a resonator of this frequency [Hz] whose impulse response begins near 1."""
    angle = 2.0 * np.pi * frequency / RATE
    radius = np.exp(-angle / (2.0 * quality))
    return np.array([0.0, np.sin(angle)]), np.array([1.0, -2.0 * radius * np.cos(angle), radius**2])


def compared(seeds: Sequence[int], repeats: int = REPEATS) -> list[Row]:
    """Rows of every method on every sensor; each seed draws sensors, records and starts anew."""
    rows: list[Row] = []
    for seed in seeds:
        dataset = records_of(seed, repeats)
        now = Auto().features_for(dataset)
        methods: dict[str, Learn] = {
            "mlp, linear PSD to 100 Hz (before)": mlp(_trained(Psd())),
            f"mlp, {now.scale} PSD to {now.maximum_hz:g} Hz (now)": mlp(_trained(now)),
            "logistic regression, linear PSD to 100 Hz": logistic(Psd()),
            "logistic regression, the same as now": logistic(now),
            "convolutional network, the same band as now": cnn(now),
        }
        sensors = np.repeat(SENSORS, len(CLASSES) * repeats)
        for split in splits(dataset, sensors)[0]:
            for name, learn in methods.items():
                rows += judge(split, name, learn, seed)
    return rows


def _trained(features: Features):
    def learn(rest: Dataset, seed: int) -> Result:
        return train(rest, features, TrainGdx(), seed=seed, parts=())

    return learn


if __name__ == "__main__":
    torch.set_num_threads(1)
    found = compared(range(int(sys.argv[1]) if len(sys.argv) > 1 else 5))
    print(side_by_side(found + overall(found)))
