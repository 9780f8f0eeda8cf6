"""What physics measures of a fault that its search does not name."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from discrepancy.records.reading import Record
from indexer_env import Sensor, make_effect
from tests.twin.builders import MACHINE, NOISE, record
from twin import physics
from twin.diagnosis import FaultSeen
from twin.faults import chosen

SPREAD = {"table_inertia": 0.02, "cam_inertia": 0.02, "follower_inertia": 0.02} | {
    f"{joint}_joint.{name}": 0.02 for joint in ("input", "output") for name in ("stiffness", "damping")
}
FAULTS = chosen(["crack", "loose_base"])


@pytest.mark.parametrize(("loose", "there"), [(0.0, False), (0.12, True)])
def test_a_small_fault_beside_a_large_one_is_measured_and_told_from_none(loose: float, there: bool):
    """Seed 2: a loosening of 12 % beside a crack, which the search does not name; networks see it, or 5 % of none."""
    machine = MACHINE.with_effects(make_effect("roller.crack", stiffness_loss=0.2))
    if loose:
        machine = machine.with_effects(make_effect("base.looseness", compliance=FAULTS[1].value(loose, MACHINE)))
    signal, told = record(machine, turns=1.2)
    noise = NOISE * np.random.default_rng(2).standard_normal(len(signal.values))
    signal, told = dataclasses.replace(signal, values=signal.values + noise), dataclasses.replace(told, noise=NOISE)
    given = physics.checked([Record("today.csv", signal, told)], MACHINE, Sensor())
    seen = FaultSeen("loose_base", 0.8, 5.0, 0.0, 9.0, "% loose", loose or 0.05, True)
    found = physics.explained(given, MACHINE, Sensor(), (), SPREAD, FAULTS, [seen])
    assert [one.fault for one in found.faults] == ["crack"]
    (beside,) = found.measured
    assert beside.fault == "loose_base" and (beside.evidence > 0.0) == there
    assert beside.low <= loose + 0.005 and loose <= beside.high
