"""A sweep leaves one table: job -> what it was given -> what came out."""

import csv
import importlib
import pickle
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from indexer_cli.places.local import LocalPlace
from indexer_cli.sweep import TABLE, SweepTable, write_table
from indexer_cli.verbs import VERBS
from indexer_env.presets import config_dir

SHORT = ("run.sample_rate=200", "run.samples=200", "run.warmup_turns=0")


@pytest.fixture
def simulate(run_command, tmp_path, monkeypatch):
    """Run `indexer simulate` in an empty folder; gives exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(VERBS["simulate"].module)
    return lambda *arguments: run_command(module, *arguments[:1], *SHORT, *arguments[1:])


def in_processes(folder: Path, *arguments: str) -> tuple[int, str, str]:
    command = [sys.executable, "-m", "indexer_cli", "simulate", "-m", *SHORT, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


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
def test_jobs_results_and_reasons_stand_in_one_table(launcher, tmp_path, simulate):
    given = ("faults.backlash_deg=0,10,-5", "out=sw", f"hydra/launcher={launcher}")
    code, out, err = simulate("-m", *given) if launcher == "basic" else in_processes(tmp_path, *given)
    assert code == 2, err
    # joblib, where it has more than one core, gives up at the job that failed, before the last word is said.
    assert launcher == "joblib" or "3 jobs, 1 failed: sw/sweep.csv" in out
    rows = table(tmp_path / "sw" / TABLE)
    assert [row["faults.backlash_deg"] for row in rows] == ["0", "10", "-5"]
    assert [row["outcome"] for row in rows] == ["done", "done", "failed"]
    assert [row["class"] for row in rows] == ["intact", "backlash", ""]
    assert float(rows[1]["rms"]) > 0.0
    assert "backlash" in rows[2]["reason"] and rows[0]["reason"] == ""
    assert {"0", "1", TABLE} <= {path.name for path in (tmp_path / "sw").iterdir()}


def test_a_sweep_over_its_own_folder_is_refused(tmp_path, simulate):
    """Its table would lie in pieces."""
    code, _, err = simulate("-m", "seed=1", "out=a,b")
    assert code == 2 and "out must be one folder in a sweep, for OUT/<job number>" in err
    assert list(tmp_path.iterdir()) == []


def test_the_rows_of_an_earlier_sweep_are_forgotten(tmp_path, simulate):
    assert simulate("-m", "seed=0,1", "out=sw")[0] == 0
    _, out, _ = simulate("-m", "seed=7", "out=sw", "overwrite=true")
    assert "1 job, 0 failed: sw/sweep.csv" in out
    assert "of an earlier sweep, and in no row of the table: 1 in sw" in out
    assert [row["job"] for row in table(tmp_path / "sw" / TABLE)] == ["0"]
    assert not (tmp_path / "sw" / ".sweep").exists()


def test_a_second_sweep_in_the_folder_of_a_running_one_is_refused(tmp_path, simulate):
    """Each would forget the other's rows, and the table hold the jobs of neither."""
    with LocalPlace(tmp_path / "sw").exclusive():
        code, out, err = simulate("-m", "seed=7", "out=sw")
    assert (code, out) == (2, "") and list((tmp_path / "sw").iterdir()) == []
    assert err.startswith("error: out must be a folder that no other run is writing to, got sw; wait for it or choose")
    assert simulate("-m", "seed=7", "out=sw")[0] == 0


def test_a_sweep_holds_its_folder_while_it_runs(tmp_path):
    hydra = SimpleNamespace(sweep=SimpleNamespace(dir=str(tmp_path / "sw")))
    config, first, second = Config(out=str(tmp_path / "sw"), hydra=hydra), SweepTable(), SweepTable()
    first.on_multirun_start(config)
    with pytest.raises(SystemExit):
        second.on_multirun_start(config)
    assert vars(pickle.loads(pickle.dumps(first))) == {}
    first.on_multirun_end(config)
    second.on_multirun_start(config)
    second.on_multirun_end(config)


class Config(SimpleNamespace):
    """As much of a composed configuration as a sweep asks for."""

    def get(self, key: str) -> object:
        return getattr(self, key, None)


def test_one_run_leaves_no_table(tmp_path, simulate):
    assert simulate("out=one")[0] == 0
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == ["record.csv", "record.json", "record.png"]
    assert [path.name for path in tmp_path.iterdir()] == ["one"]


def test_a_sweep_of_which_no_job_is_done_keeps_the_table_of_an_earlier_one(tmp_path, simulate):
    assert simulate("-m", "seed=0,1", "out=sw")[0] == 0
    before = (tmp_path / "sw" / TABLE).read_text()
    code, out, err = simulate("-m", "seed=0,1", "out=sw")
    assert code == 2 and err.count("set overwrite=true to replace the earlier result") == 2
    assert "2 jobs, 2 failed; sw/sweep.csv is that of an earlier sweep" in out
    assert (tmp_path / "sw" / TABLE).read_text() == before


def test_a_sweep_in_which_all_fail_leaves_their_reasons(tmp_path, simulate):
    code, out, _ = simulate("-m", "faults.backlash_deg=-1,-2", "out=sw")
    assert code == 2 and "2 jobs, 2 failed: sw/sweep.csv" in out
    assert [row["outcome"] for row in table(tmp_path / "sw" / TABLE)] == ["failed", "failed"]


def test_a_sweep_into_the_working_folder_has_its_table_too(tmp_path, simulate):
    code, out, err = simulate("-m", "seed=0,1", "out=.")
    assert code == 0 and "2 jobs, 0 failed: sweep.csv" in out, err
    assert [row["seed"] for row in table(tmp_path / TABLE)] == ["0", "1"]


def test_files_of_a_sweep_stand_in_the_table_as_they_were_typed(tmp_path, simulate):
    """Hydra is given copies, whose names say nothing of the folder."""
    for plant in ("one", "two"):
        (tmp_path / plant).mkdir()
        (tmp_path / plant / "m.yaml").write_text((config_dir() / "machine" / "smooth.yaml").read_text())
    assert simulate("-m", "machine=one/m.yaml,two/m.yaml,reference", "out=sw")[0] == 0
    assert [row["machine"] for row in table(tmp_path / "sw" / TABLE)] == ["one/m.yaml", "two/m.yaml", "reference"]
