"""Which method names the faults best, on data from easy to hard."""

from __future__ import annotations

import time
from collections.abc import Sequence

from matplotlib.figure import Figure

from classifier.compare.draw import dots
from classifier.compare.measure import METRICS, measured, temperature_of
from classifier.compare.recipes import BENCH, TABLE2, drawn, varied
from classifier.compare.results import Row
from classifier.compare.study import Setting, Study

LEARNING, NAMING = "learning [s]", "naming [ms]"
"""Processor time to learn from the data set, and to name one record of 8.2 s."""


def run(setting: Setting) -> list[Row]:
    """Every method on every data set; judged on the validation subset."""
    rows: list[Row] = []
    for recipe in (TABLE2, BENCH, drawn(setting.records), varied(setting.records)):
        dataset = setting.dataset(recipe)
        control, validation = dataset.rows("control"), dataset.rows("validation")
        for name, method in setting.chosen().items():
            started = time.process_time()
            fitted = method.fit(dataset, setting.seed)
            learnt = time.process_time()
            logits = fitted.logits(dataset.records[validation])
            found = {NAMING: 1e3 * (time.process_time() - learnt) / int(validation.sum()), LEARNING: learnt - started}
            temperature = temperature_of(
                dataset.codes, fitted.logits(dataset.records[control]), dataset.classes[control]
            )
            found |= measured(dataset.codes, logits, dataset.classes[validation], temperature)
            rows += [
                Row("baselines", recipe.name, name, metric, setting.seed, value) for metric, value in found.items()
            ]
    return rows


def draw(rows: Sequence[Row]) -> dict[str, Figure]:
    """Misclassified records of every method, a panel for each data set."""
    return {"baselines": dots(rows, "misclassified [%]")}


STUDY = Study(
    "Which method names the faults best?",
    run,
    (*METRICS, (LEARNING, 1), (NAMING, 2)),
    draw,
)
