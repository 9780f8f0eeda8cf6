"""What is left of each method on machines, speeds, loads and sensors that it was not trained for."""

from __future__ import annotations

import numpy as np

from classifier.codes import CodeBook
from classifier.dataset import Dataset
from classifier.results import Row
from classifier.tasks.novelty import Novelty
from datagen.shard import Records
from indexer_experiments.compare.draw import matrix
from indexer_experiments.compare.measure import measured
from indexer_experiments.compare.methods import METHODS
from indexer_experiments.compare.methods.base import Fitted
from indexer_experiments.compare.recipes import BENCH, but, drawn, varied
from indexer_experiments.compare.study import Setting, Study
from indexer_experiments.compare.trained import Seen

REFUSED = "refused as novel [%]"
WRONG = "misclassified [%]"

CHANGES: dict[str, tuple[str, ...]] = {
    "as trained": (),
    "noise 20 dB": ("sensor.noise_snr_db=20", "sensor.noise_density=0"),
    "noise 10 dB": ("sensor.noise_snr_db=10", "sensor.noise_density=0"),
    "noise 0 dB": ("sensor.noise_snr_db=0", "sensor.noise_density=0"),
    "speed -2 %": ("operating_point.motor_speed_rpm=1470", "run.samples=8200"),
    "speed -10 %": ("operating_point.motor_speed_rpm=1350", "run.samples=8200"),
    "load 20 N m": ("operating_point.load_torque=20",),
    "gain +10 %": ("sensor.gain=1.1",),
    "low pass 50 Hz": ("sensor.lowpass_hz=50",),
    "drift 0.5 m/s² a second": ("sensor.offset_drift=0.5",),
    "hum 1 m/s²": ("sensor.hum_amplitude=1",),
    "bracket 80 Hz": ("sensor.bracket_hz=80",),
}
"""What differs from the training in the test sets of the reference machine, as arguments of `datagen`; its sensor has
noise of 40 dB or less, gain 1, a low pass of 200 Hz, hum of 0.02 m/s² and a bracket of 320 Hz."""

WIDER = "machines ±20 %"


def run(setting: Setting) -> list[Row]:
    """Methods and the novelty part taught on the data set `drawn`, judged on changed ones; then each of three data sets
    taught, each judged."""
    count = max(100, setting.records // 5)
    tests = {name: but(drawn(count), f"change{place}", *change) for place, (name, change) in enumerate(CHANGES.items())}
    tests[WIDER] = drawn(count, 0.2)
    drawn_set = setting.dataset(drawn(setting.records))
    changed = {name: setting.apart(recipe) for name, recipe in tests.items()}
    rows = _judged(setting, drawn_set, {name: name for name in changed}, changed)

    across = {"bench": setting.apart(BENCH), "drawn": changed["as trained"], "varied": setting.apart(varied(count))}
    taught = {"bench": BENCH, "drawn": drawn(setting.records), "varied": varied(setting.records)}
    for data, recipe in taught.items():
        names = {test: f"{data} taught, {test} judged" for test in across}
        rows += _judged(setting, setting.dataset(recipe), names, across)
    return rows


def _judged(setting: Setting, dataset: Dataset, names: dict[str, str], tests: dict[str, Records]) -> list[Row]:
    rows: list[Row] = []
    for method in setting.methods:
        fitted: Fitted = METHODS[method].fit(dataset, setting.seed)
        for test, name in names.items():
            found = _measured(dataset.codes, fitted, tests[test])
            rows += [Row("robustness", name, method, metric, setting.seed, value) for metric, value in found.items()]
    seen = Seen.of(dataset)
    part = Novelty.fit(dataset, seen.scaled, np.empty((len(seen.scaled), 0)), setting.seed)
    for test, name in names.items():
        records = tests[test].records
        refused = part.assess(seen.features.apply(records), np.empty(0), records)["is_novel"]
        rows.append(Row("robustness", name, "novelty", REFUSED, setting.seed, float(100 * refused.mean())))
    return rows


def _measured(codes: CodeBook, fitted: Fitted, test: Records) -> dict[str, float]:
    return measured(codes, fitted.logits(test.records), test.table.column("class").to_numpy())


STUDY = Study(
    "What is left of each method where machine, operation or sensor are not those of the training?",
    ("mlp", "mlp, log", "logistic", "logistic, log", "boosting", "CNN"),
    run,
    ((WRONG, 1), ("macro F1", 3), ("AUROC", 3), (REFUSED, 1)),
    {"robustness": lambda rows: matrix(rows, (WRONG, REFUSED))},
)
