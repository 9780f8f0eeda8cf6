"""The extended machine is YAML that loads back equal."""

from pathlib import Path

from discrepancy.indexer import machine_yaml
from indexer_env import load_machine, make_effect


def test_a_machine_with_effects_loads_back_equal(tmp_path: Path) -> None:
    machine = load_machine("reference").with_effects(
        make_effect("friction.coulomb", torque=23.5), make_effect("cam.station_spacing", error=1e-4, station=3)
    )
    path = tmp_path / "machine.yaml"
    path.write_text(machine_yaml(machine), encoding="utf-8")
    assert load_machine(path) == machine


def test_another_effect_is_another_file(tmp_path: Path) -> None:
    machine = load_machine("reference")
    assert machine_yaml(machine) != machine_yaml(machine.with_effects(make_effect("friction.viscous", coefficient=1.0)))
