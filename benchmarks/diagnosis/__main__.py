"""`python -m benchmarks.diagnosis [--quick]`: evaluate the baselines, print, and write page, picture and results."""

from __future__ import annotations

import argparse
import dataclasses
import json

import gymnasium

import indexer_env  # noqa: F401 (registers the environment)
from benchmarks.diagnosis import page
from benchmarks.diagnosis.evaluate import QUICK, Size, evaluate, label
from benchmarks.report import with_table
from indexer_env.diagnosis_env import IndexerDiagnosisEnv


def main() -> None:
    """Run; a quick run prints only, since its numbers are not those of the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.diagnosis", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few cases, a look whether all runs; nothing is written")
    size = QUICK if parser.parse_args().quick else Size()
    env = gymnasium.make("indexer_env/IndexerDiagnosis-v1").unwrapped
    assert isinstance(env, IndexerDiagnosisEnv)
    rows, told = evaluate(env, size, lambda text: print(text, "…", flush=True))
    results = {
        "size": dataclasses.asdict(size),
        "names": list(env.names),
        "settings": [label(setting) for setting in env.settings],
        "rows": [dataclasses.asdict(row) for row in rows],
        "told": told.round(4).tolist(),
    }
    print(page.tables(results))
    if size is QUICK:
        return
    page.RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    page.PAGE.write_text(with_table(page.PAGE.read_text(encoding="utf-8"), page.tables(results)), encoding="utf-8")
    page.draw(results)


if __name__ == "__main__":
    main()
