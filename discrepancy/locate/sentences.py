"""Where the disagreement lies, in words: the few things an engineer would say of the map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discrepancy.locate.result import Cell, Spot
from indexer_cli.words import joined

_UNEVEN = 3.0
"""Mean square above the noise, over the median of its axis, at which a cell stands out from the others."""

_DIFFERENT = 1.5
"""Ratio of mean squares above the noise at which two cells differ."""

_HALF = 0.5

STATION = "station"
"""The axis on which a second turn of the table can be told from the first one."""

_OUTSTANDING = 100.0
"""Prominence of a line from which on it is what one would say first."""

_ONE_SPEED = 0.01
"""Spread of a line's frequencies over the records, relative, up to which these count as taken at one speed."""


def sentences(
    level: float, cells: Sequence[Cell], spots: Sequence[Spot], passes: np.ndarray, spread: Sequence[Cell] = ()
) -> tuple[str, ...]:
    """What the significant cells and lines of a residual at this level say, axis by axis.

    `passes` (2, stations) are the mean squares of each station's first and second cam turn, NaN where there is none;
    `spread` are the significant cells of the map, which speak where no cell of a single axis does.
    """
    residual = f"On the records fitted the residual is {level:.2f} times the noise"
    if not any(one.significant for one in (*cells, *spots, *spread)):
        return (f"{residual}, and no cell or line disagrees beyond chance.",)
    said = [f"{residual}."]
    for axis in dict.fromkeys(cell.axis for cell in cells):
        mine = [cell for cell in cells if cell.axis == axis]
        if any(cell.significant for cell in mine):
            said += _of_axis(axis, mine, passes)
    if spread and not any(cell.significant for cell in cells):
        top = _strongest(spread)
        said.append(f"By {top.axis} together it stands out at {top.label}: {top.level:.1f} times the noise.")
    return (*said, *_of_lines(spots))


def shortly(cells: Sequence[Cell], spots: Sequence[Spot], spread: Sequence[Cell] = ()) -> str:
    """Where the disagreement is, in a few words for a headline: the cell that stands out most from the others of its
    axis, or else of the map, or the strongest line; "" where nothing disagrees beyond chance."""
    contrasts = []
    for axis in dict.fromkeys(cell.axis for cell in cells):
        mine = [cell for cell in cells if cell.axis == axis]
        excess = _excess(mine)
        if any(cell.significant for cell in mine):
            contrasts.append((float(excess.max() / (excess.mean() + 0.1)), mine[int(excess.argmax())]))
    # orders of table and cam stand wherever a residual repeats with them, and say no more than the cells do
    telling = [s for s in spots if s.significant and s.kind in ("motor shaft", "fixed frequency")]
    line = max(telling, key=lambda s: s.prominence, default=None)
    if line is not None and line.prominence > _OUTSTANDING:
        return f"at {line.name}"
    if not contrasts and not spread:
        return ""
    cell = max(contrasts, key=lambda pair: pair[0])[1] if contrasts else _strongest(spread)
    if cell.axis in ("cam phase", "time"):
        return f"most at a {cell.axis} {_ends(cell, cells)}"
    return f"most at {cell.axis} {cell.label}" if cell.axis == STATION else f"most at {cell.label} ({cell.axis})"


def _ends(cell: Cell, cells: Sequence[Cell]) -> str:
    """Where a cell begins and ends; its label is where it begins, with its unit."""
    mine = [one for one in cells if one.axis == cell.axis]
    if len(mine) < 2:
        return f"from {cell.label} on"
    begins = _begins(mine)
    end = begins[mine.index(cell)] + float(np.diff(np.sort(begins)).min())
    return f"of {cell.label} to {end:g}{cell.label.lstrip('-.0123456789')}"


def _begins(cells: Sequence[Cell]) -> np.ndarray:
    """Where cells of cam phase or time begin (n,), which their labels say [° or s]."""
    return np.array([float(cell.label.rstrip("° s")) for cell in cells])


def _strongest(cells: Sequence[Cell]) -> Cell:
    return max(cells, key=lambda cell: cell.level)


def _excess(cells: Sequence[Cell]) -> np.ndarray:
    """Mean squares above what noise alone gives."""
    return np.array([max(cell.level**2 - cell.expected**2, 0.0) for cell in cells])


def _of_axis(axis: str, cells: list[Cell], passes: np.ndarray) -> list[str]:
    excess = _excess(cells)
    top = int(excess.argmax())
    if axis == "cam phase":
        return [_phases(cells, excess)]
    if axis == STATION:
        return [_stations(cells, excess, passes)]
    low = int(excess.argmin())
    if excess[top] < _DIFFERENT * max(excess[low], 0.1):
        return []
    strong, weak = cells[top], cells[low]
    at = "" if axis == "direction" else "at "  # forwards, backwards, at rest
    return [
        f"By {axis} it is largest {at}{strong.label} ({strong.level:.1f} times the noise) and smallest "
        f"{at}{weak.label} ({weak.level:.1f})."
    ]


