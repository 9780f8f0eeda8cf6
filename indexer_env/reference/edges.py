"""The first edge that a step crosses: guards watched at the step's end and, near an edge, inside the step as well."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from indexer_env.reference.cam import Stretch
from indexer_env.reference.contact import Contact

CAM_LOW, CAM_HIGH, JOINT_1 = -2, -1, 0
"""Which guard ran out; joint j is JOINT_1 + j."""

PAST = 1e-12
"""rad; an edge counts as crossed this far behind it. Well above the rounding of an angle of many turns, so that the
same edge cannot fire twice; far below what a deflection means (4e-8 N m in the reference machine)."""

_INSIDE = 8
"""Parts of a step near an edge; the guards are looked at between them, so that a visit across the edge and back is
seen."""


class Guards:
    """Distances to all edges of the smooth system in force, from the sheet's values (equations.SHEET)."""

    def __init__(
        self, stretch: Stretch, contacts: Sequence[Contact], regions: Sequence[int], present: Sequence[int]
    ) -> None:
        self.stretch, self.contacts, self.regions, self.present = stretch, contacts, tuple(regions), present
        self.names = (CAM_LOW, CAM_HIGH, *(JOINT_1 + joint for joint in present))
        self.releases = [
            contacts[joint].damping / (contacts[joint].ratio * contacts[joint].stiffness) for joint in present
        ]

    def __call__(self, values: Sequence[float]) -> list[float]:
        """Distances [rad] in the order of `names`, < -PAST once an edge has been crossed."""
        distances = [values[0] - self.stretch.low, self.stretch.high - values[0]]
        for joint in self.present:
            deflection, rate = values[6 + 2 * joint], values[7 + 2 * joint]
            distances.append(self.contacts[joint].guard(self.regions[joint], deflection, rate))
        return distances

    def reach(self, before: Sequence[float], after: Sequence[float], step: float) -> list[float]:
        """How far the guards could have dipped inside a step between these two sheets [rad], generously."""
        distances = [0.0, 0.0]  # the cam's angle is monotone over a step
        for joint, release in zip(self.present, self.releases, strict=True):
            rate = max(abs(before[7 + 2 * joint]), abs(after[7 + 2 * joint]))
            distances.append((2.0 * step + release) * rate)
        return distances


def first_crossing(
    guards: Guards,
    before: Sequence[float],
    after: Sequence[float],
    step: float,
    at: Callable[[np.ndarray], list[tuple[float, ...]]],
) -> tuple[float, int] | None:
    """The first edge crossed within a step: the time into the step [s] and which guard; None where there is none.

    Parameters
    ----------
    guards : Guards
    before, after : sequence of float
        Sheets at the step's two ends.
    step : float
        Its length [s].
    at : callable
        Sheets at given times into the step (n,) [s].
    """
    start, end = guards(before), guards(after)
    reach = guards.reach(before, after, step)
    near = [
        g1 < -PAST or min(g0, g1) < dip for g0, g1, dip in zip(start, end, reach, strict=True)
    ]  # fmt: skip
    if not any(near):
        return None
    times = np.arange(1, _INSIDE) * (step / _INSIDE)
    inner = [guards(values) for values in at(times)]
    marks = [0.0, *times.tolist(), step]
    rows = list(zip(start, *inner, end, strict=True))
    found: tuple[float, int] | None = None
    for index, (name, row) in enumerate(zip(guards.names, rows, strict=True)):
        if near[index]:
            bracket = _bracket(marks, row, lambda s, index=index: guards(at(np.array([s]))[0])[index])
            if bracket is not None and (found is None or bracket[0] < found[0]):
                time = _root(bracket, lambda s, index=index: guards(at(np.array([s]))[0])[index] + PAST)
                if found is None or time < found[0]:
                    found = time, name
    return found


def _bracket(
    marks: Sequence[float], row: Sequence[float], guard: Callable[[float], float]
) -> tuple[float, float] | None:
    """The first two times between which a guard runs out; a dip between three marks is looked into at its vertex."""
    for i in range(1, len(row)):
        if i + 1 < len(row) and row[i + 1] >= row[i] < row[i - 1] and row[i] >= -PAST:
            curvature = row[i - 1] - 2.0 * row[i] + row[i + 1]
            shift = 0.5 * (row[i - 1] - row[i + 1]) / curvature
            if row[i] - 0.5 * curvature * shift**2 < -PAST:
                vertex = marks[i] + shift * (marks[i + 1] - marks[i])
                if guard(vertex) < -PAST:
                    return marks[i - 1], vertex
        if row[i] < -PAST:
            return marks[i - 1], marks[i]
    return None


def _root(bracket: tuple[float, float], function: Callable[[float], float]) -> float:
    """Where the function falls through zero, to the last digits of the time."""
    from scipy.optimize import root_scalar  # here, not above: it takes longer to import than the rest of the package

    low, high = bracket
    if function(low) <= 0.0:
        return low
    return root_scalar(function, bracket=(low, high), method="brentq", xtol=1e-17, rtol=1e-15).root
