"""Table and picture of what learned and other controllers reach: throughput against vibration in the dwell."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from examples.dwell_vibration import Policy, Score, constant, profile, score

FOLDER = Path(__file__).parent.parent / "docs" / "reference" / "environments"

FAULTS: dict[str, dict[str, Any]] = {
    "healthy": {},
    "10° of play": {"backlash_deg": 10.0},
    "20° of play": {"backlash_deg": 20.0},
    "cracked rollers": {"roller_crack": 0.4},
    "loose screws": {"screw_looseness": 1.0},
}
"""What is measured on; of these only play up to 15° is trained on."""

SEEDS = (1_000_000, 1_001_000, 1_002_000, 1_003_000, 1_004_000)
"""Of the machines that are measured on; no training has them."""

SHARES = tuple(np.round(np.arange(0.3, 1.001, 0.05), 3).tolist())
"""Constant speeds of the curve [share of nominal]."""


def measure(policies: Mapping[int, Policy], numbers: np.ndarray) -> dict[str, Any]:
    """Scores of learned policies, by their training seeds, of the profile with these numbers, and of constant speeds,
    on each of FAULTS, as plain numbers."""
    results: dict[str, Any] = {"profile": numbers.tolist(), "seeds": list(SEEDS), "faults": {}}
    for name, faults in FAULTS.items():
        curve = {share: score(constant(share), faults, SEEDS) for share in SHARES}
        learned = {seed: score(policy, faults, SEEDS) for seed, policy in policies.items()}
        results["faults"][name] = {
            "curve": [[share, *_span(found.vibration)] for share, found in curve.items()],
            "profile": _plain(score(profile(numbers), faults, SEEDS)),
            "ppo": {
                str(seed): _plain(found) | _rival(float(found.throughput.mean()), faults, curve)
                for seed, found in learned.items()
            },
        }
    return results


def _rival(throughput: float, faults: Mapping[str, Any], curve: Mapping[float, Score]) -> dict[str, Any]:
    """The quietest constant speed that gets as much done: just as fast, or a faster one of the curve."""
    just_as_fast = {throughput: score(constant(throughput), faults, SEEDS)} if throughput <= 1.0 else {}
    able = just_as_fast | {share: found for share, found in curve.items() if share > throughput}
    share = min(able, key=lambda share: float(able[share].vibration.mean()))
    return {"rival_share": share, "rival_vibration": able[share].vibration.tolist()}


def _plain(found: Score) -> dict[str, list[float]]:
    return {"throughput": found.throughput.tolist(), "vibration": found.vibration.tolist()}


def _span(values: Any) -> tuple[float, float, float]:
    """Mean, lowest and highest."""
    return float(np.mean(values)), float(np.min(values)), float(np.max(values))


def table(results: Mapping[str, Any]) -> str:
    """Markdown: for each fault the mean, and in brackets the lowest and the highest, over all seeds."""
    lines = [
        "| machines with | throughput of PPO | its vibration | constant speed, as fast or faster | that over PPO's | "
        "profile: throughput, vibration |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, found in results["faults"].items():
        learned = found["ppo"].values()
        vibration = [one["vibration"] for one in learned]
        rival = [one["rival_vibration"] for one in learned]
        cells = [
            name,
            _bracketed([one["throughput"] for one in learned], 3),
            _bracketed(vibration, 2),
            _bracketed(rival, 2),
            _bracketed(np.divide(rival, vibration), 1),
            f"{np.mean(found['profile']['throughput']):.3f}, {np.mean(found['profile']['vibration']):.2f}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _bracketed(values: Any, digits: int) -> str:
    mean, low, high = _span(values)
    return f"{mean:.{digits}f} ({low:.{digits}f} … {high:.{digits}f})"


def write(results: Mapping[str, Any], folder: Path) -> None:
    """Write learning.json and learning.png."""
    (folder / "learning.json").write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    picture(results, folder / "learning.png")


def picture(results: Mapping[str, Any], path: Path) -> None:
    """Vibration over throughput, one panel for each fault: the curve of constant speeds, the profile, the policies."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(results["faults"]), sharey=True)
    for panel, (name, found) in zip(panels, results["faults"].items(), strict=True):
        shares, means, lows, highs = np.transpose(found["curve"])
        panel.plot(shares, means, color="0.4", label="constant speed")
        panel.fill_between(shares, lows, highs, color="0.85")
        means = [float(np.mean(found["profile"][key])) for key in ("throughput", "vibration")]
        panel.plot(*means, "D", color="C1", label="profile of the cam's phase")
        for place, one in enumerate(found["ppo"].values()):
            label = "PPO, a point for each training seed" if place == 0 else None
            panel.plot(np.mean(one["throughput"]), np.mean(one["vibration"]), "o", color="C0", label=label)
        panel.set(title=name, xlabel="throughput [share of nominal]", yscale="log")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("rms acceleration in the dwell [rad/s²]")
    panels[2].legend(fontsize=7, loc="lower left")
    figure.savefig(path, dpi=110)
