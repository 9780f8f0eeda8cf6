"""A sweep leaves one table: job -> what it was given -> what came out."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

from indexer_cli.sweep import TABLE, write_table

SHORT = ("run.sample_rate=200", "run.samples=200", "run.warmup_turns=0")


def sweep(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "indexer_cli", "simulate", "-m", *SHORT, *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_what_is_the_same_in_all_jobs_is_left_out(tmp_path):
    rows = [
        {"job": 0, "given": {"a": "1", "out": "x"}, "results": {"rms": 2.0}, "reason": ""},
        {"job": 1, "given": {"a": "2", "out": "x"}, "results": {}, "reason": "a must be 1, got 2."},
    ]
    write_table(rows, tmp_path / TABLE)
    assert (tmp_path / TABLE).read_text().splitlines() == [
        "job,a,outcome,rms,reason",
        "0,1,done,2.0,",
        '1,2,failed,,"a must be 1, got 2."',
    ]


@pytest.mark.parametrize("launcher", ["basic", "joblib"])
def test_jobs_results_and_reasons_stand_in_one_table(launcher, tmp_path):
    done = sweep(tmp_path, "faults.backlash_deg=0,10,-5", "out=sw", f"hydra/launcher={launcher}")
    assert done.returncode == 2, done.stderr
    # joblib gives up at the job that failed, before the last word is said.
    assert ("3 jobs, 1 failed: sw/sweep.csv" in done.stdout) == (launcher == "basic")
    rows = table(tmp_path / "sw" / TABLE)
    assert [row["faults.backlash_deg"] for row in rows] == ["0", "10", "-5"]
    assert [row["outcome"] for row in rows] == ["done", "done", "failed"]
    assert [row["class"] for row in rows] == ["intact", "backlash", ""]
    assert float(rows[1]["rms"]) > 0.0
    assert "backlash" in rows[2]["reason"] and rows[0]["reason"] == ""
    assert {"0", "1", TABLE} <= {path.name for path in (tmp_path / "sw").iterdir()}


def test_a_sweep_over_its_own_folder_is_refused(tmp_path):
    """Its table would lie in pieces."""
    done = sweep(tmp_path, "seed=1", "out=a,b")
    assert done.returncode == 2 and "out must be one folder in a sweep, for OUT/<job number>" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_rows_of_an_earlier_sweep_are_forgotten(tmp_path):
    assert sweep(tmp_path, "seed=0,1", "out=sw").returncode == 0
    done = sweep(tmp_path, "seed=7", "out=sw", "overwrite=true")
    assert "1 job, 0 failed: sw/sweep.csv" in done.stdout
    assert [row["job"] for row in table(tmp_path / "sw" / TABLE)] == ["0"]
    assert not (tmp_path / "sw" / ".sweep").exists()


def test_one_run_leaves_no_table(tmp_path):
    command = [sys.executable, "-m", "indexer_cli", "simulate", *SHORT, "out=one"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == ["record.csv", "record.json", "record.png"]
    assert [path.name for path in tmp_path.iterdir()] == ["one"]
