"""Lines at any frequency: those that stand out of every record, beside the ones that are looked at in any case.

A line found this way stands out so far (`indexer.lines`: thirty times the median of its surroundings) that chance does
it once in some 10⁸ bins. So the test over all cells and lines may take it like one that was named beforehand.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from discrepancy.indexer.lines import MOST, lines
from discrepancy.locate.statistics import parts_of
from discrepancy.subjects.base import Line, View

_MOTOR, _CAM = "motor shaft", "cam"

_SAME = 1.5
"""Widths 1/T within which two lines of one kind are one."""


def with_found_lines(view: View, residual: np.ndarray) -> View:
    """The view with the lines that stand out of residuals (w, n) in every record, and in each of its channels, added to
    its own."""
    numbers, parts = zip(*parts_of(view), strict=True)
    # records of a drive may have rates of their own
    rates = [1.0 / float(np.median(np.diff(view.time[part]))) for part in parts]
    spans = dict(zip(numbers, (float(np.ptp(view.time[part])) for part in parts), strict=True))
    width = np.array([1.0 / spans[number] for number in range(len(view.noise))])
    motor = view.shafts.get(_MOTOR, np.ones(len(width)))
    orders, hums = lines([residual[part] for part in parts], rates, motor[list(numbers)].tolist())
    fixed = [Line(f"{f:.4g} Hz", "fixed frequency", np.full(len(width), f)) for f in hums]
    orders = orders if _MOTOR in view.shafts else ()
    turning = [Line(f"order {order:g} of the {_MOTOR}", _MOTOR, order * motor) for order in orders]
    known = list(view.lines)
    for line in _strongest(fixed, view, width) + _strongest(turning, view, width):
        same = [other for other in known if other.kind == line.kind]
        if not any((np.abs(line.frequency - other.frequency) < _SAME * width).all() for other in same):
            known.append(line)
    return dataclasses.replace(view, lines=tuple(known))


def _strongest(found: Sequence[Line], view: View, width: np.ndarray) -> list[Line]:
    """The first lines that are none of the cam's own."""
    return [line for line in found if not _cam_repeats(line, view, width)][:MOST]


def _cam_repeats(line: Line, view: View, width: np.ndarray) -> bool:
    """Whether a line is one of the cam's own orders in every record: what repeats with the cam has all of them."""
    if _CAM not in view.shafts:
        return False
    cam = view.shafts[_CAM]
    return bool((np.abs(line.frequency - np.round(line.frequency / cam) * cam) < _SAME * width).all())
