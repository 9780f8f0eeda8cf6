"""Machines run to failure: which alarm comes, when, and whether the interval of the remaining time holds the truth.

`campaign=wear`: machines ±10 %, play growing from 0–1° to 20° by a law that is drawn for each. A right alarm is one of
the play; in time is before the end of life.
"""

from __future__ import annotations

import argparse
import json

import numpy as np

from benchmarks.monitor.machines import block, data_set, lives, model, plan
from monitor.intake.blocks import NANO
from monitor.pipeline import Pipeline
from monitor.plan import CHANGE

TURN_S = 8.2


def measure(machines: int, records: int, seed: int) -> dict[str, float]:
    """Run the lives through the pipeline."""
    folder = data_set(
        f"wear-{machines}-{records}-{seed}", "campaign=wear", "sensor=bench", "machine.model=B_on_base",
        f"campaign.lives={machines}", f"campaign.records_per_life={records}", f"seed={seed}",
    )  # fmt: skip
    diagnoser, settings = model(), plan()
    right = early = wrong = unknown = 0
    inside: list[bool] = []
    parts: list[tuple[float, bool]] = []
    share_at_alert, widths = [], []
    for number, (accelerations, left, _) in enumerate(lives(folder)):
        pipeline, first = Pipeline(f"machine {number}", diagnoser, settings), {}
        for record, rest in zip(accelerations, left, strict=True):
            start = (left[0] - rest) * TURN_S
            outcome = pipeline.take(block(pipeline.machine, record, start))
            assert outcome is not None and len(outcome.turns) == 1
            for event in outcome.events:
                first.setdefault(event.quantity, (event.time_ns / NANO, event.level))
            told = outcome.turns[0].remaining.get("backlash_deg")
            if told is not None and rest > 0 and pipeline.conditions["backlash_deg"].active:
                true = rest * TURN_S
                inside.append(told.low <= true <= told.high)
                parts.append((1.0 - rest / left[0], inside[-1]))
                widths.append((min(told.high, 10 * true) - told.low) / true)
        end = left[0] * TURN_S
        others = [name for name in first if name not in ("backlash_deg", CHANGE)]
        right += "backlash_deg" in first
        early += "backlash_deg" in first and first["backlash_deg"][0] < end
        wrong += bool(others)
        unknown += CHANGE in first and first[CHANGE][0] < first.get("backlash_deg", (np.inf,))[0]
        if "backlash_deg" in first:
            share_at_alert.append(first["backlash_deg"][0] / end)
    by_part = {
        f"held_{low:.1f}": float(np.mean([held for share, held in parts if low <= share < low + 0.2]))
        for low in (0.2, 0.4, 0.6, 0.8)
        if any(low <= share < low + 0.2 for share, _ in parts)
    }
    return {
        "machines": machines,
        "records": records,
        "right_percent": 100.0 * right / machines,
        "in_time_percent": 100.0 * early / machines,
        "wrong_percent": 100.0 * wrong / machines,
        "change_first_percent": 100.0 * unknown / machines,
        "alert_at_share_of_life": float(np.median(share_at_alert)) if share_at_alert else float("nan"),
        "interval_holds_percent": 100.0 * float(np.mean(inside)),
        "intervals": len(inside),
        "median_width_over_truth": float(np.median(widths)),
        **by_part,
    }


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks.monitor wear")
    parser.add_argument("--machines", type=int, default=50)
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--seed", type=int, default=11)
    given = parser.parse_args(arguments)
    print(json.dumps(measure(given.machines, given.records, given.seed), indent=1))
