"""Which method names the faults of the benchmark set best: of machines, at speeds and of sizes that taught none."""

from __future__ import annotations

from classifier.benchmark import SPLITS, load_benchmark
from classifier.results import Row
from indexer_experiments.compare.baselines import LEARNING, NAMING, WRONG, rows_of
from indexer_experiments.compare.draw import dots
from indexer_experiments.compare.measure import METRICS
from indexer_experiments.compare.methods import METHODS
from indexer_experiments.compare.study import Setting, Study

NAME = "benchmark-v1"


def run(setting: Setting) -> list[Row]:
    """Every method on every split; all seeds have the same records, they are those of the trainings."""
    sets = ((split, load_benchmark(NAME, split, setting.folder)) for split in SPLITS)
    return [row for split, dataset in sets for row in rows_of("benchmark", split, dataset, setting)]


STUDY = Study(
    f"Which method names the faults of {NAME} best, on machines, at speeds and of sizes that taught none?",
    tuple(METHODS),
    run,
    (*METRICS, (LEARNING, 1), (NAMING, 2)),
    {"benchmark": lambda rows: dots(rows, WRONG)},
    (WRONG, "mlp"),
    own=True,
    sized=False,
)
