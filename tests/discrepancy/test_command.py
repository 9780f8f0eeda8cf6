"""The command from end to end: a drive with hidden friction, and each refusal in one sentence before any fit."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from discrepancy import __main__ as command

EMPS = Path(__file__).parents[3] / "shared" / "data" / "emps" / "DATA_EMPS.mat"


@pytest.fixture
def run(run_command):
    """Run the command with these arguments; gives exit code, stdout and stderr."""
    return partial(run_command, command)


def drive(path: Path) -> Path:
    """A data set in the form of EMPS: 10 s of two cycles, 95 kg, 200 N s/m, 20 N; seed 4."""
    time = np.arange(10000) * 1e-3
    position = 0.1 * np.sin(2.0 * np.pi * 0.2 * time) + 0.02 * np.sin(2.0 * np.pi * 0.6 * time)
    rate = np.gradient(position, 1e-3)
    force = 95.0 * np.gradient(rate, 1e-3) + 200.0 * rate + 20.0 * rate / np.hypot(rate, 1e-3)
    noise = 0.3 * np.random.default_rng(4).standard_normal(len(time))
    columns = {"t": time, "qg": position, "qm": position, "vir": (force + noise) / 35.0}
    scipy.io.savemat(path, {**{name: row[:, None] for name, row in columns.items()}, "gtau": 35.0})
    return path


def test_a_drive_leaves_its_report(run, tmp_path: Path) -> None:
    path = drive(tmp_path / "drive.mat")
    code, out, err = run("system=emps", f"measured={path}", f"out={tmp_path / 'out'}", "seed=3")
    assert (code, err) == (0, ""), err
    held = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert held == ["machine.yaml", "report.html", "report.json"]
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["headline"] in out and report["seed"] == 3
    assert {"friction.coulomb", "friction.viscous"} <= {effect["name"] for effect in report["effects"]}
    assert "of 6: calibrate and name" in out
    code, _, err = run("system=emps", f"measured={path}", f"out={tmp_path / 'out'}")
    assert code == 2 and "overwrite=true" in err


def test_a_drive_with_a_hole_is_refused(run, tmp_path: Path) -> None:
    path = drive(tmp_path / "drive.mat")
    columns = scipy.io.loadmat(path)
    columns["vir"][700] = np.nan
    scipy.io.savemat(path, {name: row for name, row in columns.items() if not name.startswith("_")})
    code, _, err = run("system=emps", f"measured={path}", f"out={tmp_path / 'report'}")
    assert code != 0 and "its vir is not finite throughout" in err and "Traceback" not in err


def test_a_drive_in_rows_is_refused(run, tmp_path: Path) -> None:
    path = drive(tmp_path / "drive.mat")
    columns = scipy.io.loadmat(path)
    scipy.io.savemat(path, {name: row.T for name, row in columns.items() if not name.startswith("_")})
    code, _, err = run("system=emps", f"measured={path}", f"out={tmp_path / 'out'}")
    assert code == 2 and "must be the data set EMPS as published" in err and "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["system=emps", "measured=gone.mat", "out=x"], "must be the data set EMPS as published"),
        (["system=emps", "measured=gone.mat", "out=x", "machine=smooth"], "machine must be left out with system=emps"),
        (["system=crane", "measured=a", "out=x"], "system must be one of indexer, emps, got 'crane'"),
        (["measured=gone", "out=x"], "measured must be a folder or pattern with measured files, got 'gone'"),
        (["measured=[gone.csv]", "out=x"], "must be files that exist"),
        (["measured=gone", "out=x", "machine=gone.yaml"], "There is no machine preset or YAML file 'gone.yaml'"),
        (["measured=gone", "out=x", "seed=-1"], "seed must be a whole number >= 0"),
        (["measured=gone"], "out must be given"),
    ],
)
def test_a_mistake_is_one_sentence(run, tmp_path: Path, monkeypatch, arguments: list[str], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = run(*arguments)
    assert code == 2 and said in err and err.count("\n") == 1, err
    assert list(tmp_path.iterdir()) == []


def test_a_file_with_a_hole_is_refused_with_its_place(run, tmp_path: Path) -> None:
    text = "time [s],acc [rad/s^2]\n" + "".join(f"{k / 1000},{'nan' if k == 70 else 1.0 + k % 3}\n" for k in range(200))
    (tmp_path / "run.csv").write_text(text)
    known = ("known.motor_speed_rpm=1500", "known.load_torque=2")
    code, _, err = run(f"measured={tmp_path}", f"out={tmp_path / 'out'}", *known)
    assert code == 2 and "run.csv" in err and "nan" in err.lower(), err
    code, _, err = run(f"measured={tmp_path}", f"out={tmp_path / 'out'}")
    assert code == 2 and "lacks motor_speed, load_torque" in err, err


def test_a_file_given_twice_is_refused(run, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("time [s],acc [rad/s^2]\n0,1\n")
    code, _, err = run(f"measured=[{tmp_path}/run.csv,{tmp_path}/run.csv]", f"out={tmp_path / 'out'}")
    assert code == 2 and "must be different files" in err, err


@pytest.mark.slow
@pytest.mark.skipif(not EMPS.exists(), reason="the measured data are not here")
def test_the_measured_drive_gets_both_frictions(run, tmp_path: Path) -> None:
    """Inertia alone at the start; published: 95.1 kg, 203.5 N s/m, 20.4 N, 4.1 % of the force left."""
    code, _, err = run("system=emps", f"measured={EMPS}", f"out={tmp_path / 'out'}")
    assert code == 0, err
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    names = {effect["name"] for effect in report["effects"]} | set(report["ambiguous"])
    assert {"friction.coulomb", "friction.viscous"} <= names
    assert report["gap"]["before"] > 0.6 and report["gap"]["after"] < 0.05
    assert "standstill" in report["next"][0]["measurement"]
