"""What physics measures of a fault that its search does not name."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from discrepancy.indexer.parameters import read
from discrepancy.records.reading import Record
from indexer_env import Sensor, make_effect
from tests.twin.builders import MACHINE, NOISE, record
from twin import physics
from twin.diagnosis import FaultSeen
from twin.faults import chosen
from twin.measured import _beside

NUMBERS = (
    "table_inertia", "cam_inertia", "follower_inertia", "input_joint.stiffness", "input_joint.damping",
    "output_joint.stiffness", "output_joint.damping",
)  # fmt: skip


def draws(random: np.random.Generator, together: float = 0.0) -> dict[str, np.ndarray]:
    """Draws of a machine whose numbers are each known to 2 %, and all by one more factor of some spread."""
    factor = 1.0 + together * random.standard_normal(4000)
    numbers = {name: read(MACHINE, name) for name in NUMBERS}
    return {
        f"machine.{name}": value * factor * (1.0 + 0.02 * random.standard_normal(4000))
        for name, value in numbers.items()
    }


FAULTS = chosen(["crack", "loose_base"])


@pytest.mark.parametrize(("loose", "there"), [(0.0, False), (0.12, True)])
def test_a_small_fault_beside_a_large_one_is_measured_and_told_from_none(loose: float, there: bool):
    """Seed 2: a loosening of 12 % beside a crack, which the search does not name; networks see it, or 5 % of none."""
    machine = MACHINE.with_effects(make_effect("roller.crack", stiffness_loss=0.2))
    if loose:
        machine = machine.with_effects(make_effect("base.looseness", compliance=FAULTS[1].value(loose, MACHINE)))
    signal, told = record(machine, turns=1.2)
    random = np.random.default_rng(2)
    noise = NOISE * random.standard_normal(len(signal.values))
    signal, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
    given = physics.checked([Record("today.csv", signal, told)], MACHINE, Sensor())
    seen = FaultSeen("loose_base", 0.8, 5.0, 0.0, 9.0, "% loose", loose or 0.05, True)
    found = physics.explained(given, MACHINE, Sensor(), (), draws(random), 1.0, FAULTS, [seen])
    assert [one.fault for one in found.faults] == ["crack"]
    (beside,) = found.measured
    assert beside.fault == "loose_base" and (beside.evidence > 0.0) == there
    assert beside.low <= loose + 0.005 and loose <= beside.high


def named(name: str, share: float) -> FaultSeen:
    return FaultSeen(name, 0.9, 5.0, 0.0, 9.0, "%", share, True)


def test_the_set_that_the_networks_name_is_found_though_the_search_stops_short(monkeypatch):
    """A crack and half of the largest looseness, of which a search that adds nothing finds none; seed 2. What is fitted
    there is judged as all else: a set of which one part is not there gets no name for it."""
    loose = make_effect("base.looseness", compliance=FAULTS[1].value(0.5, MACHINE))
    cracked = make_effect("roller.crack", stiffness_loss=0.2)
    monkeypatch.setattr("discrepancy.search.Search._added", lambda self, current, *, wide=False: [])
    found = []
    for machine in (MACHINE.with_effects(cracked, loose), MACHINE.with_effects(cracked)):
        signal, told = record(machine, turns=1.2)
        noise = NOISE * np.random.default_rng(2).standard_normal(len(signal.values))
        noisy, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
        given = physics.checked([Record("today.csv", noisy, told)], MACHINE, Sensor())
        both = [named("crack", 0.3), named("loose_base", 0.4)]
        known = MACHINE, Sensor(), (), draws(np.random.default_rng(2)), 1.0, FAULTS
        said = [physics.explained(given, *known, seen) for seen in (both, ())]
        found.append([{one.fault for one in one.faults if one.grade == "established"} for one in said])
    assert found == [[{"crack", "loose_base"}, set()], [{"crack"}, set()]]


def test_what_is_known_together_tells_more_than_each_number_alone():
    """Numbers that are each known to 2 %, all for themselves or as one factor, which no motion shows: a crack is
    measured more closely then, and a looseness, which is a compliance, by that factor. Seed 4."""
    random, factor = np.random.default_rng(4), 1.0 + 0.02 * np.random.default_rng(5).standard_normal(4000)
    alone = draws(random)
    as_one = {path: column.mean() * factor for path, column in alone.items()}
    widths = {}
    for effect, fault in (
        (make_effect("roller.crack", stiffness_loss=0.2), "crack"),
        (make_effect("base.looseness", compliance=FAULTS[1].value(0.5, MACHINE)), "loose_base"),
    ):
        signal, told = record(MACHINE.with_effects(effect), turns=1.2)
        noise = NOISE * random.standard_normal(len(signal.values))
        signal, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
        given = physics.checked([Record("today.csv", signal, told)], MACHINE, Sensor())
        for name, known in (("alone", alone), ("as one", as_one)):
            (found,) = physics.explained(given, MACHINE, Sensor(), (), known, 1.0, FAULTS).faults
            assert found.fault == fault
            widths[fault, name] = found.high - found.low
    assert widths["crack", "as one"] < 0.8 * widths["crack", "alone"]
    assert widths["loose_base", "as one"] > max(0.5 * 3.9 * 0.015, 1.2 * widths["loose_base", "alone"])


@pytest.mark.parametrize("name", ["sensor_loose", "loose_base", "imbalance"])
@pytest.mark.parametrize("share", [0.0, 0.03])
def test_a_fault_that_is_not_there_has_no_evidence(name: str, share: float):
    """Beside a crack, begun from nothing or from 3 %, wherever the fit ends. Seed 7."""
    faults = chosen(["crack", name])
    signal, told = record(MACHINE.with_effects(make_effect("roller.crack", stiffness_loss=0.2)), turns=1.2)
    random = np.random.default_rng(7)
    noise = NOISE * random.standard_normal(len(signal.values))
    signal, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
    given = physics.checked([Record("today.csv", signal, told)], MACHINE, Sensor())
    seen = FaultSeen(name, 0.02, 1.0, 0.0, 9.0, "%", share, False)
    found = physics.explained(given, MACHINE, Sensor(), (), draws(random), 1.0, faults, [seen])
    assert [one.fault for one in found.faults] == ["crack"]
    (look,) = found.measured
    assert look.evidence < 1.0


def test_a_small_imbalance_is_measured_though_the_networks_see_none():
    """10 % of the largest, begun at nothing, where its phase does not show. Seed 8."""
    faults = chosen(["crack", "imbalance"])
    small = make_effect("load.imbalance", torque=faults[1].value(0.1, MACHINE), phase=2.0)
    cracked = make_effect("roller.crack", stiffness_loss=0.2)
    signal, told = record(MACHINE.with_effects(cracked, small), turns=2.2)
    random = np.random.default_rng(8)
    noise = NOISE * random.standard_normal(len(signal.values))
    signal, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
    given = physics.checked([Record("today.csv", signal, told)], MACHINE, Sensor())
    seen = FaultSeen("imbalance", 0.02, 0.0, 0.0, 9.0, "N m", 0.0, False)
    found = physics.explained(given, MACHINE, Sensor(), (), draws(random), 1.0, faults, [seen])
    sizes = {one.fault: one.size for one in (*found.faults, *found.measured)}
    assert sizes["imbalance"] == pytest.approx(0.1, abs=0.04)


def test_a_station_that_the_twin_found_is_known_to_physics():
    """A finding as YAML has it, its station a plain number: the twin's machine has it, and the draws know its size."""
    spacing = make_effect("cam.station_spacing", station=3, error=0.008)
    machine = MACHINE.with_effects(spacing)
    found = {"effect": "cam.station_spacing", "values": {"station": 3.0, "error": 0.008}, "interval": [0.0077, 0.0083]}
    random = np.random.default_rng(9)
    error = {"effects.cam.station_spacing.error": 0.008 + 2e-4 * random.standard_normal(4000)}
    station = {"effects.cam.station_spacing.station": np.full(4000, 3.0)}
    signal, told = record(machine, turns=1.2)
    noise = NOISE * random.standard_normal(len(signal.values))
    signal, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
    given = physics.checked([Record("today.csv", signal, told)], machine, Sensor())
    said = physics.explained(given, machine, Sensor(), [found], draws(random) | error | station, 1.0, FAULTS)
    assert said.verdict == "healthy" and said.level < 1.1