def _phases(cells: list[Cell], excess: np.ndarray) -> str:
    """The strongest cells beyond chance that hold half of the excess, or all of them, as ranges of the cam turn, and
    what share they hold. A cell that no record has samples of is not among them."""
    order = [int(k) for k in np.argsort(-excess) if cells[k].significant]
    held = np.cumsum(excess[order]) / excess.sum()
    count = min(int(np.searchsorted(held, _HALF)) + 1, len(order))
    chosen = np.sort(order[:count])
    begins = _begins(cells)
    width = float(np.diff(begins, append=360.0).min())
    runs = np.split(begins[chosen], np.flatnonzero(np.diff(begins[chosen]) > 1.5 * width) + 1)
    ranges = [f"{run[0]:.0f}° to {run[-1] + width:.0f}°" for run in runs]
    return f"{100.0 * held[count - 1]:.0f} % of what exceeds the noise lies at a cam phase of {joined(ranges)}."


def _stations(cells: list[Cell], excess: np.ndarray, passes: np.ndarray) -> str:
    if len(cells) < 2:
        station = cells[0].label
        return f"All records show station {station} alone, so whether it is locked to the table's turns is not known."
    top, middle = float(excess.max()), float(np.median(excess))
    if top < _UNEVEN * max(middle, 0.05 * top, 0.1) and top < 2.0 * max(float(excess.min()), 0.1):
        return "It is much the same at every station, so it is not locked to the table's turns."
    stands_out = top >= _UNEVEN * max(middle, 0.05 * top, 0.1)
    strong = [int(k) for k in np.argsort(-excess) if excess[k] > (_HALF if stands_out else 1.0 - 1e-9) * top]
    names = joined([cells[k].label for k in sorted(strong)])
    weak = sorted(cells[k].level for k in range(len(cells)) if k not in strong)
    others = " to ".join(dict.fromkeys(f"{level:.1f}" for level in (weak[0], weak[-1])))
    where = f"at station {names}: {cells[strong[0]].level:.1f} times the noise, where the other stations have {others}"
    stations = [int(cells[k].label) for k in strong]
    if not _twice(stations, passes):
        return (
            f"It is largest {where}. No record holds two turns of the table there, so a station and a time within the "
            "record are one thing."
        )
    if not _again(stations, passes):
        return f"It is largest {where}, but not in a second turn of the table, so it is not locked to its turns."
    return f"It is locked to table turns, largest {where}; the second turn shows it again."


def _twice(stations: Sequence[int], passes: np.ndarray) -> bool:
    """Whether all of these stations were seen in a second turn."""
    return passes.size > 0 and not np.isnan(passes[:, list(stations)]).any()


def _again(stations: Sequence[int], passes: np.ndarray) -> bool:
    """Whether what these stations have above the others' median in one turn they have by half or more in the other, and
    by more than what all stations change from one turn to the other."""
    others = [k for k in range(passes.shape[1]) if k not in stations]
    ground = [float(np.nanmedian(row[others])) if not np.isnan(row[others]).all() else 1.0 for row in passes]
    first, second = (float(row[list(stations)].mean()) - level for row, level in zip(passes, ground, strict=True))
    return min(first, second) > max(_HALF * max(first, second), abs(ground[1] - ground[0]))


def _of_lines(spots: Sequence[Spot]) -> list[str]:
    said = []
    if all(max(spot.frequency) - min(spot.frequency) <= _ONE_SPEED * max(spot.frequency) for spot in spots):
        strong = sorted((s for s in spots if s.significant), key=lambda s: -s.prominence)
        if not strong:
            return []
        at = [f" ({s.frequency[0]:.4g} Hz)" if s.kind != "fixed frequency" else "" for s in strong]
        names = joined([s.name + hertz for s, hertz in zip(strong, at, strict=True)])
        unsure = "; at one speed an order of a shaft is not told from a fixed frequency"
        shafts = any(spot.kind != "fixed frequency" for spot in spots)
        stand = "Lines stand" if shafts or len(strong) > 1 else "A line stands"
        return [f"{stand} at {names}{unsure if shafts else ''}."]
    for kind in dict.fromkeys(spot.kind for spot in spots):
        strong = sorted((s for s in spots if s.kind == kind and s.significant), key=lambda s: -s.prominence)
        if not strong:
            continue
        if kind == "fixed frequency":
            stand = "Lines stand" if len(strong) > 1 else "A line stands"
            said.append(f"{stand} at {joined([s.name for s in strong])} at every speed, locked to no shaft.")
        else:
            orders = [s.name.removeprefix("order ").partition(" of")[0] for s in strong[:4]]
            said.append(f"Lines stand at order {joined(orders)} of the {kind} at every speed.")
    return said
