"""Pictures of report.html, as SVG text."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from classifier.style import COLOURS, DARK, GREY, style
from twin.faults import FAULTS
from twin.remains import Remains


def detection(rows: Sequence[Mapping[str, Any]], faults: Sequence[str]) -> str:
    """Smallest sizes that are seen, as share of the largest, at each operating point."""
    points = list(dict.fromkeys((row["motor_speed_rpm"], row["load_torque"]) for row in rows))
    with style():
        figure = Figure(figsize=(7.6, 0.36 * len(faults) + 1.3), layout="constrained")
        axes = figure.subplots()
        for number, (rpm, load) in enumerate(points):
            mine = {
                row["fault"]: row["size"] for row in rows if (row["motor_speed_rpm"], row["load_torque"]) == (rpm, load)
            }
            size = [100.0 * mine[fault] if mine.get(fault) else math.nan for fault in faults]
            place = np.arange(len(faults)) + 0.12 * (number - 0.5 * (len(points) - 1))
            label = f"{rpm:.0f} rpm, {load:g} N m"
            axes.plot(size, place, "o", ms=5, color=COLOURS[number % len(COLOURS)], label=label)
        axes.set_yticks(range(len(faults)), [FAULTS[fault].words for fault in faults])
        axes.set_xscale("log")
        axes.set_xlim(0.25, 130.0)
        axes.set_xticks([0.3, 1, 3, 10, 30, 100], ["0.3", "1", "3", "10", "30", "100"])
        axes.axvline(100.0, color=GREY)
        axes.invert_yaxis()
        axes.set_xlabel("smallest size that is seen [% of the largest]")
        axes.legend(loc="upper center", bbox_to_anchor=(0.4, 1.0 + 0.9 / (len(faults) + 1)), ncols=3, fontsize=8)
    return _svg(figure)


def remains(left: Remains) -> str:
    """What healthy records leave in the mean over the stations, over the noise of each."""
    with style():
        figure = Figure(figsize=(7.6, 2.2), layout="constrained")
        axes = figure.subplots()
        phase = np.linspace(0.0, 360.0, left.fixed.shape[2], endpoint=False)
        means = left.fixed.mean(axis=1) / left.sigmas[:, None]
        for number, (mean, (speed, load)) in enumerate(zip(means, left.points, strict=True)):
            label = f"{speed * 30.0 / math.pi:.0f} rpm, {load:g} N m"
            axes.plot(phase, mean, color=COLOURS[number % len(COLOURS)], label=label)
        axes.axhspan(-1.0, 1.0, color=GREY, alpha=0.4, lw=0)
        axes.set_ylim(*(max(2.0, 1.1 * float(np.abs(means).max())) * np.array([-1, 1])))
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(range(0, 361, 60))
        axes.set_xlabel("cam angle [°]")
        axes.set_ylabel("left over noise")
        axes.text(355.0, -0.95, "noise", color=DARK, ha="right", va="bottom", fontsize=8)
        axes.legend(loc="upper right", ncols=3, fontsize=8)
    return _svg(figure)


def _svg(figure: Figure) -> str:
    """A figure as SVG that flows with the page."""
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "twin"}), io.StringIO() as file:
        figure.savefig(file, format="svg", metadata={"Date": None})
        text = file.getvalue()
    return text[text.index("<svg") :]
