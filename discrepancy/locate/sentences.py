"""Where the disagreement lies, in words: the few things an engineer would say of the map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discrepancy.locate.result import Cell, Spot

_UNEVEN = 3.0
"""Mean square above the noise, over the median of its axis, at which a cell stands out from the others."""

_DIFFERENT = 1.5
"""Ratio of mean squares above the noise at which two cells differ."""

_HALF = 0.5

_ONE_SPEED = 0.01
"""Spread of a line's frequencies over the records, relative, up to which these count as taken at one speed."""


def sentences(level: float, cells: Sequence[Cell], spots: Sequence[Spot]) -> tuple[str, ...]:
    """What the significant cells and lines of a residual at this level say, axis by axis."""
    if not any(one.significant for one in (*cells, *spots)):
        return (f"The residual is {level:.2f} times the noise, and no cell or line disagrees beyond chance.",)
    said = [f"The residual is {level:.2f} times the noise."]
    for axis in dict.fromkeys(cell.axis for cell in cells):
        mine = [cell for cell in cells if cell.axis == axis]
        if any(cell.significant for cell in mine):
            said += _of_axis(axis, mine)
    return (*said, *_of_lines(spots))


def _of_axis(axis: str, cells: list[Cell]) -> list[str]:
    excess = np.array([max(cell.level**2 - cell.expected**2, 0.0) for cell in cells])
    top = int(excess.argmax())
    if axis == "cam phase":
        return [_phases(cells, excess)]
    if axis == "station":
        return [_stations(cells, excess)]
    low = int(excess.argmin())
    if excess[top] < _DIFFERENT * max(excess[low], 0.1):
        return []
    strong, weak = cells[top], cells[low]
    return [
        f"By {axis} it is largest at {strong.label} ({strong.level:.1f} times the noise) and smallest at {weak.label} "
        f"({weak.level:.1f})."
    ]


def _phases(cells: list[Cell], excess: np.ndarray) -> str:
    """The cells that hold half of the excess, the strongest first, as ranges of the cam turn."""
    order = np.argsort(-excess)
    held = np.cumsum(excess[order]) / excess.sum()
    chosen = set(order[: int(np.searchsorted(held, _HALF)) + 1].tolist())
    width = 360.0 / len(cells)
    ranges, start = [], None
    for k in range(len(cells) + 1):
        if k in chosen and start is None:
            start = k
        elif k not in chosen and start is not None:
            ranges.append(f"{start * width:.0f}° to {k * width:.0f}°")
            start = None
    return f"Half of what exceeds the noise lies at a cam phase of {_and(ranges)}."


def _stations(cells: list[Cell], excess: np.ndarray) -> str:
    top, middle = float(excess.max()), float(np.median(excess))
    if top < _UNEVEN * max(middle, 0.05 * top, 0.1):
        if top < 2.0 * max(float(excess.min()), 0.1):
            return "It is much the same at every station, so it is not locked to the table's turns."
        strong, weak = cells[int(excess.argmax())], cells[int(excess.argmin())]
        return (
            f"It changes over the table turn: largest at station {strong.label} ({strong.level:.1f} times the noise), "
            f"smallest at station {weak.label} ({weak.level:.1f})."
        )
    strong = [cells[int(k)] for k in np.argsort(-excess) if excess[k] > _HALF * top]
    names = _and([cell.label for cell in strong[:3]])
    return (
        f"It is locked to table turns, largest at station {names}: {strong[0].level:.1f} times the noise, where the "
        f"other stations have {float(np.median([c.level for c in cells if c not in strong])):.1f}."
    )


def _of_lines(spots: Sequence[Spot]) -> list[str]:
    said = []
    if all(max(spot.frequency) - min(spot.frequency) <= _ONE_SPEED * max(spot.frequency) for spot in spots):
        strong = sorted((s for s in spots if s.significant), key=lambda s: -s.prominence)
        if not strong:
            return []
        names = _and([f"{s.name} ({s.frequency[0]:.4g} Hz)" if s.kind != "fixed frequency" else s.name for s in strong])
        return [f"Lines stand at {names}; at one speed an order of a shaft is not told from a fixed frequency."]
    for kind in dict.fromkeys(spot.kind for spot in spots):
        strong = sorted((s for s in spots if s.kind == kind and s.significant), key=lambda s: -s.prominence)
        if not strong:
            continue
        if kind == "fixed frequency":
            said.append(f"A line stands at {_and([s.name for s in strong])} at every speed, locked to no shaft.")
        else:
            orders = [s.name.removeprefix("order ").partition(" of")[0] for s in strong[:4]]
            said.append(f"Lines stand at order {_and(orders)} of the {kind} at every speed.")
    return said


def _and(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
