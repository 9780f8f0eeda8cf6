"""The report's figures as SVG texts, in one style, the same bytes for the same outcome."""

from __future__ import annotations

import io
import logging
import re
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from discrepancy.chain import Outcome
from discrepancy.locate import Map, Spot, Where
from discrepancy.locate.statistics import CHANNEL
from discrepancy.problem import Problem
from discrepancy.subjects.base import binned

# Okabe and Ito's colours, told apart by colour-blind readers too.
MEASURED, BEFORE, AFTER = "0.2", "#D55E00", "#0072B2"
_STYLE: Any = {
    "font.size": 9, "axes.titlesize": 9, "axes.titlelocation": "left", "axes.grid": True, "grid.color": "0.92",
    "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
    "lines.linewidth": 1.1, "svg.fonttype": "none", "svg.hashsalt": "report", "font.family": "sans-serif",
}  # fmt: skip
_WIDTH = 9.6
_MOST_POINTS = 1600
"""Points of a curve beyond which it is thinned: a screen shows no more."""

_CELLS = 72
"""Cells over which a missing torque is averaged: 5° of a cam turn each."""

_log = logging.getLogger(__name__)


def figures(outcome: Outcome) -> dict[str, str]:
    """SVG by name: torque, records, maps, levels; "" for one that there is nothing to draw of. One that fails is left
    out and told in the log: the page must not depend on it."""
    makers = {"torque": missing_torque, "records": _records, "maps": _maps, "levels": _levels}
    drawn = {}
    with matplotlib.rc_context(_STYLE):
        for name, make in makers.items():
            try:
                figure = make(outcome)
                drawn[name] = "" if figure is None else _svg(figure)
            except Exception:
                _log.exception("the figure %s cannot be drawn", name)
                drawn[name] = ""
    return drawn


def _svg(figure: Figure) -> str:
    file = io.StringIO()
    layout = figure.get_layout_engine()
    if layout is not None:
        # done here and once: savefig would draw all of a figure that still has a layout to be done one time more
        FigureCanvasSVG(figure)
        layout.execute(figure)
        figure.set_layout_engine("none")
    figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    text = file.getvalue()
    # Inside a page neither the XML head nor a fixed size in points has a place.
    text = text[text.index("<svg") :]
    return re.sub(r'width="[\d.]+pt" height="[\d.]+pt" ', "", text, count=1)


