"""The fault table: sizes, shop units, effects."""

from __future__ import annotations

import math

import pytest

from indexer_env import EFFECTS, Sensor, load_machine, make_effect
from indexer_env.errors import ParameterError
from indexer_env.units import RPM
from twin.data import fault_laws
from twin.faults import FAULTS, check_matters, chosen, peak_torque, share_of
from twin.synthesis import effect_of

MACHINE = load_machine("reference")


@pytest.mark.parametrize("name", sorted(FAULTS))
def test_a_size_goes_to_the_shop_and_back(name):
    fault = FAULTS[name]
    for share in (0.01, 0.3, 1.0):
        assert fault.share(fault.value(share, MACHINE), MACHINE) == pytest.approx(share)
        assert share_of(fault, fault.told(share, MACHINE), MACHINE) == pytest.approx(share, rel=1e-6)


@pytest.mark.parametrize("name", sorted(FAULTS))
def test_a_fault_of_size_0_is_none_and_the_largest_can_be_built(name):
    fault = FAULTS[name]
    others = {"station": 1} if name == "crack_single" else {key: 0.02 for key in fault.others}
    assert fault.parameter in {field for field in EFFECTS[fault.effect].__dataclass_fields__}
    assert make_effect(fault.effect, {fault.parameter: 0.0, **others}).is_null
    assert not make_effect(fault.effect, {fault.parameter: fault.value(1.0, MACHINE), **others}).is_null


def test_the_shop_reads_the_papers_20_degrees():
    assert FAULTS["reducer_play"].told(1.0, MACHINE) == pytest.approx(20.0)
    loose = FAULTS["sensor_loose"]
    assert loose.told(1.0, MACHINE) == pytest.approx(25.0) and loose.unit == "Hz bracket resonance"


def test_a_loose_sensor_is_told_by_the_bracket_that_there_is_in_all():
    """A bracket of its own of 100 Hz that has come down to 50 Hz."""
    (loose,) = chosen(["sensor_loose"], sensor=Sensor(bracket_hz=100.0))
    grown = 1.0 / (2.0 * math.pi * 50.0) ** 2 - 1.0 / (2.0 * math.pi * 100.0) ** 2
    share = loose.share(grown, MACHINE)
    assert loose.told(share, MACHINE) == pytest.approx(50.0) and loose.told(0.0, MACHINE) == pytest.approx(100.0)
    assert share_of(loose, 50.0, MACHINE) == pytest.approx(share, rel=1e-6)
    assert chosen(["crack", "sensor_gain"], sensor=Sensor(bracket_hz=100.0)) == chosen(["crack", "sensor_gain"])


def test_a_fault_grows_no_further_than_its_effect_can_be():
    """Rollers that have lost 45 % of their stiffness already can lose little more than as much again."""
    worn = MACHINE.with_effects(make_effect("roller.crack", stiffness_loss=0.45))
    (sound,), (crack,) = chosen(["crack"]), chosen(["crack"], machine=worn)
    assert chosen(["crack"], machine=MACHINE) == (sound,)
    assert crack.value(crack.most, worn) == pytest.approx(1.0 - 1.1 * 0.45)
    law = fault_laws([crack], worn)["crack"]["roller.crack"]["stiffness_loss"]
    assert law["choice"][0]["uniform"][1] == pytest.approx(1.0 - 1.1 * 0.45)
    assert effect_of(sound, 1.0, worn, 0.0, 0).stiffness_loss < 1.0, "beside a machine of the posterior"


@pytest.mark.parametrize(
    ("matters", "said"),
    [
        ({"reducer_play": 30.0}, "reducer_play must be 20 ° at the motor shaft or less, the largest .*, got 30"),
        ({"sensor_loose": 10.0}, "sensor_loose must be 25 Hz bracket resonance or more, the largest .*, got 10"),
        ({"crack": 80.0}, "crack must be 60 % of stiffness lost or less"),
        ({"friction": 50.0}, r"friction must be 41\.3 N m or less"),
    ],
)
def test_a_size_that_matters_beyond_the_largest_is_refused(matters, said):
    with pytest.raises(ParameterError, match=said):
        check_matters(matters, chosen(list(FAULTS)), MACHINE)
    check_matters({"reducer_play": 20.0, "sensor_loose": 25.0, "friction": 41.3}, chosen(list(FAULTS)), MACHINE)
    check_matters(None, chosen(list(FAULTS)), MACHINE)


def test_no_interval_ends_beyond_what_there_can_be():
    loose, gain = FAULTS["loose_base"], FAULTS["sensor_gain"]
    assert (loose.possible(-0.1), loose.possible(0.3), loose.possible(1.54)) == (0.0, 0.3, 1.0)
    assert (gain.possible(-0.5), gain.possible(1.5)) == (-0.5, 1.5)
    assert FAULTS["crack"].told(FAULTS["crack"].possible(5.0), MACHINE) == pytest.approx(100.0)


def test_the_peak_torque_is_that_of_the_motion_law():
    # J_t h Ca / T²: 5 kg m², 2π/8, 5.528 and half of 1.025 s
    assert peak_torque(MACHINE) == pytest.approx(5.0 * 0.7854 * 5.528 / 0.5125**2, rel=1e-3)


def test_torques_are_measured_by_what_the_index_asks_at_the_fastest_speed():
    """At a fifth of the speed a twenty-fifth."""
    slow, fast = (chosen(["friction", "crack"], speed * RPM) for speed in (300.0, 1500.0))
    assert fast == chosen(["friction", "crack"])
    assert slow[0].largest(MACHINE) == pytest.approx(fast[0].largest(MACHINE) / 25.0)
    assert slow[1].largest(MACHINE) == fast[1].largest(MACHINE) == 0.6


def test_an_unknown_fault_is_refused():
    with pytest.raises(ParameterError, match=r"twin\.faults must be some of crack"):
        chosen(["crack", "rust"])
    with pytest.raises(ParameterError, match=r"got 'loos_base'; did you mean 'loose_base'"):
        chosen(["loos_base"])
