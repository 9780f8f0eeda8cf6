"""Units of acceleration as files write them, and the two that a Signal has."""

from __future__ import annotations

from indexer_env.errors import SignalError
from indexer_env.units import DEGREE
from indexer_records.formats.table import Column, MeasuredTable

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s²], exact by definition (3rd CGPM, 1901)."""

ACCELERATION_UNITS = {
    "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", DEGREE),
    "°/s^2": ("rad/s^2", DEGREE),
    "m/s^2": ("m/s^2", 1.0),
    "mm/s^2": ("m/s^2", 1e-3),
    "g": ("m/s^2", STANDARD_GRAVITY),
    "mg": ("m/s^2", 1e-3 * STANDARD_GRAVITY),
}
"""Acceleration unit as written (normalised) -> unit of the Signal and the factor to it."""

KNOWN = "rad/s^2, deg/s^2, m/s^2, mm/s^2, g, mg"
"""The same in words."""


def unit_of(table: MeasuredTable, column: Column, given: str | None, scale: float | None) -> tuple[str, float]:
    """Unit of the Signal that a column becomes, and the factor from the file's numbers to it.

    `given` and `scale` are the unit and the worth of one number that the user states, see `measured.Reading`.

    Raises
    ------
    SignalError
        No unit, two that differ, or one that is not known.
    """
    place = f"{table.path}, column {column.name!r}"
    if column.full_scale and scale is None:
        raise SignalError(
            f"{place}: samples are shares of a full scale that the file does not know; give it and its unit "
            "(read.scale=NUMBER read.unit=UNIT)."
        )
    if scale is None and column.unit and given and normal(column.unit) != normal(given):
        raise SignalError(
            f"{place}: the unit must be given once, got {column.unit!r} in the header and "
            f"{given!r}; leave read.unit out or correct the header."
        )
    written = given if scale is not None else column.unit or given
    if written is None:
        raise SignalError(
            f"{place}: no unit; write it into the header as "
            f"{column.name + ' [UNIT]'!r} or give it (read.unit=UNIT), one of {KNOWN}."
        )
    if normal(written) not in ACCELERATION_UNITS:
        raise SignalError(
            f"{place}: the unit must be one of {KNOWN}, got {written!r}; "
            "correct the header or give read.unit and read.scale."
        )
    unit, factor = ACCELERATION_UNITS[normal(written)]
    return unit, factor * (1.0 if scale is None else scale)


def normal(unit: str) -> str:
    """A unit in the spelling of ACCELERATION_UNITS: "m/s²", "m/s/s" and "m / s2" as "m/s^2"."""
    text = unit.strip().lower().replace(" ", "").replace("²", "^2").replace("**2", "^2").replace("/s/s", "/s^2")
    return text[:-2] + "s^2" if text.endswith("/s2") else text
