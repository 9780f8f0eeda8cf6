"""Numbers in the shop's units, and the place of every effect in the machine's picture."""

import dataclasses
import math

import pytest

from discrepancy.report.picture import PARTS, picture
from discrepancy.subjects.indexer import _PARTS
from discrepancy.subjects.shop_units import SHOP, in_the_shop
from indexer_env import load_machine
from indexer_env.effects import EFFECTS
from indexer_env.faults import Faults

ONES = {"-", "rad", "turns", "s", "rad/(N m)"}


def test_every_name_is_one_of_the_library_or_the_machine() -> None:
    names = {f"{name}.{field.name}" for name, effect in EFFECTS.items() for field in dataclasses.fields(effect)}
    assert set(SHOP) - names == {"input_joint.backlash"}


def test_play_is_said_in_degrees_at_the_motor_shaft() -> None:
    machine = load_machine("reference")
    play = math.radians(20.0) * machine.reduction
    said = in_the_shop("input.backlash.backlash", (play, 0.9 * play, 1.1 * play), machine)
    assert said == "20 (18 to 22) ° at the motor shaft"


def test_looseness_is_that_of_the_faults() -> None:
    machine = load_machine("reference")
    (loose,) = Faults(screw_looseness=0.4).effects(machine)
    value = dataclasses.asdict(loose)["compliance"]
    assert in_the_shop("base.looseness.compliance", (value, value, value), machine).startswith("40 (40 to 40) % loose")


def test_what_falls_where_the_number_grows_has_its_interval_in_order() -> None:
    said = in_the_shop(
        "sensor.lowpass.time_constant", (1.0 / (2.0 * math.pi * 50.0), 0.003, 0.0034), load_machine("reference")
    )
    assert said == "50 (46.8 to 53.1) Hz cut-off"


def test_a_bound_that_there_is_not_is_said_so() -> None:
    said = in_the_shop("sensor.lowpass.time_constant", (0.0032, 0.0, 0.004), load_machine("reference"))
    assert said == "49.7 (39.8 to no bound) Hz cut-off"


def test_si_units_that_the_shop_uses_are_said_once() -> None:
    assert in_the_shop("friction.coulomb.torque", (20.0, 19.0, 21.0), load_machine("reference")) == ""


def test_every_effect_has_its_place_in_the_picture() -> None:
    assert {_PARTS[effect.enters] for effect in EFFECTS.values()} <= set(PARTS)
    assert set(_PARTS) == {effect.enters for effect in EFFECTS.values()}


@pytest.mark.parametrize("part", PARTS)
def test_a_marked_part_is_marked_and_a_hinted_one_hinted(part: str) -> None:
    drawn = picture([part], [])
    assert drawn.count('class="marked"') == 1 and f"{part}: found here" in drawn
    assert picture([], [part]).count('class="hinted"') == 1 and 'class="marked"' not in picture([], [part])
