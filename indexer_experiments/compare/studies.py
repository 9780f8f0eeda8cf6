"""The studies by the name under which the command knows them."""

from __future__ import annotations

from indexer_experiments.compare import baselines, benchmark, novelty, robustness, severity
from indexer_experiments.compare.study import Study

STUDIES: dict[str, Study] = {
    "baselines": baselines.STUDY,
    "benchmark": benchmark.STUDY,
    "severity": severity.STUDY,
    "novelty": novelty.STUDY,
    "robustness": robustness.STUDY,
}
