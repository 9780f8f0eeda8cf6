"""The launchers of Hydra run the jobs of a sweep in processes of their own; one job is one data set."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import datagen
from datagen.shard import read_manifest
from indexer_cli.command import BAD_INPUT
from tests.patience import PATIENCE

pytestmark = pytest.mark.slow
"""Two processes that each start Python anew."""

SWEEP = ["-m", "faults.backlash_deg=-5,0,5", "out=sweep", "run.samples=40", "run.warmup_turns=0"]


@pytest.mark.parametrize("launcher", ["joblib", "submitit_local"])
def test_a_launcher_makes_every_job_and_says_that_one_failed(launcher, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(datagen.__file__).parents[1]))
    done = subprocess.run(
        [sys.executable, "-m", "datagen", *SWEEP, f"hydra/launcher={launcher}"],
        cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == BAD_INPUT, done.stderr
    # joblib runs the jobs in the command's own process where it has one processor
    said = r"error: (Job 0 of the sweep has failed: )?faults\.backlash_deg must be"
    assert re.search(said, done.stderr) and "Traceback" not in done.stderr
    assert [read_manifest(tmp_path / "sweep" / job)["config"]["faults"]["backlash_deg"] for job in ("1", "2")] == [0, 5]
    assert not (tmp_path / "sweep" / "0" / "manifest.json").exists()
