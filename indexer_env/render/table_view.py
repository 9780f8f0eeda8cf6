"""The table from above: stations, the mark of station 0, the housing on its screws."""

from __future__ import annotations

import math

import numpy as np

from indexer_env.render.canvas import Canvas
from indexer_env.render.layout import Box
from indexer_env.render.palette import (
    BORDER,
    HOUSING,
    HOUSING_EDGE,
    INK,
    LOOSE,
    MARK,
    QUIET,
    STEEL,
    STEEL_DARK,
    STEEL_LIGHT,
    WHITE,
    blend,
)
from indexer_env.render.scene import Scene

MOVED = 2e-5
"""Angle from which a housing on loose screws counts as moved [rad]; the reference machine's tight screws give way by
less than half of it."""

_FARTHEST = 0.15
"""Exaggerated angle at which the housing stops [rad]; its corners would leave the panel."""

_MOST_NAMED = 24
"""Stations that can carry a number each without touching; of more, only the mark shows."""


def turned(points: np.ndarray, angle: float, centre: tuple[float, float]) -> np.ndarray:
    """Points (n, 2) about the origin, turned clockwise as seen in the picture, moved to a centre."""
    cosine, sine = math.cos(angle), math.sin(angle)
    x, y = points[:, 0], points[:, 1]
    return np.stack((centre[0] + cosine * x - sine * y, centre[1] + sine * x + cosine * y), axis=1)


def draw_table(canvas: Canvas, scene: Scene, box: Box, unit: float) -> None:
    """Draw table and housing into a box."""
    x, y = box.centre
    centre = (x, y)
    half = min(box.width, box.height) / 2.0 - 4.0 * unit
    lean = max(-_FARTHEST, min(_FARTHEST, scene.exaggeration * scene.housing_angle))
    plate = _rounded_square(0.93 * half, 0.16 * half)
    canvas.polygon(turned(plate, lean, centre), HOUSING, HOUSING_EDGE, 1.2 * unit)
    if scene.loose_screws:
        tight = turned(plate, 0.0, centre)
        canvas.dashes(np.concatenate((tight, tight[:1])), QUIET, unit, 4.0 * unit)
    _draw_screws(canvas, scene, centre, half, lean, unit)

    radius = 0.86 * half
    pointer = half * np.array([[-0.055, -0.92], [0.055, -0.92], [0.0, -0.865]])
    canvas.polygon(turned(pointer, lean, centre), INK)
    canvas.circle(x, y, radius, STEEL_LIGHT, STEEL_DARK, 1.5 * unit)
    canvas.circle(x, y, 0.86 * radius, None, STEEL, unit)
    canvas.circle(x, y, 0.30 * radius, STEEL, STEEL_DARK, unit)
    canvas.circle(x, y, 0.10 * radius, STEEL_DARK)
    _draw_stations(canvas, scene, centre, radius, unit)
    mark = radius * np.array([[-0.07, -0.985], [0.07, -0.985], [0.0, -0.83]])
    canvas.polygon(turned(mark, scene.table_angle, centre), MARK)


def _draw_screws(
    canvas: Canvas, scene: Scene, centre: tuple[float, float], half: float, lean: float, unit: float
) -> None:
    # paler as the housing swings through its place, rather than flickering
    moved = min(1.0, abs(scene.housing_angle) / MOVED) if scene.loose_screws else 0.0
    colour = blend(STEEL, LOOSE, moved)
    # 0.79: in the corners, clear of the table
    corners = 0.79 * half * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    size = 0.075 * half
    slot = np.array([[-0.6 * size, 0.0], [0.6 * size, 0.0]])
    for number, (x, y) in enumerate(turned(corners, lean, centre)):
        canvas.circle(x, y, size, colour, INK, unit)
        canvas.line(turned(slot, 0.5 + 1.3 * number, (x, y)), INK, 1.5 * unit)


def _draw_stations(canvas: Canvas, scene: Scene, centre: tuple[float, float], radius: float, unit: float) -> None:
    named = scene.stations <= _MOST_NAMED
    size = radius * min(0.13, 1.5 / scene.stations)
    square = _rounded_square(size, 0.3 * size)
    for station in range(scene.stations):
        angle = scene.table_angle - 2.0 * math.pi * station / scene.stations
        ((x, y),) = turned(np.array([[0.0, -0.64 * radius]]), angle, centre)
        if not named:
            canvas.circle(x, y, max(size, unit), STEEL_DARK)
            continue
        canvas.polygon(turned(square, angle, (x, y)), WHITE, BORDER if station else MARK, 1.5 * unit)
        canvas.write(str(station), x, y, max(8.0 * unit, min(12.0 * unit, 1.2 * size)), INK, "center")


def _rounded_square(half: float, corner: float) -> np.ndarray:
    """Corners (n, 2) of a square about the origin."""
    arc = np.linspace(0.0, math.pi / 2.0, 7)
    points = []
    for quarter in range(4):
        angle = arc + quarter * math.pi / 2.0
        middle = quarter * math.pi / 2.0 + math.pi / 4.0
        inner = math.sqrt(2.0) * (half - corner)
        points.append(
            np.stack(
                (
                    inner * math.cos(middle) + corner * np.cos(angle),
                    inner * math.sin(middle) + corner * np.sin(angle),
                ),
                axis=1,
            )
        )
    return np.concatenate(points)
