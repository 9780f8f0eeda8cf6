"""Pictures that several studies share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from classifier.results import Row, means
from classifier.style import COLOURS, GREY, style


def dots(rows: Sequence[Row], metric: str) -> Figure:
    """A panel for each data set, a line for each method: the mean with its interval, and every seed behind it."""
    found = {key: value for key, value in means(rows).items() if key[2] == metric}
    data, methods = (list(dict.fromkeys(key[place] for key in found)) for place in (0, 1))
    with style():
        figure = Figure(figsize=(2 + 2.4 * len(data), 1.0 + 0.3 * len(methods)), layout="constrained")
        axes = figure.subplots(1, len(data), sharey=True, squeeze=False)[0]
        for ax, name in zip(axes, data, strict=True):
            for line, method in enumerate(methods):
                key = (name, method, metric)
                if key not in found:
                    continue
                seeds = [row.value for row in rows if (row.data, row.method, row.metric) == key]
                ax.plot(seeds, np.full(len(seeds), line), ".", color=GREY, markersize=4)
                value, low, high, _ = found[key]
                ax.plot([low, high], [line, line], color=COLOURS[0], linewidth=2)
                ax.plot(value, line, "o", color=COLOURS[0])
            ax.set(title=name, xlabel=metric)
            ax.set_yticks(range(len(methods)), methods)
            ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
        axes[0].invert_yaxis()
    return figure


def matrix(rows: Sequence[Row], metrics: Sequence[str]) -> Figure:
    """A table of means in colours, from 0 to 100: a line for each data set, a column for each method and metric."""
    found = {key: value.value for key, value in means(rows).items() if key[2] in metrics}
    data = list(dict.fromkeys(key[0] for key in found))
    columns = list(dict.fromkeys(key[1:] for key in found))
    values = np.array([[found.get((name, *column), np.nan) for column in columns] for name in data])
    with style():
        figure = Figure(figsize=(3 + 0.9 * len(columns), 1.5 + 0.26 * len(data)), layout="constrained")
        ax = figure.subplots()
        ax.imshow(values, cmap="Blues", vmin=0, vmax=100, aspect="auto")
        for (line, column), value in np.ndenumerate(values):
            if np.isfinite(value):
                colour = "white" if value > 60 else "black"
                ax.text(column, line, f"{value:.1f}", ha="center", va="center", color=colour, fontsize=8)
        ax.set_yticks(range(len(data)), data)
        ax.set_xticks(
            range(len(columns)), [f"{method}\n{metric}" for method, metric in columns], rotation=30, ha="right"
        )
        ax.grid(visible=False)
    return figure
