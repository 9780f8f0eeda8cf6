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

TURN = 2.0 * math.pi

SAID = {
    "output.backlash.backlash": (math.radians(0.5), "30 ′ at the table"),
    "base.looseness.backlash": (math.radians(0.5), "30 ′ at the housing"),
    "cam.profile_error.height": (math.radians(0.5), "30 ′ at the follower"),
    "cam.profile_error.centre": (0.25, "90 ° of the cam"),
    "cam.profile_error.half_width": (0.05, "18 ° of the cam"),
    "cam.station_spacing.error": (math.radians(0.5), "30 ′ at the table"),
    "drive.slip.compliance": (TURN * 5.0 / 60.0, "5 rpm per N m"),
    "drive.speed_ripple.depth": (0.02, "2 % of the speed"),
    "drive.speed_ripple.phase": (TURN / 8.0, "45 °"),
    "drive.transmission_error.amplitude": (math.radians(0.5), "30 ′ at the cam shaft"),
    "drive.transmission_error.phase": (TURN / 8.0, "45 °"),
    "drive.mesh_stiffness.depth": (0.3, "30 % of the stiffness"),
    "drive.mesh_stiffness.phase": (TURN / 8.0, "45 °"),
    "drive.mesh_friction.loss": (0.3, "30 % of the torque"),
    "load.imbalance.torque": (2.0 * 9.80665, "2 kg m"),
    "load.imbalance.phase": (TURN / 8.0, "45 °"),
    "load.process.centre": (0.25, "90 ° of the cam"),
    "load.process.half_width": (0.05, "18 ° of the cam"),
    "roller.crack.stiffness_loss": (0.3, "30 % of the stiffness lost"),
    "roller.crack_single.stiffness_loss": (0.3, "30 % of the stiffness lost"),
    "sensor.gain.error": (0.03, "3 % of the reading"),
    "sensor.highpass.corner": (TURN * 0.5, "0.5 Hz cut-off"),
    "sensor.bracket_resonance.inverse_square": ((TURN * 80.0) ** -2, "80 Hz"),
    "sensor.mains_hum.phase": (TURN / 8.0, "45 °"),
}
"""SI and what is said; the others of `SHOP` have tests of their own."""


@pytest.mark.parametrize("name", SAID)
def test_each_number_is_said_in_its_unit(name: str) -> None:
    value, said = SAID[name]
    number, _, unit = said.partition(" ")
    told = in_the_shop(name, (value, value, value), load_machine("reference"))
    assert told == f"{number} ({number} to {number}) {unit}"


def test_no_number_of_the_shop_is_left_out() -> None:
    others = {"input_joint.backlash", "input.backlash.backlash", "base.looseness.compliance"}
    assert set(SHOP) - set(SAID) == others | {"sensor.lowpass.time_constant"}


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
