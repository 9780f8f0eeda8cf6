"""Which method names the faults best, on data from easy to hard."""

from __future__ import annotations

import time

from classifier.dataset import Dataset
from classifier.results import Row
from indexer_experiments.compare.draw import dots
from indexer_experiments.compare.measure import METRICS, measured, temperature_of
from indexer_experiments.compare.methods import METHODS
from indexer_experiments.compare.methods.own import method_of
from indexer_experiments.compare.recipes import BENCH, TABLE2, drawn, varied
from indexer_experiments.compare.study import Setting, Study

WRONG = METRICS[0][0]
LEARNING, NAMING = "learning [s]", "naming [ms]"
"""Processor time to learn from the data set, and to name one record of 8.2 s."""


def run(setting: Setting) -> list[Row]:
    """Every method on every data set; judged on the validation subset."""
    recipes = {"table2": TABLE2, "bench": BENCH, "drawn": drawn(setting.records), "varied": varied(setting.records)}
    sets = ((data, setting.dataset(recipe)) for data, recipe in recipes.items())
    return [row for data, dataset in sets for row in rows_of("baselines", data, dataset, setting)]


def rows_of(study: str, data: str, dataset: Dataset, setting: Setting) -> list[Row]:
    """The metrics of each method of a setting on a data set that is called `data`."""
    rows: list[Row] = []
    control, validation = dataset.rows("control"), dataset.rows("validation")
    for name in setting.methods:
        method = method_of(name)
        started = time.process_time()
        fitted = method.fit(dataset, setting.seed)
        learnt = time.process_time()
        logits = fitted.logits(dataset.records[validation])
        found = {NAMING: 1e3 * (time.process_time() - learnt) / int(validation.sum()), LEARNING: learnt - started}
        temperature = temperature_of(dataset.codes, fitted.logits(dataset.records[control]), dataset.classes[control])
        found |= measured(dataset.codes, logits, dataset.classes[validation], temperature)
        rows += [Row(study, data, name, metric, setting.seed, value) for metric, value in found.items()]
    return rows


STUDY = Study(
    "Which method names the faults best?",
    tuple(METHODS),
    run,
    (*METRICS, (LEARNING, 1), (NAMING, 2)),
    {"baselines": lambda rows: dots(rows, WRONG)},
    (WRONG, "mlp"),
    own=True,
)
