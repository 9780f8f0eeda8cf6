"""New healthy records of a machine that has a twin: has it moved since, and what is kept of what was found before?"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

from discrepancy.grades import NAMED
from discrepancy.indexer.parameters import read
from indexer_env.machine import Machine
from twin.calibrate import SD_OF_95, Calibrated, Finding
from twin.gate import OUTSIDE

_CHANCE = 0.01
"""Probability of so large a change, were it chance, below which the machine has moved."""

_AT_BOUND = 2.99
"""Standard deviations of a single change from which on the machine has moved: a fit keeps each parameter within three
of what it was, so that a parameter there may have gone further."""

_MORE = 1.5
"""Times what the twin before left above which clearly more is left: what a fit cannot follow shows there."""

_ALIKE = 0.1
"""Relative difference of noise, and of the pulse's accuracy, up to which thresholds taken from simulated turns hold."""

_STILL = "The machine has not moved since"

_NAMED = 2.0
"""Standard deviations of a change from which on a parameter is named."""


def as_before(found: Calibrated, before: Mapping[str, Any]) -> Calibrated:
    """The calibration with what was found before, under its own grade: with today's values where it was fitted anew,
    with those of then where it is part of the sensor."""
    rows = {row["effect"]: row for row in before["findings"]}
    new = {finding.effect for finding in found.findings}
    kept = tuple(
        Finding(r["effect"], r["grade"], r["values"], tuple(r["interval"]), r["size"], tuple(r["rivals"]))
        for name, r in rows.items()
        if name not in new
    )
    again = (
        dataclasses.replace(f, grade=rows[f.effect]["grade"], rivals=tuple(rows[f.effect]["rivals"]))
        if f.effect in rows
        else f
        for f in found.findings
    )
    return dataclasses.replace(found, findings=(*kept, *again))


def moved_since(before: Mapping[str, Any], machine: Machine, found: Calibrated, noisier: float = 1.0) -> dict[str, Any]:
    """Whether the machine has moved: `since`, `sentence`, and the change of each parameter in standard deviations of
    the posterior before, of each effect's size in those of both estimates, χ² of all together.

    Parameters
    ----------
    before : mapping
        Calibration of the twin before.
    machine : Machine
        Its machine, from which the new fit began.
    found : Calibrated
        The new calibration alone: what was kept of the one before has not changed.
    noisier : float
        Noise of the new records over that of those before.
    """
    from scipy.stats import chi2

    changes, told = {}, {}
    for name, spread in before["spread"].items():
        if read(machine, name) > 0.0:
            by = math.log(read(found.machine, name) / read(machine, name))
            changes[name], told[name] = by / spread, f"{name} {100.0 * math.expm1(by):+.1f} %"
    known = {row["effect"]: row for row in before["findings"]}
    for finding in found.findings:
        row = known.get(finding.effect)
        if row is not None:
            name = f"{finding.effect}.{finding.size}"
            now, then = finding.values[finding.size], row["values"][finding.size]
            # two independent estimates
            width = math.hypot(*(high - low for low, high in (row["interval"], finding.interval)))
            changes[name] = SD_OF_95 * (now - then) / max(width, 1e-300)
            told[name] = f"{name} from {then:.3g} to {now:.3g}"
    new = [finding.effect for finding in found.findings if finding.effect not in known and finding.grade in NAMED]
    chance = float(chi2.sf(sum(change**2 for change in changes.values()), max(1, len(changes))))
    far = sorted((name for name in changes if abs(changes[name]) > _NAMED), key=lambda name: -abs(changes[name]))
    at_bound = any(abs(change) >= _AT_BOUND for change in changes.values())
    left = math.sqrt(1.0 + max(0.0, before["level"] ** 2 - 1.0) / noisier**2)
    more = found.level > _MORE * left
    since = bool(new) or chance < _CHANCE or at_bound or more
    if new:
        sentence = f"The machine has moved since: {' and '.join(new)} came in; if nobody changed it, diagnose it."
    elif since:
        said = [told[name] for name in far[:3]]
        if more:
            said.append(f"{found.level:.1f} times the noise remains of the new records, {left:.1f} before")
        sentence = f"The machine has moved since: {', '.join(said) or 'many parameters a little'}."
    else:
        sentence = f"{_STILL}."
    return {"since": since, "sentence": sentence, "chance": chance, "changes": changes}


def gone_on(
    before: Mapping[str, Any], about: Mapping[str, Any], moved: Mapping[str, Any]
) -> tuple[dict[str, Any], bool]:
    """A new calibration with how the machine has moved since the twin before, and whether that twin's networks are
    kept: what they were taught on must hold for the new records, too. With them the range is kept."""
    if moved["since"]:
        return {**about, "moved": moved}, False
    other = _differing(before, about)
    end = f"{' and '.join(other)} differ{'s' * (len(other) == 1)}, so all is learned anew" if other else ""
    sentence = f"{_STILL}; {end or 'the networks are kept'}."
    told = {**about, "moved": {**moved, "sentence": sentence}}
    return told if other else {**told, "range": before["range"]}, not other


def _differing(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    # what the networks were taught with, however often the twin was brought up to date since
    said, then = [], before["taught"]
    if before["cells"] != now["cells"]:
        said.append("the sampling rate")
    if then["radius"] != now["radius"]:
        said.append("the sensor's distance from the axis")
    if any(not _within(now["range"][name], before["range"][name]) for name in now["range"]):
        said.append("the range of speeds and loads")
    words = {"noise": "the noise", "shift": "the accuracy of the cam angle"}
    return said + [w for name, w in words.items() if abs(now[name] - then[name]) > _ALIKE * then[name]]


def _within(now: Sequence[float], before: Sequence[float]) -> bool:
    slack = OUTSIDE * 0.5 * max(abs(before[0] + before[1]), before[1] - before[0])
    return before[0] - slack <= now[0] and now[1] <= before[1] + slack
