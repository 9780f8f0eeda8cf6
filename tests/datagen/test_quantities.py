"""Every quantity can be fixed, swept and drawn from the command line, and its value arrives in the row."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
from typing import Any

import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from datagen.order import order_from
from datagen.produce import produce
from datagen.quantities import FIELDS, laws_by_path, path_of
from datagen.remake import remake
from datagen.rows import machine_columns
from indexer_env.coefficients import coefficients
from indexer_env.effects import EFFECTS, SensorEffect, make_effect
from indexer_env.faults import Faults
from indexer_env.machine import Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import config_dir, load_machine
from indexer_env.sensors import Sensor

SHORT = ["run.samples=40", "run.warmup_turns=0"]

TWO: dict[str, tuple[Any, Any]] = {
    "machine.stations": (6, 8),
    "machine.motion_share": (0.4, 0.5),
    "machine.motion_law": ("modified_sine", "cycloidal"),
    "machine.model": ("B", "B_on_base"),
    "machine.contact_law": ("clipped", "damped_play"),
    "machine.name": ("one", "two"),
    "machine.input_joint.stiffness_ratio": (0.8, 0.9),
    "machine.output_joint.stiffness_ratio": (0.8, 0.9),
    "machine.base_joint.stiffness_ratio": (0.8, 0.9),
    "faults.roller_crack": (0.2, 0.4),
    "faults.cracked_station": (1, 2),
    "faults.screw_looseness": (0.5, 1.0),
    "sensor.bracket_damping": (0.02, 0.05),
    "sensor.bracket_hz": (300.0, 320.0),
    "sensor.highpass_hz": (0.5, 1.0),
    "sensor.lowpass_hz": (100.0, 200.0),
    "sensor.lowpass_order": (2, 4),
    "sensor.noise_snr_db": (20.0, 40.0),
    "sensor.full_scale": (100.0, 200.0),
    "sensor.bits": (12, 16),
    "sensor.radius": (0.3, 0.4),
    "sensor.gain": (0.9, 1.1),
}
"""Two values of the quantities that (0.001, 0.002) does not suit."""

NEEDS: dict[str, list[str]] = {
    "machine.motor_inertia": ["+machine.effects.drive.slip.compliance=0.1"],
    "machine.housing_inertia": ["machine.model=B_on_base"],
    "machine.contact_law": ["machine.input_joint.backlash=0.001"],
    "faults.cracked_station": ["faults.roller=cracked"],
    "sensor.bracket_damping": ["sensor.bracket_hz=300"],
    "sensor.lowpass_order": ["sensor.lowpass_hz=200"],
    "sensor.bits": ["sensor.full_scale=100"],
    "sensor.radius": ["sensor.radius=0.4"],
    **{f"sensor.hum_{name}": ["sensor.hum_amplitude=0.1"] for name in ("hz", "phase", "third")},
    **{f"machine.base_joint.{field.name}": ["machine.model=B_on_base"] for field in dataclasses.fields(Joint)},
}
"""What else must be set for a quantity to be seen."""

LARGE = ("stiffness", "damping", "inertia", "ratio", "motor_speed", "load_torque", "hum_hz")
"""Parts of the names of quantities of the order of magnitude of the base's own value, taken times 1.01 and 1.02."""

PATHS = [f"{section}.{name}" for section, names in FIELDS.items() for name in names]


def column_of(path: str) -> str:
    section, _, name = path.partition(".")
    prefix = {"machine": "", "operating_point": "", "faults": "fault_", "sensor": "sensor_"}[section]
    return "machine_name" if path == "machine.name" else prefix + name.replace(".", "_")


def composed(*overrides: str) -> dict[str, Any]:
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("generate", ["out=x", *SHORT, *overrides]))
    assert isinstance(config, dict)
    return {str(key): value for key, value in config.items()}


def rows_of(config: dict[str, Any], count: int) -> list[dict[str, Any]]:
    order = order_from({**config, "count": count})
    rows, records, rejected = produce(order, [order.campaign.item(i, order.base, order.seed) for i in range(count)])
    assert not rejected, rejected[0]["reason"]
    for row, record in zip(rows[:2], records[:2], strict=False):
        assert (remake(row) == record.astype("float32")).all()
    return rows


def two_values(path: str, config: dict[str, Any]) -> tuple[Any, Any]:
    if path in TWO:
        return TWO[path]
    section, _, name = path.partition(".")
    base = config[section]
    for step in name.split("."):
        base = base[step] if isinstance(base, dict) and step in base else None
    if base and any(part in path for part in LARGE):
        return base * 1.01, base * 1.02
    return (150.0, 151.0) if name == "motor_speed" else (0.001, 0.002)


@pytest.fixture(scope="module")
def plain() -> dict[str, Any]:
    return composed()


def test_the_paths_are_all_fields_of_the_frozen_classes():
    kinds = {"machine": Machine, "operating_point": OperatingPoint, "faults": Faults, "sensor": Sensor}
    expected = {f"{section}.{field.name}" for section, kind in kinds.items() for field in dataclasses.fields(kind)}
    joints = {f"machine.{name}" for name in ("input_joint", "output_joint", "base_joint")}
    expected |= {f"{joint}.{field.name}" for joint in joints for field in dataclasses.fields(Joint)}
    assert set(PATHS) == expected - joints - {"machine.effects", "sensor.sample_rate"}
    assert all(path_of(path) == path for path in PATHS)


