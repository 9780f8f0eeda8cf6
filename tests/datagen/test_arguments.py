"""A YAML file where a choice of conf/ is asked for."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from datagen import __main__ as generating
from datagen.shard import read_shards
from indexer_cli.arguments import with_files
from indexer_env.errors import ParameterError
from indexer_env.presets import load_yaml

SHORT = ("run.samples=300", "run.warmup_turns=0", "executor=local")


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """The reference machine with a heavier table and friction, as a file."""
    content = load_yaml("machine", "reference") | {"table_inertia": 7.0}
    content["effects"] = {"friction.coulomb": {"torque": 12.0}}
    path = tmp_path / "machine.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def table_inertia(folder: Path) -> float:
    return read_shards(folder).table["table_inertia"][0].as_py()


def test_a_machine_file_is_generated_from(run_command, tmp_path: Path, machine: Path) -> None:
    code, _, err = run_command(generating, f"machine={machine}", f"out={tmp_path / 'set'}", *SHORT)
    assert code == 0, err
    assert table_inertia(tmp_path / "set") == 7.0


def test_a_key_goes_on_top_of_the_file(run_command, tmp_path: Path, machine: Path) -> None:
    arguments = (f"machine={machine}", f"out={tmp_path / 'set'}", "machine.table_inertia=6.5", *SHORT)
    code, _, err = run_command(generating, *arguments)
    assert code == 0, err
    assert table_inertia(tmp_path / "set") == 6.5


@pytest.mark.parametrize("name", ["prüfstand.yaml", "drawing (2).yaml", "a=b&c.yaml"])
def test_a_file_may_have_any_name(run_command, tmp_path: Path, machine: Path, name: str) -> None:
    named = machine.rename(tmp_path / name)
    code, _, err = run_command(generating, f"machine='{named}'", f"out={tmp_path / 'set'}", *SHORT)
    assert code == 0, err
    assert table_inertia(tmp_path / "set") == 7.0


def test_the_table_of_a_cam_lies_beside_the_machines_file(run_command, tmp_path: Path, machine: Path) -> None:
    from indexer_env.motion_law import motion_law

    (tmp_path / "bench").mkdir()
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    rise = motion_law("cycloidal").evaluate(angle, 8, 0.5)[0]
    rows = "\n".join(f"{math.degrees(a):.6f},{math.degrees(r):.9f}" for a, r in zip(angle, rise, strict=True))
    (tmp_path / "bench" / "cam.csv").write_text(f"cam_angle_deg,follower_angle_deg\n{rows}\n")
    content = yaml.safe_load(machine.read_text()) | {"motion_law": {"name": "table", "file": "cam.csv"}}
    (tmp_path / "bench" / "drawing.yaml").write_text(yaml.safe_dump(content))
    code, _, err = run_command(generating, f"machine={tmp_path}/bench/drawing.yaml", f"out={tmp_path / 'set'}", *SHORT)
    assert code == 0, err


def test_a_missing_or_foreign_file_is_one_sentence(run_command, tmp_path: Path) -> None:
    code, _, err = run_command(generating, "machine=gone.yaml", f"out={tmp_path / 'set'}")
    assert code == 2 and "There is no machine preset or YAML file 'gone.yaml'" in err and err.count("\n") == 1
    (tmp_path / "list.yaml").write_text("- 1\n")
    with pytest.raises(ParameterError, match="must hold a mapping"):
        with_files([f"machine={tmp_path / 'list.yaml'}"], tmp_path)


def test_other_arguments_stay_as_they_are(tmp_path: Path) -> None:
    arguments = ["machine=smooth", "out=a.yaml", "-m", "seed=1,2"]
    assert with_files(arguments, tmp_path) == arguments
    assert list(tmp_path.iterdir()) == []
