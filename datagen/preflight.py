"""What can be known to be wrong with a campaign's laws before anything is simulated: what would fail for every item,
what would be drawn and never be seen, and what would mix units."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

from datagen.campaign import Base, Campaign, Case, Item, build
from datagen.draws import effect_of
from indexer_env.effects import LOADABLE
from indexer_env.errors import ParameterError, refuse
from indexer_env.faults import NO_CRACK, NO_CRACK_REMEDY
from indexer_env.laws import Fixed, Law
from indexer_env.machine import NOT_IN_MODEL

LOOKED_AT = 32
"""Items that are looked at from the campaign's beginning, and as many from all of it; what none of them shows is taken
to be in none, but for an effect that is drawn by its probability."""

_GOLDEN = 0.6180339887498949
"""Multiples of it, modulo 1, fill the unit interval evenly and in step with no axis of a grid."""


def check_draws(campaign: Campaign, base: Base, seed: int, count: int) -> None:
    """Refuse laws that are mistakes.

    Raises
    ------
    ParameterError
        A base that the campaign cannot label, a station of a crack that no item has, a drawn effect that cannot be
        built, a drawn quantity that no item uses or that a law around 0 never changes, a drawn radius that would change
        the records' unit, or repeats that would all be the same.
    """
    campaign.check_base(base)
    laws = {**campaign.machine_laws.laws, **campaign.item_laws.laws}
    spread = [int(campaign.size * (number * _GOLDEN % 1.0)) for number in range(LOOKED_AT)]
    items = [campaign.item(index, base, seed) for index in (*range(LOOKED_AT), *spread)]
    _check_radius(laws, base)
    _check_effects(campaign, base, laws)
    cases = list(_built(items, base))
    if len({case.sensor.radius is None for case in cases}) > 1:
        rule = "a number in all items or null in all, as all records share their unit"
        remedy = "sweep over it with -m, one data set for each value"
        raise refuse("campaign", "sensor.radius", rule, "both", remedy)
    for path, law in laws.items():
        if not isinstance(law, Fixed) and cases:
            _check_used(path, law, cases, campaign)
    station = base.faults.cracked_station
    if station is not None and cases and all(case.faults.roller_crack == 0.0 for case in cases):
        raise refuse("faults", "cracked_station", NO_CRACK, station, NO_CRACK_REMEDY)
    _check_repeats(laws, base, campaign, count)


def _built(items: Sequence[Item], base: Base) -> Iterator[Case]:
    for item in items:
        try:
            yield build(item, base)
        except ParameterError:
            continue  # recorded as rejected when it is its turn


def _check_radius(laws: dict[str, Law], base: Base) -> None:
    law = laws.get("sensor.radius")
    if law is not None and (base.sensor.radius is None or None in law.extremes):
        rule = "drawn only where sensor.radius is a number and stays one, as all records share their unit"
        raise refuse("campaign", "sensor.radius", rule, law)


def _check_effects(campaign: Campaign, base: Base, laws: dict[str, Law]) -> None:
    own = {effect.name for effect in base.machine.effects}
    for name in campaign.machine_laws.probabilities:
        for field in dataclasses.fields(LOADABLE[name]):
            missing = field.default is dataclasses.MISSING and f"effects.{name}.{field.name}" not in laws
            if missing and name not in own:
                raise refuse(f"campaign.draws.effects.{name}", field.name, "given, by a value or a law", None)


def _check_used(path: str, law: Law, cases: Sequence[Case], campaign: Campaign) -> None:
    values = [_value(case.item, path) for case in cases]
    if 0.0 < campaign.machine_laws.probabilities.get(effect_of(path) or "", 1.0) < 1.0 and set(values) == {None}:
        return  # an effect so rare that no item looked at has it
    if law.needs_nominal and all(value in (0.0, None) for value in values):
        remedy = "draw it by {uniform: [low, high]} or another law"
        raise refuse("campaign", path, "other than 0 where its law is around a nominal value", law, remedy)
    if all(value is None or _idle(path, case, campaign) for value, case in zip(values, cases, strict=True)):
        rule = "a quantity that the campaign's machines and sensors use"
        raise refuse("campaign", path, rule, law, "leave it out, or switch on what uses it")


def _value(item: Item, path: str) -> Any:
    section, _, rest = path.partition(".")
    if section != "effects":
        return getattr(item, section).get(rest)
    name, _, parameter = rest.rpartition(".")
    return item.effects.get(name, {}).get(parameter)


def _idle(path: str, case: Case, campaign: Campaign) -> bool:
    """Whether a quantity changes nothing in this case."""
    section, _, name = path.partition(".")
    if section == "machine":
        return _idle_in_machine(name, case, campaign)
    if section == "sensor":
        return name in _IDLE_WITHOUT and not getattr(case.sensor, _IDLE_WITHOUT[name])
    return path == "faults.cracked_station" and case.faults.roller_crack == 0.0


_IDLE_WITHOUT = {
    "bracket_damping": "bracket_hz",
    "lowpass_order": "lowpass_hz",
    "hum_hz": "hum_amplitude",
    "hum_phase": "hum_amplitude",
    "hum_third": "hum_amplitude",
}
"""What a field of the sensor needs to be seen."""


def _idle_in_machine(name: str, case: Case, campaign: Campaign) -> bool:
    machine = case.machine
    present = {effect.name for effect in machine.effects if not effect.is_null} | set(
        campaign.machine_laws.probabilities
    )
    loose = "base.looseness" in present
    head = name.partition(".")[0]
    if head == "name":
        return True
    if head == "motor_inertia":
        return "drive.slip" not in present
    if head == "housing_inertia" and loose:
        return False
    return head in NOT_IN_MODEL[machine.model]


def _check_repeats(laws: dict[str, Law], base: Base, campaign: Campaign, count: int) -> None:
    """Two items of equal values and no noise are the same record."""
    noisy = base.sensor.noisy or any(path.startswith("sensor.noise") for path in laws)
    if noisy or not all(isinstance(law, Fixed) for law in laws.values()):
        return
    different = campaign.different
    if count > different:
        rule = f"<= {different} where nothing is drawn and the sensor has no noise, as all others would be the same"
        raise refuse(
            "datagen", "count", rule, count, "vary them, e.g. operating_point.start_angle={uniform: [0, 50.3]}"
        )
