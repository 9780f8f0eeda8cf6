"""Laws written in a quantity's own place, `machine.table_inertia={uniform: [4, 6]}`, moved to where a campaign reads
them, `campaign.draws`; the quantity itself gets the middle of its law."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from datagen.quantities import JOINTS, path_of
from indexer_env.effects import effects_by_name
from indexer_env.errors import refuse
from indexer_env.law_reader import is_law, make_law

_PLACES = ("machine", *(f"machine.{joint}" for joint in JOINTS), "operating_point", "faults", "sensor")


def laws_moved(config: Mapping[str, Any]) -> dict[str, Any]:
    """The configuration with its laws in `campaign.draws`, where a law in place takes the place of the campaign's own.

    Raises
    ------
    ParameterError
        A law in place that is relative to the value that it stands for, or for what no item has for itself.
    """
    plain = copy.deepcopy(dict(config))
    for section in ("run", "sensor", "operating_point", "machine"):
        if not isinstance(plain[section], dict):
            raise refuse("datagen", section, "a mapping of keys to values", plain[section], "leave it out")
    draws = plain["campaign"].setdefault("draws", {}) if isinstance(plain["campaign"], dict) else {}
    for place in _PLACES:
        section = _at(plain, place)
        for key, given in list(section.items()):
            if is_law(given) and path_of(f"{place}.{key}"):
                _put(_at(draws, place), place, key, given)
                section[key] = _centre(place, key, given)
    machine = plain["machine"]
    if isinstance(machine, dict) and isinstance(machine.get("effects"), Mapping):
        machine["effects"] = {
            name: _moved_effect(name, parameters, draws)
            for name, parameters in effects_by_name(machine["effects"]).items()
        }
    for key, given in (*plain["run"].items(), ("sample_rate", plain["sensor"].get("sample_rate"))):
        if is_law(given):
            rule = "one value, as all records of a data set share it"
            raise refuse("datagen", key, rule, given, "sweep over it with -m, one data set for each value")
    return plain


def _moved_effect(name: str, parameters: Any, draws: dict[str, Any]) -> Any:
    if not isinstance(parameters, Mapping):
        return parameters
    place = f"effects.{name}"
    laws = {key: given for key, given in parameters.items() if is_law(given)}
    if laws:
        effects = draws["effects"] = effects_by_name(draws.get("effects", {}))
        before = effects.get(name, {})
        # the machine has the effect now, in every item
        effects[name] = {key: given for key, given in before.items() if key != "probability"} | laws
    return {key: _centre(place, key, given) if key in laws else given for key, given in parameters.items()}


def _put(section: dict[str, Any], place: str, key: str, given: Any) -> None:
    """Set a law in the campaign's section, in place of one for the same quantity under another key."""
    for other in list(section):
        if path_of(f"{place}.{other}") == path_of(f"{place}.{key}"):
            del section[other]
    section[key] = given


def _centre(place: str, key: str, given: Any) -> Any:
    law = make_law(place, key, given)
    if law.needs_nominal:
        rule = "{around: [nominal, share]} where a law stands in a quantity's own place"
        raise refuse(place, key, rule, dict(given), f"or keep its value and add +campaign.draws.{place}.{key}=…")
    return law.centre


def _at(mapping: dict[str, Any], place: str) -> dict[str, Any]:
    """The mapping at a dotted place, made where there is none."""
    for name in place.split("."):
        below = mapping.setdefault(name, {})
        if not isinstance(below, dict):
            return {}
        mapping = below
    return mapping
