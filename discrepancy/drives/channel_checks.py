"""What the channels of a record must agree in: the units of their roles, and a motion that is one motion, but for the
offset of a sensor."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from discrepancy.drives import smoothing
from discrepancy.drives.description import LOAD, Drive
from indexer_cli.words import joined
from indexer_env.errors import refuse

_MOTION = {"q": ("m", "rad"), "v": ("m/s", "rad/s"), "a": ("m/s^2", "rad/s^2"), LOAD[0]: ("m", "rad")}
_FORCE = ("N", "N m", "A", "V")
"""Units that roles may have: motion of one kind; a force by what makes it, too."""

_AGREES = (0.67, 1.5)
"""A measured rate over that of the measured position: what lies beyond is another unit or sign."""

_LIKE = 0.9
"""Correlation of the two from which on their ratio is known."""

_HOLDS = 4.0
"""Cut-off behind which the two are compared, over what holds 99 % of the motion."""

_LEAST_PERIODS = 10.0
"""Least periods of that cut-off in a record."""

_WHOLE = 0.9
"""Least share of a position's range that it loses in a single step where its counter begins anew, and of its samples
that are none of a mark's."""

_MARKED = 10.0
"""Range with a mark over that without it."""

_APART = 10.0
"""Least size of such a step over the median step."""

_ASTRAY = 10.0
"""Least distance of a sample from what its neighbours say, over that of all but one in a hundred."""

_VISIBLE = 0.01
"""Least such distance over the range: an encoder that sticks and slips may move by less between two samples."""

_STRETCHES = (8, 20)
"""Stretches, at least and at most, into which a record is cut to see how much a difference of two channels varies."""

_CHANCE = 1e-4
"""Probability that stretches agree so well in an offset that is none."""

_SLIGHT = 1e-4
"""Offset over its channel's standard deviation below which it is rounding."""


def _motion_of(drive: Drive) -> list[dict[str, str]]:
    """For each joint the roles of its motion: {"q": role of the position, ...}."""
    if not drive.forward:
        return [{"q": "q", "v": "v", "a": "a", LOAD[0]: LOAD[0]}]
    found = [{"q": joint.position, "v": joint.speed} for joint in drive.joints]
    if "a" not in drive.states:
        found[0]["a"] = "a"
    return found


def usual_unit(drive: Drive, role: str) -> str:
    """A unit that a role may have, for a remedy; an input may have any."""
    if role == "force" and not drive.forward:
        return _FORCE[0]
    kinds = [kind for roles in _motion_of(drive) for kind, one in roles.items() if one == role]
    return _MOTION[kinds[0]][0] if kinds else "UNIT"


def check_units(drive: Drive, path: Path, units: Mapping[str, str]) -> None:
    """Refuse a unit that a role cannot have, or that is not that of the same joint's other roles."""
    remedy = "correct the header, or give channels = {{{!r}: (column, factor, {!r})}}"
    if not drive.forward and units["force"] not in _FORCE:
        rule = f"in {joined(_FORCE, 'or')}"
        turning = any(units.get(role, "").startswith("rad") for role in ("q", "v"))
        raise refuse(str(path), "force", rule, units["force"], remedy.format("force", "N m" if turning else "N"))
    for roles in _motion_of(drive):
        there = {kind: role for kind, role in roles.items() if role in units}
        for kind, role in there.items():
            first = next(iter(there))
            known = _MOTION[kind]
            if units[there[first]] in _MOTION[first]:
                known = (known[_MOTION[first].index(units[there[first]])],)
            if units[role] not in known:
                raise refuse(str(path), role, f"in {' or '.join(known)}", units[role], remedy.format(role, known[0]))


def check_markers(path: Path, rows: Mapping[str, np.ndarray], units: Mapping[str, str]) -> None:
    """Refuse a channel that holds one value some times, many times its other range away: a logger's mark of samples
    that it has not, as -9999."""
    for role, row in rows.items():
        for end in (float(row.min()), float(row.max())):
            others = row[row != end]
            if len(others) >= _WHOLE * len(row) and float(np.ptp(row)) > _MARKED * float(np.ptp(others)) > 0.0:
                count = len(row) - len(others)
                rule, got = "without marks of missing samples", f"{end:.6g} {units[role]} in {count} of {len(row)}"
                raise refuse(str(path), role, rule, got, "leave these times out of the file, or mend them")


