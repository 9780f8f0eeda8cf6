"""The table of docs/reference/environments/indexer.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "environments" / "indexer.md"
RESULTS = Path(__file__).parent / "results.json"


def table(results: dict[str, Any]) -> str:
    """Markdown, from what the results file holds."""
    constant, random = results["constant"], results["random"]
    lines = [
        "| control | return | steps | processor time of a training |",
        "| --- | --- | --- | --- |",
        f"| random | {_said(random['returns'])} | | |",
        f"| best constant speed: {constant['share']:g} of nominal | {_said(constant['returns'])} | | |",
    ]
    for script in dict.fromkeys(run["script"] for run in results["trainings"]):
        runs = [run for run in results["trainings"] if run["script"] == script]
        ends = [run["curve"][-1] for run in runs]
        lines.append(
            f"| PPO, {script}, {len(runs)} seeds | {_said([mean for _, mean, _, _ in ends])} | {ends[0][0]} | "
            f"{np.mean([seconds for *_, seconds in ends]):.0f} s |"
        )
    return "\n".join(lines)


def _said(values: list[float]) -> str:
    """Mean ± sample standard deviation (over n − 1), and the lowest and the highest."""
    return f"{np.mean(values):.0f} ± {np.std(values, ddof=1):.0f} ({min(values):.0f} … {max(values):.0f})"
