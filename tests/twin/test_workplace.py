"""The folder in which a twin is made: whose it is, what a killed run leaves in it, who may read it."""

from __future__ import annotations

import os
import stat

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from safetensors.numpy import load_file

from indexer_env.errors import ParameterError
from tests.twin.builders import MACHINE, NOISE, WEIGHTS, healthy, view
from tests.twin.test_judge import turns
from twin.faults import chosen
from twin.folder import about_of
from twin.settings import Settings
from twin.teach import learned
from twin.workplace import Workplace


@pytest.fixture
def open_to_all():
    """Files are for everybody to read, as on most machines."""
    before = os.umask(0o022)
    yield
    os.umask(before)


@pytest.mark.parametrize("name", ["calibration", "stage", "modes_0"])
def test_what_a_killed_run_was_writing_does_not_lock_the_folder(tmp_path, name):
    if name != "stage":
        Workplace(tmp_path, "records", False).write("calibration", {"level": 1.0})
    (tmp_path / f".{name}.part").write_text("half of")
    again = Workplace(tmp_path, "records", False)
    assert not list(tmp_path.glob(".*.part")) and again.read("stage")["made_of"] == "records"
    assert name == "stage" or again.read("calibration") == {"level": 1.0}


def test_a_part_of_somebody_elses_file_is_not_removed(tmp_path):
    Workplace(tmp_path, "records", False)
    (tmp_path / ".film.part").write_text("mine")
    with pytest.raises(ParameterError, match=r"which holds \.film\.part; name another"):
        Workplace(tmp_path, "records", False)
    assert (tmp_path / ".film.part").exists()


@pytest.mark.parametrize("finished", [True, False])
def test_a_twin_that_is_replaced_stays_until_the_new_one_is_made(tmp_path, finished):
    first = Workplace(tmp_path, "records", False)
    (tmp_path / "data").mkdir()
    if finished:
        first.write("twin", {"of": "records"})
    Workplace(tmp_path, "other records", True).write("calibration", {})
    assert (tmp_path / ".former" / "twin.yaml").exists() == finished and not (tmp_path / "twin.yaml").exists()
    # neither going on nor a third beginning loses it
    again = Workplace(tmp_path, "third records", True)
    assert (tmp_path / ".former" / "twin.yaml").exists() == finished and not (tmp_path / "calibration.yaml").exists()
    again.write("twin", {})
    again.finished()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["stage.yaml", "twin.yaml"]


def test_what_another_version_of_the_software_began_is_not_gone_on_with(tmp_path, monkeypatch):
    monkeypatch.setattr("twin.workplace.version", lambda: "0.1")
    Workplace(tmp_path, "records", False)
    monkeypatch.setattr("twin.workplace.version", lambda: "0.2")
    with pytest.raises(ParameterError, match=r"which was begun by version 0\.1 of this software; set overwrite=true"):
        Workplace(tmp_path, "records", False)


def test_a_twin_that_was_put_aside_is_found(tmp_path):
    Workplace(tmp_path, "records", False).write("twin", {})
    with pytest.raises(ParameterError, match="make one with indexer twin"):
        about_of(tmp_path / "elsewhere")
    Workplace(tmp_path, "other records", True)
    with pytest.raises(ParameterError, match=r"holds no twin\.yaml; the one before is in .*\.former"):
        about_of(tmp_path)


def test_networks_and_synthesis_are_as_readable_as_the_umask_says(tmp_path, monkeypatch, open_to_all):
    weighed = WEIGHTS, {"faults": np.zeros((7, 2))}
    monkeypatch.setattr("twin.teach.weights_by_control", lambda *given: weighed)
    known = {"machine.table_inertia": np.full(3, MACHINE.table_inertia)}
    pq.write_table(pa.table(known), tmp_path / "posterior.parquet")
    settings = Settings(epochs=1, false_alarms=0.05)
    faulty, sound = turns(60, 1, faulty=True), turns(60, 2, faulty=False)
    told = learned(tmp_path, faulty, sound, chosen(["crack", "friction"]), healthy(), view(), settings)
    assert told["taught"] == {"noise": pytest.approx(NOISE), "shift": 0.002, "radius": None}
    made = sorted(tmp_path.glob("*.safetensors"))
    assert [file.stem for file in made] == ["modes_0", "modes_1", "paper_0", "synthesis"]
    assert {stat.S_IMODE(file.stat().st_mode) for file in made} == {0o644}
    # white noise has the same power along all axes but what is projected out, also with fewer healthy turns than axes
    covariance = load_file(made[-1])["covariance"]
    assert len(covariance) > 30 and np.linalg.eigvalsh(covariance)[4] > 0.6
