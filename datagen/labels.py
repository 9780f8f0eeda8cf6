"""Classes by the faults of the paper's bench, and subsets by machine draw."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import ParameterError, refuse

SUBSETS = ("calibration", "control", "validation")
"""The paper's three sets: to train, to stop the training, to judge it (section 4.1, step 2)."""

BITS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "roller cracked",
        ("faults.roller_crack", "effects.roller.crack.stiffness_loss", "effects.roller.crack_single.stiffness_loss"),
    ),
    ("screws loose", ("faults.screw_looseness", "effects.base.looseness.compliance")),
    ("backlash", ("faults.backlash", "effects.input.backlash.backlash")),
)
"""Bits of a code, first one first (the paper, section 5.1): the fault in words and the quantities that are it when they
are greater than 0. The paper's third bit grows with the backlash; here it says that there is some, and the column
`fault_backlash` how much."""

NO_FAULTS = {paths[0]: 0.0 for _, paths in BITS}
"""Of an item whose class its campaign decides; a fault of `faults` on top would belong to none."""


def combinations(faults: Sequence[str], none: str) -> tuple[str, ...]:
    """Name of each combination of faults, class 1 first; class - 1 in binary, a bit for each fault, is the code."""
    bits = itertools.product((False, True), repeat=len(faults))
    return tuple(", ".join(itertools.compress(faults, chosen)) or none for chosen in bits)


FAULT_CLASSES = combinations([words for words, _ in BITS], "intact")
"""Names of the classes by faults."""


def fault_class(values: Mapping[str, Any]) -> tuple[int, str, str]:
    """Class from 1, its name and its code, from the quantities of a machine by path."""
    code = "".join("1" if any(_there(values.get(path)) for path in paths) else "0" for _, paths in BITS)
    number = int(code, 2)
    return number + 1, FAULT_CLASSES[number], code


def _there(severity: object) -> bool:
    # What is no number is refused when the item is built; its label must stand beside the reason.
    return isinstance(severity, int | float) and severity > 0.0


def subset_schedule(parts: Mapping[str, Any], owner: str) -> tuple[str, ...]:
    """Subset of each machine draw, to be repeated over and over: machine draw d has subset d mod length.

    `parts` are whole numbers, e.g. {calibration: 5, control: 2, validation: 3} of every ten; after any number of draws
    each subset has its share to within one. Law: the next draw goes to the subset that lacks most of its share,
    parts_s · (d + 1) / Σ parts - draws it has.

    Raises
    ------
    ParameterError
        Not a mapping of SUBSETS to whole numbers >= 0 that sum up to 1 … 1000.
    """
    if not isinstance(parts, Mapping):
        raise ParameterError(f"{owner} must be a mapping of subsets to whole numbers, got {parts!r}.")
    for name, part in parts.items():
        check_choice(owner, "key", name, SUBSETS)
        check_integer(owner, name, part, low=0)
    total = sum(parts.values())
    if not 1 <= total <= 1000:
        raise refuse(owner, "sum", "from 1 to 1000 machine draws", total)
    schedule: list[str] = []
    for draw in range(total):
        lacking = {name: parts.get(name, 0) * (draw + 1) - total * schedule.count(name) for name in SUBSETS}
        schedule.append(max(SUBSETS, key=lambda name: lacking[name]))
    return tuple(schedule)
