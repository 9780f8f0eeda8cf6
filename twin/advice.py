"""What to record next, and why: rules on what the healthy records left open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from discrepancy.indexer.library import HOUSING
from indexer_cli.words import joined
from twin.card import span
from twin.faults import FAULTS
from twin.gate import OUTSIDE
from twin.quantities import spread_of, words_of

_HOUSING = f"machine.{HOUSING}"

_SCALE = 0.02
"""Relative spread of the common scale above which a load would tell more."""

_OPEN = 0.05
"""Relative spread of a parameter, beside the common scale, above which it is named as hardly known."""

_FEW = 3
"""Turns held out below which the check proves little."""


def advice(about: Mapping[str, Any]) -> list[str]:
    """Sentences, the one that helps most first."""
    speeds, loads = about["range"]["motor_speed_rpm"], about["range"]["load_torque"]
    recorded = [rpm for rpm, _ in about["recorded"]]
    if "moved" in about["calibration"]:
        recorded += speeds  # those of the twin that was brought up to date
    found = beforehand(recorded, speeds)
    if "moved" not in about["calibration"]:
        found += beyond(about["recorded"], speeds, loads)
    if about["calibration"]["scale_spread"] > _SCALE:
        share = 196.0 * about["calibration"]["scale_spread"]
        heaviest = max(abs(load) for load in loads)
        found.append(
            f"All inertias, stiffnesses and torques are known to ±{share:.1f} % (95 %) in common, as healthy motion "
            f"hardly shows their scale. Loads that are known better, and one larger than {heaviest:g} N m, would tell "
            "it: record them, state how well they are known (load_uncertainty=0.02) and make the twin anew. Sizes in "
            "N m carry this error, and so does how loose the base is."
        )
    if about["calibration"]["start_compared"]:
        found.append(
            "Record a once-per-turn pulse: the cam angle was found by comparison, so stations cannot be told apart and "
            "what shifts the motion is hardly seen."
        )
    loose = [name for name, spread in about["calibration"]["spread"].items() if spread > _OPEN]
    if loose:
        said = ", ".join(map(words_of, loose))
        found.append(f"Hardly known: {said}; longer records, or more speeds, would tell more.")
    table = about["settings"]["faults"]
    pooled = [name for name, shared in zip(table, about["weights"]["pooled"], strict=True) if shared]
    if pooled:
        found.append(
            f"Too few simulated turns name {joined([FAULTS[name].words for name in pooled])}: intervals of these sizes "
            "are those of all faults together; more turns (simulated=) would tell their own."
        )
    if len(about["check"]["turns"]) < _FEW:
        found.append("Hold out another healthy record: few turns prove little about false alarms.")
    if speeds[0] != speeds[1] or loads[0] != loads[1]:
        best = _best(about)
        if best is not None:
            found.append(best)
    found.append(
        "The housing's inertia and its base take no part in healthy motion; they are known as the drawing has them, to "
        f"{next(spread_of(row) for row in about['calibration']['parameters'] if row['path'] == _HOUSING)} (95 %)."
    )
    return found


def beforehand(recorded: Sequence[float], diagnosed: Sequence[float]) -> list[str]:
    """Sentences on records at these motor speeds [rpm], of a twin that will diagnose from the lowest to the highest of
    others, that can be said before it is made."""
    if not _one(recorded):
        return []
    alone = ", and the twin diagnoses at this speed alone" if _one(diagnosed) else ""
    return [f"Record at a second speed, 10 % or more from the first: at one speed effects mimic each other{alone}."]


def beyond(recorded: Sequence[Sequence[float]], speeds: Sequence[float], loads: Sequence[float]) -> list[str]:
    """A sentence where the range of the diagnosis, motor speeds [rpm] and loads [N m], goes beyond what was recorded, a
    speed and a load each."""
    seen = np.array(recorded)
    wider = [
        f"{low:.4g} to {high:.4g} {unit}"
        for (low, high), column, unit in ((speeds, seen[:, 0], "rpm"), (loads, seen[:, 1], "N m"))
        if max(column.min() - low, high - column.max()) > OUTSIDE * max(abs(low), abs(high))
    ]
    if not wider:
        return []
    return [
        f"The twin diagnoses {joined(wider)}, which is more than was recorded: beyond the healthy records nothing has "
        "checked it, and their noise is taken to go on as it is; record there, too."
    ]


def _one(speeds: Sequence[float]) -> bool:
    slowest, fastest = span(speeds)
    return slowest == fastest


def _best(about: Mapping[str, Any]) -> str | None:
    """The operating point at which most faults are seen best."""
    best: dict[tuple[float, float], int] = {}
    table = about["settings"]["faults"]
    for fault in table:
        rows = [row for row in about["detection"] if row["fault"] == fault and row["size"] is not None]
        if rows:
            row = min(rows, key=lambda one: one["size"])
            point = row["motor_speed_rpm"], row["load_torque"]
            best[point] = best.get(point, 0) + 1
    if not best:
        return None
    (rpm, load), count = max(best.items(), key=lambda item: item[1])
    where = f"{rpm:.0f} rpm and {load:g} N m"
    return f"Diagnose at {where} where you may choose: there {count} of {len(table)} faults show best."