def _records(outcome: Outcome) -> Figure:
    """The cam turn held out on which the base model is worst: both models beside the record, and what each leaves; of
    several channels the first one, whose unit the view has."""
    answer = outcome.answer
    view = outcome.subject.view(answer.held_out)
    held = answer.held[answer.base.name]
    places = held, answer.held[answer.accepted.name]
    old, new = (Problem(answer.held_out, place.hypothesis).left(place) for place in places)
    window = int((held.squares / view.inside.sum(axis=1)).argmax())
    inside, noise = view.inside[window], float(view.noise[view.groups[window]])
    channel = ""
    for axis in view.axes:
        if axis.name == CHANNEL:
            inside, channel = axis.cells[window] == 0, f" ({axis.labels[0]})"
    every = max(1, int(inside.sum()) // _MOST_POINTS)
    time, measured = view.time[window, inside][::every], view.measured[window, inside][::every]
    left_old, left_new = (noise * r[window, inside][::every] for r in (old, new))
    figure = Figure(figsize=(_WIDTH, 4.6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    above.plot(time, measured, color=MEASURED, linewidth=2.2, alpha=0.45, label="measured")
    above.plot(time, measured + left_old, color=BEFORE, label="base model")
    below.axhspan(-2.0 * noise, 2.0 * noise, color="0.9", label="± 2 standard deviations of the noise")
    below.plot(time, left_old, color=BEFORE, label="base model")
    if outcome.extended:
        above.plot(time, measured + left_new, color=AFTER, label="with what was found")
        below.plot(time, left_new, color=AFTER, label="with what was found")
    above.set_title(
        f"{view.names[view.groups[window]]}, not fitted: the {view.window} on which the base model is worst{channel}",
        parse_math=False,
    )
    below.set_title("simulated - measured")
    below.set_xlabel("time since the first sample [s]")
    for ax in (above, below):
        ax.set_ylabel(f"[{view.unit.replace('^2', '²')}]")
    figure.legend(handles=[*above.lines, below.patches[0]], loc="outside upper right", ncols=4, fontsize=8)
    return figure


def missing_torque(outcome: Outcome) -> Figure | None:
    """What remains on the records fitted as the torque that the machine with what was found still lacks: in each cell
    its mean and, shaded, the spread between windows."""
    answer = outcome.answer
    view = outcome.subject.view(answer.model)
    if view.torque is None:
        return None
    noise = view.noise[view.groups][:, None]
    place = answer.accepted.place
    lacking = -view.torque.per_unit * noise * Problem(answer.model, place.hypothesis).left(place)
    figure = Figure(figsize=(_WIDTH, 2.5), layout="constrained")
    axes = figure.subplots(1, len(view.torque.over), sharey=True, squeeze=False)[0]
    for ax, (name, values) in zip(axes, view.torque.over.items(), strict=True):
        middle, mean, spread = averaged(values, lacking, view.inside)
        ax.fill_between(middle, mean - spread, mean + spread, color=AFTER, alpha=0.22, linewidth=0.0)
        ax.plot(middle, mean, color=AFTER)
        ax.axhline(0.0, color="0.4", linewidth=0.7)
        ax.set_xlabel(name)
    axes[0].set_ylabel(view.torque.name, fontsize=8)
    return figure


def averaged(values: np.ndarray, lacking: np.ndarray, inside: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles, means and spreads (k,) of `lacking` (w, n) in cells of `values` (w, n): each window's mean of a cell
    counts once, the spread is the standard deviation of these means."""
    edges = np.linspace(float(values[inside].min()), float(values[inside].max()), _CELLS + 1)
    windows = len(values)
    at = (np.arange(windows)[:, None] * _CELLS + binned(values, edges, inside))[inside]
    counts = np.bincount(at, minlength=windows * _CELLS).reshape(windows, _CELLS)
    sums = np.bincount(at, lacking[inside], minlength=windows * _CELLS).reshape(windows, _CELLS)
    held = counts > 0
    means = np.where(held, sums / np.maximum(counts, 1), 0.0)
    number = held.sum(axis=0)
    mean = means.sum(axis=0) / np.maximum(number, 1)
    spread = np.sqrt((held * (means - mean) ** 2).sum(axis=0) / np.maximum(number - 1, 1))
    there = number > 0
    return (0.5 * (edges[1:] + edges[:-1]))[there], mean[there], spread[there]


def _maps(outcome: Outcome) -> Figure | None:
    """Levels over both axes of the map, before and after, on one colour scale."""
    found = [("base model", outcome.where)]
    if outcome.extended:
        found.append(("with what was found", outcome.left))
    pictures = [(title, where) for title, where in found if where is not None]
    if not pictures:
        return None
    first = pictures[0][1].map
    highest = max(3.0, *(float(np.nanmax(where.map.levels)) for _, where in pictures))
    figure = Figure(figsize=(_WIDTH, max(1.9, 0.9 + 0.2 * len(first.upwards.labels))), layout="constrained")
    axes = figure.subplots(1, len(pictures), squeeze=False, sharey=True)[0]
    norm = LogNorm(0.9, highest)
    mesh = None
    for ax, (title, where) in zip(axes, pictures, strict=True):
        mesh = _map(ax, where.map, norm)
        ax.set_title(f"{title}: {where.level:.2f} times the noise")
    axes[0].set_ylabel(first.upwards.name)
    assert mesh is not None
    bar = figure.colorbar(mesh, ax=list(axes), label="rms over the noise", pad=0.01, aspect=14)
    ticks = [t for t in ((1, 2, 3, 5, 10) if highest < 20.0 else (1, 3, 10, 30, 100, 300, 1000)) if t <= highest]
    bar.set_ticks(ticks, labels=[f"{t:g}" for t in ticks])
    bar.minorticks_off()
    return figure


def _map(ax: Axes, picture: Map, norm: LogNorm):
    rows, columns = picture.levels.shape
    ax.grid(False)
    mesh = ax.pcolormesh(
        np.arange(columns + 1), np.arange(rows + 1) - 0.5, picture.levels, norm=norm, cmap="YlOrRd", edgecolors="white",
        linewidth=0.4,
    )  # fmt: skip
    up, across = np.nonzero(picture.significant)
    ax.plot(across + 0.5, up, ".", color="black", markersize=2.5)
    every = max(1, columns // 6)
    ax.set_xticks(np.arange(0, columns, every) + 0.5, [_tick(label) for label in picture.across.labels[::every]])
    ax.set_yticks(np.arange(rows), picture.upwards.labels)
    ax.set_xlabel(_titled(picture.across.name, picture.across.labels))
    return mesh


def _levels(outcome: Outcome) -> Figure | None:
    """Level of each cell of each axis, before and after; lines in a panel of their own."""
    where, left = outcome.where, outcome.left if outcome.extended else None
    if where is None:
        return None
    names = list(dict.fromkeys(cell.axis for cell in where.cells))
    columns = 2
    panels = len(names) + bool(where.spots)
    rows = -(-panels // columns)
    figure = Figure(figsize=(_WIDTH, 1.9 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).flatten()
    for ax, name in zip(axes, names, strict=False):
        _bars(ax, name, _cells(where, name), None if left is None else _cells(left, name))
    if where.spots:
        _lines(axes[len(names)], where.spots, () if left is None else left.spots)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=4, fontsize=8)
    figure.suptitle("rms over the noise", fontsize=9, x=0.01, ha="left")
    for unused in axes[panels:]:
        unused.remove()
    return figure


def _cells(where: Where, axis: str):
    return [cell for cell in where.cells if cell.axis == axis]


def _bars(ax: Axes, name: str, before: Sequence[Any], after: Sequence[Any] | None) -> None:
    at = np.arange(len(before))
    width = 0.42 if after else 0.8
    left = at - width / 2 if after else at
    ax.bar(left, [c.level for c in before], width, color=BEFORE, label="base model")
    if after:
        ax.bar(at + width / 2, [c.level for c in after], width, color=AFTER, label="with what was found")
    expected = [c.expected for c in before]
    ax.hlines(expected, at - 0.42, at + 0.42, color="black", linewidth=0.8, label="expected of noise")
    logarithmic = max(c.level for c in before) > 8.0
    marks = [k for k, c in enumerate(before) if c.significant]
    above = [before[k].level * (1.3 if logarithmic else 1.05) for k in marks]
    ax.plot(left[marks], above, "*", color="black", markersize=4, label="beyond chance")
    every = max(1, len(before) // 8)
    ax.set_xticks(at[::every], [_tick(c.label) for c in before[::every]])
    ax.set_title(_titled(name, [c.label for c in before]))
    ax.set_yscale("log" if logarithmic else "linear")


def _tick(label: str) -> str:
    """A label without its unit, which stands in the title."""
    number, unit = _parted(label)
    return number if unit else label


def _parted(label: str) -> tuple[str, str]:
    """A number and its unit; the label and nothing where it does not begin with a number."""
    number, _, unit = label.partition(" ")
    try:
        float(number)
    except ValueError:
        return label, ""
    return number, unit


def _titled(name: str, labels: Sequence[str]) -> str:
    unit = _parted(labels[0])[1]
    return f"{name} [{unit}]" if unit else name


def _lines(ax: Axes, spots: Sequence[Spot], after: Sequence[Spot]) -> None:
    at = np.arange(len(spots))
    floor = [max(s.prominence, 0.5) for s in spots]
    ax.plot(at, floor, "o", color=BEFORE, markersize=4)
    left = {s.name: s for s in after}
    both = [(k, max(left[s.name].prominence, 0.5)) for k, s in enumerate(spots) if s.name in left]
    ax.plot([k for k, _ in both], [p for _, p in both], "o", color=AFTER, markersize=3)
    for k, spot in enumerate(spots):
        if spot.significant:
            ax.plot(k, floor[k] * 1.6, "*", color="black", markersize=4)
    ax.axhline(1.0, color="0.5", linewidth=0.7)
    ax.set_yscale("log")
    ax.set_xticks(at, [_short(s.name) for s in spots], rotation=90, fontsize=6.5)
    ax.set_title("lines: power over its surroundings")


def _short(name: str) -> str:
    return name.removeprefix("order ").replace(" of the ", "× ").replace("motor shaft", "motor")
