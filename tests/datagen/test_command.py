"""The command line: every mistake is one sentence and exit code 2, nothing is left in the working folder."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import datagen.__main__ as command
from datagen.shard import read_manifest, read_shards
from indexer_cli.command import BAD_INPUT, INTERRUPTED
from indexer_env.presets import config_dir
from tests.patience import PATIENCE

SHORT = ["run.samples=200", "run.warmup_turns=1", "count=2"]


@pytest.fixture
def call(tmp_path, monkeypatch, run_command):
    """Run the command in an empty working folder; gives exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    return functools.partial(run_command, command)


def test_a_data_set_and_nothing_else_in_the_folder(call, tmp_path):
    code, out, _ = call("campaign=table2", "out=set", "seed=5", *SHORT)
    assert code == 0 and "2 records" in out
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
    assert read_manifest("set")["config"]["seed"] == 5
    assert read_manifest("set")["config"]["run"]["samples"] == 200


def test_any_key_of_the_machine_reaches_the_rows(call):
    call("campaign=table2", "out=set", "machine.table_inertia=6.5", "sensor.gain=2.0", *SHORT)
    table = read_shards("set").table
    assert set(table.column("table_inertia").to_pylist()) == {6.5}
    assert set(table.column("sensor_gain").to_pylist()) == {2.0}


def test_effects_reach_the_rows(call):
    call("campaign=table2", "out=set", "+machine.effects={friction.coulomb:{torque:3.0}}", *SHORT)
    rows = read_shards("set").table.column("effects").to_pylist()
    assert all('"friction.coulomb", "torque": 3.0' in effects for effects in rows)


@pytest.mark.parametrize(
    "arguments",
    [
        ["+machine.effects.friction.coulomb.torque={uniform:[1,2]}"],
        ["+machine.effects.friction.coulomb.torque=50", "~campaign.draws.effects.friction.coulomb"],
        ["+machine.effects.load.imbalance={torque:5,phase_deg:9}", "~campaign.draws.effects.load.imbalance"],
    ],
)
def test_an_effect_that_the_campaign_draws_is_drawn_otherwise_or_fixed(call, arguments):
    code, _, err = call("campaign=random", "out=set", *arguments, *SHORT)
    assert code == 0, err


def test_a_sweep_writes_one_data_set_per_job(call, tmp_path):
    code, _, _ = call("-m", "campaign=table2", "out=sweep", "seed=1,2", *SHORT)
    assert code == 0
    assert [read_manifest(f"sweep/{job}")["seed"] for job in (0, 1)] == [1, 2]
    assert [path.name for path in tmp_path.iterdir()] == ["sweep"]


