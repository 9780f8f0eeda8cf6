"""What the report calls what was fitted: names, numbers and spreads in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from decimal import Decimal
from typing import Any

from datagen.campaigns.own import LOAD_FACTOR
from discrepancy.indexer.library import HOUSING
from discrepancy.indexer.together import GAIN
from discrepancy.subjects.shop_units import in_the_shop
from indexer_env.effects import EFFECTS
from indexer_env.machine import Machine

_WORDS = {
    "input_joint.stiffness": "stiffness of the reducer", "input_joint.damping": "damping of the reducer",
    "input_joint.backlash": "play in the reducer", "output_joint.stiffness": "stiffness of the rollers",
    "output_joint.damping": "damping of the rollers", "table_inertia": "inertia of the table",
    "cam_inertia": "inertia of the cam", "follower_inertia": "inertia of the turret",
    HOUSING: "inertia of the housing", LOAD_FACTOR: "loads, over those that were stated",
    GAIN: "gain of the sensor",
}  # fmt: skip

_DIGITS = 3


def words_of(path: str) -> str:
    """What a drawn quantity, or a parameter of the machine, is."""
    effect, _, parameter = path.removeprefix("effects.").rpartition(".")
    if path.startswith("effects.") and effect in EFFECTS:
        return next(f.metadata["meaning"] for f in fields(EFFECTS[effect]) if f.name == parameter)
    own = path.removeprefix("machine.")
    return _WORDS.get(own, own.replace("_", " ").replace(".", ", "))


def meaning_of(path: str) -> str:
    """What the effect is that a quantity belongs to; "" for the machine's own."""
    effect = path.removeprefix("effects.").rpartition(".")[0]
    return EFFECTS[effect].sentence if path.startswith("effects.") and effect in EFFECTS else ""


def value_of(row: Mapping[str, Any]) -> str:
    """The value of a row of the calibration, with its unit."""
    if row["path"] == LOAD_FACTOR:
        return f"{_plain(100.0 * row['value'])} %"
    return f"{_plain(row['value'])} {'' if row['unit'] == '-' else row['unit']}".rstrip()


def spread_of(row: Mapping[str, Any]) -> str:
    """Half of a row's 95 % interval, "±8 %"."""
    value, half = row["value"], 0.5 * (row["high"] - row["low"])
    if not half:
        return "fixed"
    return f"±{_plain(100.0 * half / abs(value), 2)} %" if value else f"±{_plain(half, 2)}"


def shop_of(row: Mapping[str, Any], machine: Machine) -> str:
    """A row's value and interval in the shop's unit; "" where that is the SI unit."""
    own = row["path"].removeprefix("machine.").removeprefix("effects.")
    return in_the_shop(own, (row["value"], row["low"], row["high"]), machine)


def _plain(value: float, digits: int = _DIGITS) -> str:
    """A number without an exponent, its thousands apart."""
    return f"{Decimal(f'{value:.{digits}g}'):,f}".replace(",", "\N{NARROW NO-BREAK SPACE}")
