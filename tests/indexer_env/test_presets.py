"""Presets by name and YAML files by path."""

import copy
import dataclasses
import math
import pickle

import numpy as np
import pytest
import yaml

from indexer_env.errors import ParameterError
from indexer_env.machine import Machine
from indexer_env.motion_law import Cycloidal
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import config_dir, load_machine, load_operating_point, load_sensor, load_yaml
from indexer_env.sensors import Sensor

LOADERS = {
    "machine": (load_machine, Machine),
    "operating_point": (load_operating_point, OperatingPoint),
    "sensor": (load_sensor, Sensor),
}
PRESETS = [(group, path.stem) for group in LOADERS for path in sorted((config_dir() / group).glob("*.yaml"))]


@pytest.mark.parametrize(("group", "name"), PRESETS)
def test_a_preset_loads_the_same_by_name_and_by_path(group, name):
    load, kind = LOADERS[group]
    preset = load(name)
    assert type(preset) is kind
    assert load(config_dir() / group / f"{name}.yaml") == preset == load(str(config_dir() / group / f"{name}.yaml"))
    assert pickle.loads(pickle.dumps(preset)) == preset == copy.deepcopy(preset)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(preset, dataclasses.fields(preset)[0].name, None)


def test_a_table_of_cam_angles_lies_beside_its_machine(tmp_path, monkeypatch):
    """What lies in the working directory serves only where none does."""
    here, there = tmp_path / "here", tmp_path / "there"
    for folder, lift in ((here, 0.0), (there, 1.0)):
        folder.mkdir()
        angles = np.arange(361.0)
        rise = np.degrees(Cycloidal().evaluate(np.radians(angles), 8, 0.5)[0])
        rows = [f"{angle},{lift + follower}" for angle, follower in zip(angles, rise, strict=True)]
        (folder / "cam.csv").write_text("\n".join(["cam_angle_deg,follower_angle_deg", *rows, ""]))
    machine = load_yaml("machine", "reference") | {"motion_law": {"name": "table", "file": "cam.csv"}}
    (there / "mine.yaml").write_text(yaml.safe_dump(machine))
    monkeypatch.chdir(here)
    assert load_machine(there / "mine.yaml").motion_law.follower_angle[0] == pytest.approx(math.radians(1.0))
    (there / "cam.csv").unlink()
    assert load_machine(there / "mine.yaml").motion_law.follower_angle[0] == 0.0


def test_there_are_presets_of_every_group():
    assert {group for group, _ in PRESETS} == set(LOADERS)


def test_the_defaults_are_the_reference_and_the_ideal():
    assert load_machine() == load_machine("reference")
    assert load_operating_point() == OperatingPoint() == load_operating_point("reference")
    assert load_sensor() == Sensor()


def test_the_reference_machine_is_that_of_the_design():
    """docs/explanation/physics.md, section The reference machine."""
    machine = load_machine("reference")
    assert (machine.stations, machine.reduction_ratio, machine.motion_share) == (8, 25.625, 0.5)
    assert (machine.motion_law.name, machine.model, machine.contact_law) == ("modified_sine", "B", "clipped")
    assert (machine.cam_inertia, machine.follower_inertia, machine.table_inertia) == (0.5, 0.3, 5.0)
    assert (machine.housing_inertia, machine.input_joint.stiffness) == (20.0, 8000.0)
    output = machine.output_joint
    assert output.stiffness == pytest.approx(5.0 * (2.0 * 3.141592653589793 * 15.0) ** 2, rel=1e-6)
    assert output.damping == pytest.approx(2.0 * 0.03 * (output.stiffness * 5.0) ** 0.5, rel=1e-6)
    assert machine.turn_duration(OperatingPoint()) == pytest.approx(8.2, rel=1e-12)


def test_the_smooth_machine_is_the_reference_without_play():
    reference, smooth = load_machine("reference"), load_machine("smooth")
    tight = dataclasses.replace(reference.input_joint, backlash=0.0)
    assert reference.input_joint.backlash > 0.0
    assert dataclasses.replace(reference, input_joint=tight, name="smooth") == smooth


@pytest.mark.parametrize("group", LOADERS)
def test_an_unknown_preset_is_named_with_the_nearest(group):
    load, _ = LOADERS[group]
    nearest = {"machine": "reference", "operating_point": "reference", "sensor": "bench"}[group]
    with pytest.raises(ParameterError) as caught:
        load(nearest[:-1])
    assert str(caught.value) == (f"There is no {group} preset or YAML file {nearest[:-1]!r}; did you mean {nearest!r}.")
    with pytest.raises(ParameterError, match=rf"^There is no {group} preset or YAML file 'zzz'; the presets are "):
        load("zzz")
    with pytest.raises(ParameterError, match=r"YAML file 'none/here\.yaml'"):
        load("none/here.yaml")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"stations: [8", "is not readable YAML: "),
        (b"stations: \xff\xfe\xfa", "is not readable YAML: "),
        (b"", "must hold a mapping of parameters to values, got NoneType."),
        (b"- 1\n", "must hold a mapping of parameters to values, got list."),
        (b"8", "must hold a mapping of parameters to values, got int."),
        (b"stations: 8\nstations: 6", "gives 'stations' 2 times in one mapping; keep one of them."),
        (b"output_joint: {stiffness: 1.0, stiffness: 2.0}", "gives 'stiffness' 2 times in one mapping"),
        (b"stations: 8", "Machine lacks input_joint, output_joint, base_joint, "),
    ],
)
def test_an_unusable_file_is_one_sentence(tmp_path, content, said):
    path = tmp_path / "machine.yaml"
    path.write_bytes(content)
    with pytest.raises(ParameterError) as caught:
        load_machine(path)
    text = str(caught.value)
    assert said in text and "\n" not in text and text.endswith(".")


def test_a_preset_keeps_its_units_in_its_keys(tmp_path):
    path = tmp_path / "slow.yml"
    path.write_text("motor_speed_rpm: 750\nload_torque: -3.0\n", encoding="utf-8")
    point = load_operating_point(path)
    assert point.motor_speed == pytest.approx(OperatingPoint().motor_speed / 2.0, rel=1e-15)
    assert load_yaml("operating_point", path) == {"motor_speed_rpm": 750, "load_torque": -3.0}


def test_a_machine_is_no_name_of_one():
    with pytest.raises(ParameterError, match=r"^presets\.machine must be the name of a preset or the path of a YAML"):
        load_machine(load_machine("reference"))  # type: ignore[arg-type]
