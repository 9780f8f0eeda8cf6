"""What is measured of probabilities: the metrics that all comparisons of classes share."""

from __future__ import annotations

import numpy as np

from classifier.codes import CodeBook
from classifier.evaluate import confusion_of, macro_f1, mean_auroc, reliability
from classifier.tasks.confidence import fit_temperature, softmax

METRICS = (
    ("misclassified [%]", 2),
    ("macro F1", 3),
    ("AUROC", 4),
    ("ECE [%]", 2),
    ("ECE at T [%]", 2),
)
"""Names with decimals. AUROC: mean over the classes of each against the others. ECE: expected calibration error of the
most probable class, before and after the temperature T that the control subset asks for."""


def measured(
    codes: CodeBook, logits: np.ndarray, classes: np.ndarray, temperature: float | None = None
) -> dict[str, float]:
    """Metrics by name of logits (n, classes) for records of classes (n,); without a temperature those of the
    probabilities as they stand alone."""
    true, named = codes.positions(classes), logits.argmax(axis=1)
    one_hot = np.eye(len(codes.classes))[true]
    found = {
        "misclassified [%]": float(100 * np.mean(named != true)),
        "macro F1": macro_f1(confusion_of(true, named, len(codes.classes))),
        "AUROC": mean_auroc(softmax(logits), one_hot),
        "ECE [%]": 100 * reliability(softmax(logits).max(axis=1), named == true).error,
    }
    if temperature is not None:
        calibrated = softmax(logits, temperature).max(axis=1)
        found["ECE at T [%]"] = 100 * reliability(calibrated, named == true).error
    return found


def temperature_of(codes: CodeBook, logits: np.ndarray, classes: np.ndarray) -> float:
    """Temperature fitted to logits (n, classes) of control records of classes (n,)."""
    return fit_temperature(logits, codes.positions(classes))