@pytest.mark.parametrize("path", PATHS)
def test_a_quantity_is_fixed_and_drawn(path, plain):
    first, second = two_values(path, plain)
    key, names = path, NEEDS.get(path, [])
    if path in ("operating_point.motor_speed", "faults.backlash", "sensor.hum_phase"):
        # The preset has them in degrees or rpm, so that the SI key would be the second for one quantity.
        key = path + ("_rpm" if "speed" in path else "_deg")
        first, second = (1400.0, 1450.0) if "speed" in path else (5.0, 10.0)
    factor = math.pi / 30.0 if key.endswith("_rpm") else math.pi / 180.0 if key.endswith("_deg") else 1.0
    expected = [value * factor if factor != 1.0 else value for value in (first, second)]
    column = column_of(path)
    (fixed,) = rows_of(composed(*names, f"{key}={second}"), 1)
    assert fixed[column] == expected[1]
    if path == "machine.name":
        return  # a name changes nothing that is recorded, so drawing it is refused
    # A quantity of its own keeps items apart; the drawn one must then take both its values.
    drawn = rows_of(composed(*names, f"{key}={{choice:[{first},{second}]}}"), 12)
    assert {row[column] for row in drawn} == set(expected)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_is_drawn_with_each_of_its_parameters(name, plain):
    effect = EFFECTS[name]
    parameters = {field.name: _values_of(field) for field in dataclasses.fields(effect)}
    config = copy.deepcopy(plain)
    config["campaign"]["draws"] = {
        "effects": {name: {key: {"choice": list(values)} for key, values in parameters.items()}}
    }
    rows = rows_of(config, 24)
    if issubclass(effect, SensorEffect):
        assert len({tuple(value for key, value in row.items() if key.startswith("sensor_")) for row in rows}) > 1
        return
    for key, values in parameters.items():
        assert {json.loads(row["effects"])[0][key] for row in rows} == set(values)


def _values_of(field: dataclasses.Field) -> tuple[Any, Any]:
    if field.metadata["whole"]:
        return 1, 2
    if field.name == "inverse_square":
        return (2.0 * math.pi * 320.0) ** -2, (2.0 * math.pi * 300.0) ** -2
    return (0.1, 0.2) if field.name in ("compliance", "corner", "half_width") else (0.005, 0.01)


@pytest.mark.parametrize(
    "given",
    [
        "+machine.effects.friction.coulomb.torque=3.0",
        "+machine.effects={friction.coulomb:{torque:3.0}}",
        "+campaign.draws.effects.friction.coulomb.torque=3.0",
    ],
)
def test_an_effect_may_be_written_with_dots(given):
    (row,) = rows_of(composed(given), 1)
    assert json.loads(row["effects"])[0]["torque"] == 3.0


def test_an_effect_of_the_machine_is_drawn_in_its_place():
    rows = rows_of(composed("+machine.effects.friction.coulomb.torque={uniform:[1,2]}"), 5)
    torques = [json.loads(row["effects"])[0]["torque"] for row in rows]
    assert len(set(torques)) == 5 and min(torques) >= 1.0 and max(torques) < 2.0


def test_the_run_is_fixed_for_all_rows():
    overrides = {"sample_rate": 500.0, "samples": 33, "step": 1e-4, "warmup_turns": 1, "warmup_tolerance": 1e-3}
    (row,) = rows_of(composed(*(f"run.{key}={value}" for key, value in overrides.items())), 1)
    columns = ("simulation_rate", "simulation_samples", "step", "warmup_limit", "warmup_tolerance")
    assert tuple(row[column] for column in columns) == tuple(overrides.values())
    (row,) = rows_of(composed("sensor.sample_rate=500", "sensor.lowpass_hz=100"), 1)
    assert row["sample_rate"] == 500.0


def test_a_law_in_place_takes_the_place_of_the_campaign_s_own():
    rows = rows_of(composed("campaign=random", "faults.roller={choice:[cracked]}", "run.samples=20"), 6)
    assert {row["fault_roller_crack"] for row in rows} == {0.4}
    assert {row["code"][0] for row in rows} == {"1"}


def test_the_total_play_is_that_of_the_simulated_joint():
    """A machine with play of its own, a fault and effects: the columns against the kernel's edges, half the play."""
    machine = load_machine("reference")
    machine = dataclasses.replace(machine, output_joint=dataclasses.replace(machine.output_joint, backlash=1e-3))
    machine = Faults(backlash=0.1).applied_to(machine.with_effects(make_effect("output.backlash", backlash=2e-3)))
    columns = machine_columns(machine)
    values = coefficients(machine, OperatingPoint())
    assert columns["input_joint_backlash_total"] == pytest.approx(2.0 * values["edge_1"], rel=1e-12)
    assert columns["output_joint_backlash_total"] == pytest.approx(3e-3) == 2.0 * values["edge_2"]


def test_an_effects_angle_may_be_in_degrees_by_the_unit_that_it_states():
    laws = laws_by_path({"effects": {"cam.station_spacing": {"error_deg": {"uniform": [0.0, 1.0]}}}}, "campaign.draws")
    (law,) = laws.values()
    assert list(laws) == ["effects.cam.station_spacing.error"] and max(law.extremes) == pytest.approx(math.pi / 180.0)


@pytest.mark.parametrize(
    ("key", "path"),
    [
        ("machine.effects.friction.coulomb.torque", "effects.friction.coulomb.torque"),
        ("effects.load.imbalance.phase_deg", "effects.load.imbalance.phase"),
        ("machine.effects.cam.station_spacing.error_deg", "effects.cam.station_spacing.error"),
        ("machine.effects.friction.coulomb.torqe", None),
        ("machine.effects.friction.coulomb", None),
        ("campaign.draws.effects.friction.coulomb.torque", None),
    ],
)
def test_a_parameter_of_an_effect_is_known_by_its_key(key, path):
    assert path_of(key) == path