def check_motion(
    drive: Drive, path: Path, rows: Mapping[str, np.ndarray], units: Mapping[str, str], rate: float
) -> dict[str, float]:
    """Offsets by role of a measured speed or acceleration: what it is more, on average, than the rate of what it should
    be, Δq/T or Δv/T over the record.

    Refuses a position that jumps or whose counter begins anew, a speed or an acceleration that is not that rate, and a
    load's position that is not on the drive's side of the gear."""
    offsets = {}
    for roles in _motion_of(drive):
        for kind in ("q", LOAD[0]):
            if (role := roles.get(kind, "")) in rows:
                _check_steps(path, role, rows[role], units[role], rate)
        for kind, sources in (("v", "q"), ("a", "vq")):
            source = next((roles[s] for s in sources if roles.get(s, "") in rows), None)
            if roles.get(kind, "") in rows and source is not None:
                order = 2 if (kind, source) == ("a", roles["q"]) else 1
                if offset := _check_rate(path, rows, roles[kind], source, order, rate):
                    offsets[roles[kind]] = offset
    if not drive.forward and LOAD[0] in rows:
        _check_load(path, rows)
    return offsets


def _check_steps(path: Path, role: str, row: np.ndarray, unit: str, rate: float) -> None:
    """Refuse a step that is nearly the whole range, or that takes a sample further from the cubic through its four
    neighbours than the position moves from sample to sample there."""
    steps, span = np.abs(np.diff(row)), float(np.ptp(row))
    k = int(np.argmax(steps))
    whole = steps[k] > max(_WHOLE * span, _APART * float(np.median(steps)))
    astray = np.abs(row[2:-2] - (4.0 * (row[1:-3] + row[3:-1]) - row[:-4] - row[4:]) / 6.0)
    worst = int(np.argmax(astray)) + 2
    usual = float(np.quantile(astray[astray > 0.0], 0.99)) if astray.any() else 0.0
    moved = max(steps[n] for n in (worst - 4, worst - 3, worst + 2, worst + 3) if 0 <= n < len(steps))
    if whole or float(astray.max()) > max(moved, _ASTRAY * usual, _VISIBLE * span):
        if not whole:
            k = worst - 2 + int(np.argmax(steps[worst - 2 : worst + 2]))
        rule, got = "a position that does not jump", f"a step of {steps[k]:.4g} {unit} at {(k + 1) / rate:.4g} s"
        remedy = "unwrap an encoder that begins anew after each turn, as numpy.unwrap does, or mend a lost sample"
        raise refuse(str(path), role, rule, got, remedy)


def _check_rate(path: Path, rows: Mapping[str, np.ndarray], role: str, source: str, order: int, rate: float) -> float:
    """The offset between both, behind a low-pass that holds the motion and at which the noise of the differentiated one
    is a tenth of it, if it can be; without their means they must be alike."""
    holding = _HOLDS * smoothing.holding(rows[source], rate, 0.99, 1)
    highest = min(max(holding, _LEAST_PERIODS * rate / len(rows[source])), smoothing.WIDEST * rate)
    cutoff = smoothing.quiet(rows[source], rate, highest, order)
    part = slice(smoothing.margin(cutoff, rate), -smoothing.margin(cutoff, rate))
    row, other = (smoothing.smoothed(rows[r], cutoff, rate, n)[part] for r, n in ((role, 0), (source, order)))
    if times := _times(row - row.mean(), other - other.mean()):
        rule, got = f"the {'rate' if order == 1 else 'second derivative'} of {source!r}", f"{times:.3g} times that"
        raise refuse(str(path), role, rule, got, "correct its unit or give it a factor in channels")
    offset = _offset(row - other, smoothing.margin(cutoff, rate))
    return offset if abs(offset) > _SLIGHT * float(np.std(row)) else 0.0


def _offset(difference: np.ndarray, reach: int) -> float:
    """Mean of a difference (n,) whose samples are related over a `reach`; 0 where that is no more than stretches of it
    vary (Student's t)."""
    from scipy.stats import t

    least, most = _STRETCHES
    count = min(most, len(difference) // reach)
    if count < least:
        return 0.0
    stretches = [float(part.mean()) for part in np.array_split(difference, count)]
    mean, spread = float(np.mean(stretches)), float(np.std(stretches, ddof=1)) / np.sqrt(count)
    return mean if 2.0 * t.sf(abs(mean) / max(spread, 1e-300), count - 1) < _CHANCE else 0.0


def _check_load(path: Path, rows: Mapping[str, np.ndarray]) -> None:
    """Refuse a load's position that is not on the drive's side of the gear."""
    if times := _times(*(rows[role] - rows[role].mean() for role in (LOAD[0], "q"))):
        remedy = f"give it the gear's ratio as factor in channels, about {1.0 / times:.3g}, or correct its unit"
        raise refuse(str(path), LOAD[0], "the position 'q' but for a deflection", f"{times:.3g} times that", remedy)


def _times(row: np.ndarray, other: np.ndarray) -> float:
    """How many times another row one is; 0 where they agree, or have little to do with each other."""
    both, own = float(row @ other), float(other @ other)
    like = both / max(np.sqrt(own * float(row @ row)), 1e-300)
    return both / own if abs(like) > _LIKE and not _AGREES[0] <= both / own <= _AGREES[1] else 0.0
