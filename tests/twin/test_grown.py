"""What physics says of effects that the machine had when it was healthy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from discrepancy.grades import STANDS_IN
from indexer_env import Sensor, load_machine
from indexer_env.effects.friction import CoulombFriction
from tests.twin.test_answer import MATTERS, network
from twin import physics
from twin.answer import answer_of
from twin.diagnosis import FAULTY, HEALTHY, FaultSeen
from twin.faults import FAULTS, chosen
from twin.physics import PhysicalFault, Physics, _change, _grown

MACHINE = load_machine("reference")


def grown(now: tuple[float, float, float], before: float, name: str = "friction") -> PhysicalFault | None:
    """What physics says of an effect of size `now` (size, low, high) that was `before`, known to ± 0.5."""
    fault = FAULTS[name]
    row = {"values": {fault.parameter: before}, "interval": (before - 0.5, before + 0.5)}
    size = SimpleNamespace(name=f"{fault.effect}.{fault.parameter}", value=now[0], low=now[1], high=now[2])
    answer = SimpleNamespace(calibration=SimpleNamespace(estimates=(size,)))
    change = _change(cast(Any, answer), row, fault, MACHINE)
    assert change is not None
    return _grown(change)


def test_an_effect_has_grown_where_both_estimates_say_so():
    assert grown((5.6, 5.2, 6.0), 5.0) is None
    more = grown((9.0, 8.6, 9.4), 5.0)
    assert more is not None
    told = [FAULTS["friction"].told(share, MACHINE) for share in (more.size, more.low, more.high)]
    assert told == pytest.approx([4.0, 4.0 - 0.41**0.5, 4.0 + 0.41**0.5])


def test_less_of_what_can_only_grow_is_no_fault():
    assert grown((3.0, 2.6, 3.4), 9.0) is None
    assert grown((-0.3, -0.7, 0.1), 0.9, "sensor_gain") is not None


def explained(
    monkeypatch, now: tuple[float, float, float], *suspected: FaultSeen, verdict: str = "nothing missing"
) -> Physics:
    """What physics says of a machine whose friction was 5 N m, known to ± 0.5; no effect has a name, and a crack stands
    in: with it noise is left, without it twice as much."""
    size = SimpleNamespace(name="friction.coulomb.torque", value=now[0], low=now[1], high=now[2])
    loss = SimpleNamespace(name="stiffness_loss", value=0.2, low=0.1, high=0.3)
    crack = SimpleNamespace(name="roller.crack", parameters=(loss,), choices=())
    found = SimpleNamespace(
        grade=STANDS_IN, effects=(crack,), probability=0.9, closes=0.8, why="It stands in.", rivals=()
    )
    base, best = (
        SimpleNamespace(name=name, place=SimpleNamespace(hypothesis=SimpleNamespace(names=names)))
        for name, names in (("none", ()), ("roller.crack", ("roller.crack",)))
    )
    levels = {"none": 2.0, "roller.crack": 1.0}
    answer = SimpleNamespace(
        verdict=verdict, names=(), findings=(found,), base=base, accepted=base, best=best, before=2.0,
        held={name: SimpleNamespace(level=lambda held, level=level: level) for name, level in levels.items()},
        calibration=SimpleNamespace(estimates=(size,)),
    )  # fmt: skip
    monkeypatch.setattr(physics, "IndexerModel", lambda *given, **more: None)
    monkeypatch.setattr(physics, "explain", lambda *given, **more: answer)
    monkeypatch.setattr(physics, "measured", lambda *given: ())
    machine = MACHINE.with_effects(CoulombFriction(torque=5.0))
    row = {"effect": "friction.coulomb", "values": {"torque": 5.0, "smoothing": 0.005}, "interval": [4.5, 5.5]}
    given = cast(Any, SimpleNamespace(fitted=(), held_out=()))
    faults = chosen(["crack", "friction"])
    return physics.explained(given, machine, Sensor(), [row], {}, 1.0, faults, suspected)


def test_beside_a_growth_nothing_is_told_that_only_stands_in(monkeypatch):
    said = explained(monkeypatch, (9.0, 8.6, 9.4))
    assert [one.fault for one in said.faults] == ["friction"] and said.verdict == FAULTY and said.level == 2.0
    still = explained(monkeypatch, (5.1, 4.7, 5.5))
    assert [one.fault for one in still.faults] == ["crack"] and still.verdict == HEALTHY and still.level == 1.0


@pytest.mark.parametrize("now", [(5.1, 4.7, 5.5), (3.0, 2.6, 3.4)])
def test_a_growth_that_the_networks_see_and_physics_does_not_is_no_fault(monkeypatch, now):
    seen = network(FAULTY, "friction")
    said = explained(monkeypatch, now, *seen.faults)
    (look,) = said.measured
    assert look.fault == "friction" and 0.0 <= look.low <= look.size <= look.high < 0.1 and look.evidence < -3.0
    assert answer_of(seen, said, MACHINE, MATTERS).verdict == HEALTHY
    assert not explained(monkeypatch, now).measured, "nobody asked"
