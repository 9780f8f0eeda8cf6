"""The turns of a diagnosis: the spectrum of each over that of the others, and what is left of the budget."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from indexer_env.diagnosis import BAND_HZ, BANDS, LEVELS
from indexer_env.diagnosis_task import Setting
from indexer_env.render.canvas import Canvas
from indexer_env.render.layout import Box
from indexer_env.render.palette import (
    BORDER,
    CONTACT,
    CRACK,
    GRID,
    INK,
    LOOSE,
    MARK,
    MOTION,
    PAGE,
    PANEL,
    QUIET,
    REAL,
    STEEL_DARK,
    THEORY,
    Colour,
)  # fmt: skip

_COLOURS: tuple[Colour, ...] = (THEORY, REAL, MARK, CRACK, CONTACT, MOTION, STEEL_DARK, LOOSE)
"""Of the first turn, the second …; then they begin anew."""

_MOST_NAMED = 8
"""Turns in the legend: the last ones."""


def paint_spectra(turns: Sequence[tuple[Setting, np.ndarray]], left: float, width: int, height: int) -> Canvas:
    """Levels (BANDS,) in [-1, 1] of each turn at its setting, and the share of the budget that is left."""
    canvas = Canvas(width, height, PAGE)
    unit = min(width / 640.0, height / 480.0)
    _draw_budget(canvas, left, Box(16.0 * unit, 12.0 * unit, width - 32.0 * unit, 22.0 * unit), unit)
    panel = Box(7.0 * unit, 46.0 * unit, width - 14.0 * unit, height - 53.0 * unit)
    canvas.rectangle(panel, PANEL, BORDER, corner=6.0 * unit)
    canvas.write("level in dB over 1 unit²/Hz", panel.x + 9.0 * unit, panel.y + 5.0 * unit, 11.0 * unit, QUIET)
    plot = panel.inset(44.0 * unit, 28.0 * unit, 14.0 * unit, 40.0 * unit)
    _draw_axes(canvas, plot, unit)
    across = plot.x + (np.arange(BANDS) + 0.5) / BANDS * plot.width
    for number, (setting, levels) in enumerate(turns):
        colour = _COLOURS[number % len(_COLOURS)]
        points = np.stack((across, plot.y + plot.height * (0.5 - 0.5 * levels)), axis=1)
        canvas.line(points, colour, (2.4 if number == len(turns) - 1 else 1.2) * unit)
        row = number - max(0, len(turns) - _MOST_NAMED)
        if row >= 0:
            text = f"{number + 1}: speed {setting.speed:g}, brake {setting.brake:g} N m"
            y = plot.y + (6.0 + 15.0 * row) * unit
            canvas.write(text, plot.right - 6.0 * unit, y, 11.0 * unit, colour, "topright")
    return canvas


def _draw_budget(canvas: Canvas, left: float, box: Box, unit: float) -> None:
    words = canvas.write("budget left", box.x, box.centre[1], 14.0 * unit, INK, "midleft")
    bar = Box(words.right + 12.0 * unit, box.y + 4.0 * unit, box.right - words.right - 12.0 * unit, 14.0 * unit)
    canvas.rectangle(bar, GRID, corner=4.0 * unit)
    if left > 0.0:
        canvas.rectangle(Box(bar.x, bar.y, bar.width * min(left, 1.0), bar.height), MARK, corner=4.0 * unit)


def _draw_axes(canvas: Canvas, plot: Box, unit: float) -> None:
    low, high = LEVELS
    for value in np.linspace(low, high, 6):
        y = plot.y + plot.height * (high - value) / (high - low)
        canvas.line([(plot.x, y), (plot.right, y)], GRID, unit)
        canvas.write(f"{value:g}".replace("-", "−"), plot.x - 5.0 * unit, y, 10.0 * unit, QUIET, "midright")
    for frequency in range(0, BANDS * BAND_HZ + 1, 20):
        x = plot.x + plot.width * frequency / (BANDS * BAND_HZ)
        canvas.line([(x, plot.y), (x, plot.bottom)], GRID, unit)
        canvas.write(f"{frequency}", x, plot.bottom + 5.0 * unit, 10.0 * unit, QUIET, "midtop")
    canvas.write("frequency in Hz", plot.centre[0], plot.bottom + 20.0 * unit, 11.0 * unit, QUIET, "midtop")
