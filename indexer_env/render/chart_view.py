"""The table's acceleration, dotted, over the theoretical one, a line: the paper's fig. 1c, running."""

from __future__ import annotations

import math

import numpy as np

from indexer_env.render.canvas import Canvas
from indexer_env.render.layout import Box
from indexer_env.render.palette import BORDER, GRID, INK, QUIET, REAL, THEORY, Colour
from indexer_env.render.scene import Scene

_STEPS = (1.0, 1.6, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Ends of the scale whose halves are short numbers."""


def rounded_up(value: float, steps: tuple[float, ...] = _STEPS) -> float:
    """The smallest of the steps, times a power of ten, that is not below a positive value."""
    decade = 10.0 ** math.floor(math.log10(value))
    return decade * next(step for step in (*steps, 10.0) if step * decade >= value * (1.0 - 1e-9))


def draw_chart(canvas: Canvas, scene: Scene, box: Box, unit: float) -> None:
    """Draw the strip chart into a box."""
    shown = np.concatenate((scene.acceleration, scene.theoretical_acceleration))
    limit = rounded_up(float(np.abs(shown).max(initial=scene.acceleration_scale)))
    plot = box.inset(40.0 * unit, 4.0 * unit, 6.0 * unit, 20.0 * unit)
    _draw_axes(canvas, scene, plot, limit, unit)
    if len(scene.history_time) == 0:
        return
    start = scene.time - scene.window
    across = plot.x + (scene.history_time - start) / scene.window * plot.width
    with canvas.only_inside(plot):
        for values, colour in ((scene.theoretical_acceleration, THEORY), (scene.acceleration, REAL)):
            points = np.stack((across, plot.y + plot.height * (0.5 - 0.5 * values / limit)), axis=1)
            # a column of pixels shows no more than a few samples
            points = points[:: max(1, len(points) // (4 * max(1, round(plot.width))))]
            if colour is REAL:
                canvas.dots(points, colour, 1.25 * unit, 4.0 * unit)
            elif len(points) > 1:
                canvas.line(points, colour, 1.8 * unit)


def _draw_axes(canvas: Canvas, scene: Scene, plot: Box, limit: float, unit: float) -> None:
    size = 10.0 * unit
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        y = plot.y + plot.height * (0.5 - 0.5 * share)
        colour: Colour = BORDER if share == 0.0 else GRID
        canvas.line([(plot.x, y), (plot.right, y)], colour, unit)
        label = f"{share * limit:g}".replace("-", "−")
        canvas.write(label, plot.x - 5.0 * unit, y, size, QUIET, "midright")
    step = rounded_up(scene.window / 8.0, (1.0, 2.0, 5.0))
    start = scene.time - scene.window
    for number in range(math.ceil(start / step), math.floor(scene.time / step) + 1):
        x = plot.x + (number * step - start) / scene.window * plot.width
        canvas.line([(x, plot.y), (x, plot.bottom)], GRID, unit)
        # labels near the ends would reach beyond the panel; before zero nothing has happened
        if number >= 0 and plot.x + 14.0 * unit < x < plot.right - 14.0 * unit:
            canvas.write(f"{number * step:.6g}", x, plot.bottom + 5.0 * unit, size, QUIET, "midtop")
    canvas.line([(plot.x, plot.y), (plot.x, plot.bottom)], BORDER, unit)


def draw_legend(canvas: Canvas, right: float, y: float, unit: float) -> None:
    """Write which line is which, ending at a place [px]."""
    size = 11.0 * unit
    right = canvas.write("time in s", right, y, size, QUIET, "topright").left - 16.0 * unit
    for text in ("real", "theoretical"):
        place = canvas.write(text, right, y, size, INK, "topright")
        end = place.left - 5.0 * unit
        line = [(end - 24.0 * unit, place.centery), (end, place.centery)]
        if text == "real":
            canvas.dots(line, REAL, 1.25 * unit, 4.0 * unit)
        else:
            canvas.line(line, THEORY, 1.8 * unit)
        right = end - 40.0 * unit