def test_a_loose_sensor_begins_beyond_the_bracket_that_it_stood_on(monkeypatch):
    (loose,) = chosen(["sensor_loose"], sensor=Sensor(bracket_hz=100.0))
    seen, place = FaultSeen("sensor_loose", 0.8, 50.0, 40.0, 60.0, "Hz", 0.1, True), SimpleNamespace(cost=0.0)
    model = SimpleNamespace(hypotheses=lambda: {loose.effect: (SimpleNamespace(fixed={}),)})
    begun: list[float] = []
    monkeypatch.setattr("twin.measured._begun", lambda *given: (begun.append(given[-1]), place)[1])
    given: Any = SimpleNamespace(model=model), place, loose, seen, MACHINE
    assert _beside(*given) is place and begun == [pytest.approx(loose.before + loose.value(0.1, MACHINE))]


@pytest.mark.parametrize("bracket", [50.0, 100.0])
def test_a_loose_sensor_is_measured_from_the_bracket_that_it_stood_on(bracket: float):
    """One of 100 Hz, which is not the fault; at 50 Hz, what came on top of it, told as what there is. Seed 10."""
    stood = Sensor(bracket_hz=100.0, bracket_damping=0.05)
    faults = chosen(["crack", "sensor_loose"], sensor=stood)
    signal, told = record(turns=1.2)
    values = dataclasses.replace(stood, bracket_hz=bracket).read(signal.values, signal.sample_rate).values
    values = values + NOISE * np.random.default_rng(10).standard_normal(len(values))
    signal, told = dataclasses.replace(signal, values=values), dataclasses.replace(told, noise=NOISE)
    given = physics.checked([Record("today.csv", signal, told)], MACHINE, stood)
    seen = FaultSeen("sensor_loose", 0.8, 50.0, 40.0, 60.0, "Hz", 0.1, True)
    known = MACHINE, stood, (), draws(np.random.default_rng(10)), 1.0, faults
    found = physics.explained(given, *known, [seen])
    if bracket == 50.0:
        (one,) = found.faults
        assert faults[1].told(one.size, MACHINE) == pytest.approx(50.0, abs=0.5)
    else:
        (look,) = found.measured
        assert found.faults == () and look.size == pytest.approx(0.0, abs=0.01) and look.nothing == 0.0
