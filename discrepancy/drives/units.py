"""Units of a drive's channels as files write them, and what they are worth in SI units and radians."""

from __future__ import annotations

import math
import re
from itertools import product

from indexer_env.units import DEGREE, RPM
from indexer_records.acceleration_units import ACCELERATION_UNITS, normal

_TURN = 2.0 * math.pi

_PATHS = {
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6},
    "rad": {
        "rad": 1.0, "mrad": 1e-3, "deg": DEGREE, "°": DEGREE, "degree": DEGREE, "degrees": DEGREE, "rev": _TURN,
        "turn": _TURN, "turns": _TURN,
    },
}  # fmt: skip
"""Lengths and angles, in lower case."""

_MOTION = {
    **{name: (worth, si) for si, names in _PATHS.items() for name, worth in names.items()},
    **{
        f"{name}/{per}": (worth / seconds, f"{si}/s")
        for si, names in _PATHS.items()
        for (name, worth), (per, seconds) in product(names.items(), (("s", 1.0), ("min", 60.0)))
    },
    **{f"{name}/s^2": (worth, f"{si}/s^2") for si, names in _PATHS.items() for name, worth in names.items()},
    **dict.fromkeys(("rpm", "1/min", "min^-1", "r/min"), (RPM, "rad/s")),
    "rpm/s": (RPM, "rad/s^2"),
}

_PREFIXES = {"": 1.0, "m": 1e-3, "da": 1e1, "k": 1e3, "M": 1e6}
"""As they are written: mN and MN are not the same."""

_FORCES = {
    **{f"{prefix}{si}": (worth, si) for si in "NAV" for prefix, worth in _PREFIXES.items()},
    **{
        f"{prefix}N{arm}": (worth * length, "N m")
        for (prefix, worth), (arm, length) in product(_PREFIXES.items(), (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)))
    },
}


def in_si(stated: str, acceleration: bool = False) -> tuple[float, str]:
    """What one of a unit is worth in the unit that is used here, and that; one that is not known stays as it is. `g`
    is one of an acceleration alone: elsewhere it may be grams."""
    found = _FORCES.get(re.sub(r"[\s*·⋅]", "", stated)) or _MOTION.get(normal(stated))
    if acceleration and not found and normal(stated) in ACCELERATION_UNITS:
        si, worth = ACCELERATION_UNITS[normal(stated)]
        found = worth, si
    return found or (1.0, stated.replace("²", "^2"))