def test_in_a_sweep_the_other_jobs_live(call):
    code, _, err = call("-m", "campaign=table2", "out=sweep", "seed=-1,2", *SHORT)
    assert code == BAD_INPUT
    assert err.startswith("error: seed must be") and err.count("\n") == 1
    assert read_manifest("sweep/1")["seed"] == 2


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["campaign=table2"], "out must be given"),
        (["campaign=tabel2", "out=x"], "did you mean 'table2'"),
        (["campagin=table2", "out=x"], "did you mean 'campaign'"),
        (["campaign=table2", "out=x", "cuont=6"], "did you mean 'count'"),
        (["campaign=table2", "out=x", "+cuont=6"], "did you mean 'count'"),
        (["campaign=table2", "out=x", "sensor=bnch"], "did you mean 'bench'"),
        (["campaign=table2", "out=x", "machine.output_joint.stifness=1"], "did you mean 'stiffness'"),
        (["campaign=table2", "out=x", "+machine.output_joint.stifness=1"], "did you mean 'stiffness'"),
        (["campaign=table2", "out=x", "machine.output_joint.stiffness=-1"], "stiffness must be"),
        (["campaign=table2", "out=x", "machine.output_joint.stiffness=stiff"], "stiffness must be"),
        (
            ["campaign=table2", "out=x", "machine.effects={friction.coulomb:{torque:3}}"],
            "write +machine.effects=",
        ),
        (["campaign=table2", "out=x", "+machine.effects={friction.colomb:{torque:3}}"], "'friction.coulomb'"),
        (["campaign=table2", "out=x", "count=six"], "error: count must be a whole number"),
        (["campaign=table2", "out=x", "seed=1,2"], "seed must be one value, got '1,2'"),
        (["campaign=table2", "out=x", "overwrite=maybe"], "overwrite must be true or false"),
        (["campaign=table2", "out=x", "count=["], "KEY=VALUE pairs, got 'count=['"),
        (["campaign=table2", "out=x", "machine=42"], "machine must be one of reference, smooth, got '42'"),
        (["campaign=table2", "out=x", "machine.effects=[friction]"], "machine.effects must be of the kind"),
        (["campaign=table2", "out=x", "fualts.backlash=1"], "fualts must be a key of generate"),
        (["campaign=table2", "out=x", "machine.input_joint.stiffness=-1"], "stiffness must be"),
        (["campaign=table2", "out=x", "machine.input_joint.backlash=1e-3"], "left to the campaign table2"),
        (["campaign=table2", "out=x", "+campaign.draws.machine.model={choice:[A,B]}"], "table2 decides it"),
        (["campaign=table2", "out=x", "machine.model=A"], "machine.model must be left to the campaign table2"),
        (["campaign=table2", "out=x", "faults.roller=cracked"], "faults.roller must be left to the campaign table2"),
        (
            ["campaign=bench", "out=x", "faults.backlash_deg=3"],
            "faults.backlash_deg must be left to the campaign bench",
        ),
        (
            ["campaign=random", "out=x", "operating_point.load_torque=3"],
            "add ~campaign.draws.operating_point.load_torque",
        ),
        (
            ["campaign=random", "out=x", "+machine.effects.friction.coulomb.torque=50"],
            "torque must be left to campaign.draws, which draws it, got '+machine.effects.friction.coulomb.torque=50'; "
            "add ~campaign.draws.effects.friction.coulomb to fix it",
        ),
        (
            ["campaign=random", "out=x", "+machine.effects.friction.coulomb={torque: 50}"],
            "torque must be left to campaign.draws, which draws it, got "
            "'+machine.effects.friction.coulomb={torque: 50}'; "
            "add ~campaign.draws.effects.friction.coulomb to fix it",
        ),
        (
            ["campaign=table2", "out=x", "machine.input_joint={stiffness: 6e4, backlash: 1e-3}"],
            "machine.input_joint.backlash must be left to the campaign table2",
        ),
        (
            ["campaign=table2", "out=x", "+machine.effects.roller.crack={stiffness_loss: 0.4}"],
            "machine.effects.roller.crack.stiffness_loss must be left to the campaign table2",
        ),
        (["campaign=own", "out=x", "faults.roller=cracked"], "faults.roller must be left to the campaign own"),
        (
            ["campaign=random", "out=x", "sensor=bench"],
            "sensor.noise_density must be left to campaign.draws, which draws it, got 0.002",
        ),
        (["out=x", "machine.table_inertia={unifrom:[4,6]}"], "table_inertia must be"),
        (["out=x", "machine.table_inertia={uniform:[6,4]}"], "{uniform: [low, high]} with low <= high"),
        (["out=x", "machine.table_inertia={around:0.1}"], "{around: [nominal, share]} where a law stands in"),
        (["out=x", "run.samples={uniform:[100,200]}"], "sweep over it with -m"),
        (["out=x", "sensor.sample_rate={choice:[500,1000]}"], "sweep over it with -m"),
        (["out=x", "+campaign.axes.faults.backlash_deg=[0,5]", "faults.backlash_deg=3"], "left to the campaign grid"),
        (["campaign=bench", "out=x", "campaign.backlash_deg=[0,{uniform:[1,2]}]"], "must be a list of values"),
        (["campaign=bench", "out=x", "campaign.roller=[[intact],cracked]"], "a choice of values and laws"),
        (["out=x", "count=2"], "error: count must be <= 1 where nothing is drawn"),
        (["out=x", "faults.roller=broken"], "faults.roller must be one of intact, cracked, got 'broken'"),
        (["out=x", "faults.roller=cracked", "faults.roller_crack=0.2"], "left out where faults.roller is given"),
        (["campaign=table2", "out=x", "run.step=0.02", "run.sample_rate=50", "count=6"], "to resolve the fastest mode"),
        (["campaign=table2", "out=x", "run.samples=1000000000"], "samples in one file"),
        (["campaign=table2", "out=x", "machine.name=5"], "error: machine.name must be a text, got 5"),
        (["campaign=table2", "out=x", "sensor.lowpass_hz=600"], "error: sensor.lowpass_hz must be below 500 Hz"),
        (["campaign=table2", "out=x", "sensor.lowpass_hz=1e-300"], "error: sensor.lowpass_hz must be >= 0.001 Hz"),
        (["campaign=table2", "out=x", "sensor.bracket_hz=1e-300"], "error: sensor.bracket_hz must be >= 0.001 Hz"),
        (["campaign=table2", "out=x", "sensor.noise_snr_db=-1e300"], "noise_snr_db must be a finite number >= -300 dB"),
        (
            ["campaign=[1]", "out=x"],
            "error: campaign must be one of bench, benchmark-v1, grid",
        ),
        (["campaign=table2", "out=x", "run.samples=3"], "at least 16 samples, got 3"),
        (["campaign=table2", "out=null"], "error: out must be a path, got None"),
        (["campaign=table2", "out=[a,b]"], "error: out must be a path"),
        (["campaign=table2", "out="], "error: out must be a path"),
        (["campaign=table2", "out=x", "~seed"], "error: seed must be there"),
        (["campaign=table2", "out=x", "--count"], "KEY=VALUE pairs, got '--count'"),
        (["-m", "campaign=table2"], "out must be one folder in a sweep"),
        (["campaign=table2", "out=x", "count"], "KEY=VALUE pairs"),
    ],
)
def test_mistakes(call, tmp_path, arguments, sentence):
    code, out, err = call(*arguments)
    assert code == BAD_INPUT
    assert err.startswith("error: ") and err.count("\n") == 1 and sentence in err
    assert "Traceback" not in out + err
    assert list(tmp_path.iterdir()) == []


