"""New healthy records of a machine that has a twin: has it moved since, and what is kept of what was found before?"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from discrepancy.indexer.parameters import read
from indexer_env.machine import Machine
from twin.calibrate import Calibrated, Finding

_CHANCE = 0.01
"""Probability of so large a change, were it chance, below which the machine has moved."""

_NAMED = 2.0
"""Standard deviations of a change from which on a parameter is named."""


def as_before(found: Calibrated, before: Mapping[str, Any]) -> Calibrated:
    """The calibration with the effects that were found before and are part of the machine now."""
    new = {finding.effect for finding in found.findings}
    kept = tuple(
        Finding(r["effect"], r["grade"], r["values"], tuple(r["interval"]), r["size"], tuple(r["rivals"]))
        for r in before["findings"]
        if r["effect"] not in new
    )
    return dataclasses.replace(found, findings=(*kept, *found.findings))


def moved_since(before: Mapping[str, Any], machine: Machine, found: Calibrated) -> dict[str, Any]:
    """Whether the machine has moved: `since`, `sentence`, and each parameter's change in standard deviations of the
    posterior before, χ² of all together.

    Parameters
    ----------
    before : mapping
        Calibration of the twin before.
    machine : Machine
        Its machine, from which the new fit began.
    found : Calibrated
        The new calibration.
    """
    from scipy.stats import chi2

    changes = {
        name: math.log(read(found.machine, name) / read(machine, name)) / spread
        for name, spread in before["spread"].items()
        if read(machine, name) > 0.0
    }
    known = {row["effect"] for row in before["findings"]}
    new = [finding.effect for finding in found.findings if finding.effect not in known]
    chance = float(chi2.sf(sum(change**2 for change in changes.values()), max(1, len(changes))))
    far = sorted((name for name in changes if abs(changes[name]) > _NAMED), key=lambda name: -abs(changes[name]))
    since = bool(new) or chance < _CHANCE
    if new:
        sentence = f"The machine has moved since: {' and '.join(new)} came in; if nobody changed it, diagnose it."
    elif since:
        percent = ", ".join(
            f"{name} {100.0 * (math.exp(changes[name] * before['spread'][name]) - 1.0):+.1f} %" for name in far[:3]
        )
        sentence = f"The machine has moved since: {percent or 'many parameters a little'}."
    else:
        sentence = "The machine has not moved since; the networks are kept."
    return {"since": since, "sentence": sentence, "chance": chance, "changes": changes}
