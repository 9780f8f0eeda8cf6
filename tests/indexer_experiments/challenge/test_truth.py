"""The challenge's solver against the reference solver, with which it shares no code."""

import dataclasses
import importlib
import math

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from discrepancy.indexer.parameters import changed
from indexer_env import OperatingPoint, load_machine, make_effect
from indexer_env.errors import ParameterError
from indexer_env.motion_law import motion_law
from indexer_env.reference import simulate_reference
from indexer_experiments.challenge.draw import HIDDEN
from indexer_experiments.challenge.laws import LAWS
from indexer_experiments.challenge.solver import STEPS_PER_MS, entries
from indexer_experiments.challenge.truth import _EQUATIONS, compiled, plant, resumed, run, seen, true_motion
from indexer_experiments.challenge.unlisted import NOTHING

POINT = OperatingPoint(motor_speed=150.0, load_torque=3.0, start_angle=6.0)
"""Starts shortly before a cam turn ends, so that single-station effects begin within the record."""

SHAPES = {
    "friction.stribeck": {"speed": 0.1},
    "load.imbalance": {"phase": 1.0},
    "load.process": {"centre": 0.1, "half_width": 0.1},
    "drive.speed_ripple": {"phase": 1.0},
    "drive.transmission_error": {"phase": 2.0},
    "drive.mesh_stiffness": {"phase": 3.0},
    "cam.profile_error": {"centre": 0.2, "half_width": 0.1},
    "cam.station_spacing": {"station": 2},
    "roller.crack_single": {"station": 1},
    "base.looseness": {"damping_ratio": 0.05},
}


@pytest.mark.parametrize("name", [None, *(name for name in HIDDEN if not name.startswith("sensor."))])
def test_truth_is_what_the_reference_solver_gives(name: str | None) -> None:
    """350 ms with play, five times the unit size of each effect: 1e-6 of the record's spread."""
    machine = load_machine("reference")
    if name is not None:
        size = next(iter(HIDDEN[name]))
        machine = machine.with_effects(make_effect(name, {size: 5.0 * HIDDEN[name][size], **SHAPES.get(name, {})}))
    expected = simulate_reference(machine, POINT, samples=350).channels["table_acceleration"]
    numbers = plant(machine, POINT)
    started, solved = compiled()
    found = solved(numbers, started(numbers, POINT.start_angle, 0.0), 0, 350, 1e-3, STEPS_PER_MS)[0]
    assert np.abs(found - expected).max() < 1e-6 * expected.std()


@pytest.mark.parametrize("name", ["drive.speed_ripple", "drive.transmission_error"])
def test_a_slipping_motor_feels_what_ripples_as_the_reference_solver_has_it(name: str) -> None:
    """Five times the unit size of both: the motor's speed, where the ripple is a lever on the input joint's torque."""
    size = next(iter(HIDDEN[name]))
    ripple = make_effect(name, {size: 5.0 * HIDDEN[name][size], **SHAPES[name]})
    machine = load_machine("reference").with_effects(make_effect("drive.slip", compliance=2.0), ripple)
    expected = simulate_reference(machine, POINT, samples=350, channels=("motor_rate",)).channels["motor_rate"]
    numbers = plant(machine, POINT)
    started, solved = compiled()
    found = solved(numbers, started(numbers, POINT.start_angle, 0.0), 0, 350, 1e-3, STEPS_PER_MS)[8]
    assert np.abs(found - expected).max() < 1e-6 * expected.std()


@pytest.mark.parametrize("law", LAWS)
def test_every_law_is_that_of_the_reference_solver(law: str) -> None:
    """A whole motion of 4 stations, with play: 1e-6 of the record's spread."""
    machine = dataclasses.replace(
        load_machine("reference"), stations=4, motion_share=0.4, motion_law=motion_law(law)
    )  # fmt: skip
    expected = simulate_reference(machine, POINT, samples=500).channels["table_acceleration"]
    numbers = plant(machine, POINT)
    started, solved = compiled()
    found = solved(numbers, started(numbers, POINT.start_angle, 0.0), 0, 500, 1e-3, STEPS_PER_MS)[0]
    assert np.abs(found - expected).max() < 1e-6 * expected.std()


def test_a_run_goes_on_from_any_of_its_states() -> None:
    """Across edges of the play, as its regions are found again by deflection and rate."""
    machine = load_machine("reference")
    whole = run(machine, POINT, 400, 1000.0)
    rest = resumed(machine, POINT, whole[1:, 150], 250, 1000.0)
    assert np.abs(rest[0] - whole[0, 150:]).max() < 1e-6 * whole[0].std()


def test_a_drifting_speed_keeps_its_mean_and_reaches_its_ends() -> None:
    """1 % over a record of 2 s: from 0.5 % below to 0.5 % above, after a run-in at the lower speed."""
    machine = load_machine("reference")
    motion = run(machine, POINT, 2001, 1000.0, NOTHING._replace(drift=0.01, drift_time=2.0))
    assert motion[8, [0, 1000, -1]] == pytest.approx([149.25, 150.0, 150.75], rel=1e-6)
    assert seen(machine, POINT, motion, 1000.0).motor_speed == pytest.approx(150.0, rel=1e-6)


def test_operating_point_is_told_as_a_pulse_shows_it() -> None:
    """A slipping motor turns slower than it is told to, and starts its second turn late; its angle there is its own,
    also where it makes no whole turns in one of the table's."""
    reference = dataclasses.replace(load_machine("reference"), reduction_ratio=25.3)
    machine = reference.with_effects(make_effect("drive.slip", compliance=2.0))
    _, told = true_motion(machine, POINT, 2000, 1000.0)
    second = POINT.start_angle + 2.0 * np.pi * machine.stations
    assert 0.9 * POINT.motor_speed < told.motor_speed < 0.9999 * POINT.motor_speed
    assert second - 1.0 < told.start_angle < second
    motion = run(machine, POINT, 200, 1000.0)
    assert told.start_angle / machine.reduction == pytest.approx(motion[7, 0])
    _, same = true_motion(load_machine("reference"), POINT, 200, 1000.0)
    assert same.motor_speed == pytest.approx(POINT.motor_speed, rel=1e-9)


def test_another_contact_law_is_refused() -> None:
    machine = dataclasses.replace(load_machine("reference"), contact_law="kelvin_voigt")
    with pytest.raises(ParameterError, match=r"Machine\.contact_law must be 'clipped', got 'kelvin_voigt'"):
        true_motion(machine, POINT, 100, 1000.0)


def test_play_is_that_of_the_machine() -> None:
    """Another play gives another record."""
    machine = load_machine("reference")
    wide = changed(machine, {"input_joint.backlash": math.radians(5.0) * machine.reduction})
    a, b = (true_motion(each, POINT, 300, 1000.0)[0] for each in (machine, wide))
    assert np.abs(a - b).max() > 0.01 * a.std()


def test_the_solver_is_compiled_anew_where_a_source_of_its_equations_changes() -> None:
    modules = [importlib.import_module(f"indexer_experiments.challenge.{name}") for name in _EQUATIONS]
    parts = [part for module in modules for part in vars(module).values() if isinstance(part, Dispatcher)]
    assert {part.py_func.__module__ for part in parts} == {module.__name__ for module in modules}
    # a part with a cache of its own would be taken from there
    assert not any(part._cache.cache_path for part in parts)
    for entry in entries(7):
        assert [one.cell_contents for one in entry.py_func.__closure__ if isinstance(one.cell_contents, int)] == [7]