def test_a_file_s_values_that_the_campaign_draws_are_refused_as_on_the_line(call, tmp_path):
    """A table of 50 kg m² and 1200 rpm would be replaced without a word; what is not drawn counts."""
    machine = (config_dir() / "machine" / "reference.yaml").read_text(encoding="utf-8")
    heavy = re.sub(r"(?m)^table_inertia: \S+", "table_inertia: 50", machine)
    (tmp_path / "heavy.yaml").write_text(heavy, encoding="utf-8")
    (tmp_path / "slow.yaml").write_text("motor_speed_rpm: 1200\nload_torque: 2.0\nstart_angle: 0.0\n", encoding="utf-8")
    for file, said in (
        ("machine=heavy.yaml", "machine.table_inertia must be left to campaign.draws, which draws it, got 50"),
        ("operating_point=slow.yaml", "motor_speed_rpm must be left to campaign.draws, which draws it, got 1200"),
    ):
        code, _, err = call("campaign=random", "out=x", file)
        assert code == BAD_INPUT and said in err
    code, _, _ = call("campaign=table2", "out=x", "machine=heavy.yaml", *SHORT)
    assert code == 0 and set(read_shards("x").table.column("table_inertia").to_pylist()) == {50.0}


def test_the_twin_s_machine_goes_with_its_joint_draws(call, tmp_path):
    """Both state the inertia: the file the calibrated one, the joint draws what is left open about it."""
    pq.write_table(pa.table({"machine.table_inertia": [49.0, 50.0, 51.0]}), tmp_path / "posterior.parquet")
    machine = (config_dir() / "machine" / "reference.yaml").read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(re.sub(r"(?m)^table_inertia: \S+", "table_inertia: 50", machine), "utf-8")
    given = ["campaign=own", "campaign.posterior=posterior.parquet", "machine=mine.yaml"]
    code, _, err = call(*given, "campaign.split={calibration: 1, validation: 1}", "out=x", *SHORT)
    assert code == 0, err
    assert set(read_shards("x").table.column("table_inertia").to_pylist()) <= {49.0, 50.0, 51.0}


def test_help_shows_every_key_though_nothing_is_given(call):
    code, out, err = call("--help")
    assert (code, err) == (0, "") and "shard_items=576" in out and "operating_point" in out


def test_stopped_from_the_keyboard(call, monkeypatch):
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "generate", stop)
    code, _, err = call("campaign=table2", "out=x")
    assert (code, err) == (INTERRUPTED, "stopped from the keyboard\n")


def test_a_defect_keeps_its_traceback(call, monkeypatch):
    def fail(*_: object, **__: object) -> None:
        raise ValueError("a defect")

    monkeypatch.setattr(command, "generate", fail)
    with pytest.raises(ValueError, match="a defect"):
        call("campaign=table2", "out=x")


def test_the_traceback_is_shown_when_asked_for(call, monkeypatch):
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    with pytest.raises(Exception, match="count must be"):
        call("campaign=table2", "out=x", "count=0")


def test_python_m_from_any_folder(tmp_path):
    root = str(Path(command.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": root}
    done = subprocess.run(
        [sys.executable, "-m", "datagen", "campaign=table2", "out=set", *SHORT],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(read_shards(tmp_path / "set")) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
