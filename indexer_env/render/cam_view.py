"""The cam from its side, seen from the table's axis: its tracks turn by, the rollers in them follow.

Across the picture, to the right, stands the angle about the table's axis, to scale, so that a roller is where the table
is; a track is where the motion law wants a roller at the cam angle that faces the viewer. The roller of station s is in
the middle of the picture, held by its track, while the table moves from s to s + 1 and dwells there: that is when a
single cracked roller carries the load.
"""

from __future__ import annotations

import math

import numpy as np

from indexer_env.law_table import law_table
from indexer_env.render.canvas import Canvas
from indexer_env.render.layout import Box
from indexer_env.render.palette import (
    BORDER,
    CRACK,
    INK,
    MOTION,
    PANEL,
    QUIET,
    STEEL,
    STEEL_DARK,
    STEEL_LIGHT,
    blend,
)
from indexer_env.render.scene import Scene

_HALF_WIDTH = 1.25
"""Half the cam's width [pitches of the rollers]."""

_SHOWN = 2.15
"""Half the width that is shown at least [pitches]."""

_ROLLER = 0.21
"""Radius of a roller [pitches]."""


def loaded_station(scene: Scene) -> int:
    """Station whose roller is in the middle of the cam: the one the cam last left (0 … S-1)."""
    return math.floor(scene.cam_angle / (2.0 * math.pi)) % scene.stations


def draw_cam(canvas: Canvas, scene: Scene, box: Box, unit: float) -> None:
    """Draw cam, tracks, rollers and the cam's phase into a box."""
    phase_height = 20.0 * unit
    view = box.inset(0.0, 0.0, 0.0, phase_height)
    x, y = view.centre
    pitch = min(view.width / (2.0 * _SHOWN), 0.62 * view.height)
    ends = min(0.48 * view.height, 1.15 * pitch)
    waist = 0.76 * ends
    half = _HALF_WIDTH * pitch
    shaft = 0.3 * waist
    canvas.rectangle(Box(view.x, y - shaft, view.width, 2.0 * shaft), STEEL_LIGHT, STEEL_DARK, width=unit)

    across = np.linspace(-half, half, 25)
    upper = np.stack((x + across, y - _radius(across / half, waist, ends)), axis=1)
    lower = np.stack((x + across, y + _radius(across / half, waist, ends)), axis=1)
    body = np.concatenate((upper, lower[::-1]))
    canvas.polygon(body, STEEL)
    shine = np.concatenate((upper * 0.55 + lower * 0.45, (upper * 0.2 + lower * 0.8)[::-1]))
    canvas.polygon(shine, blend(STEEL, STEEL_LIGHT, 0.5))
    with canvas.only_inside(Box(x - half, view.y, 2.0 * half, view.height)):
        _draw_tracks(canvas, scene, (x, y), pitch, (waist, ends), unit)
    canvas.polygon(body, None, STEEL_DARK, 1.5 * unit)
    _draw_rollers(canvas, scene, view, pitch, unit)
    _draw_phase(canvas, scene, Box(box.x, box.bottom - phase_height, box.width, phase_height), unit)


def _radius(place: np.ndarray, waist: float, ends: float) -> np.ndarray:
    """Radius of the globoidal body, at places -1 … 1 between its ends."""
    return waist + (ends - waist) * place**2


def _draw_tracks(
    canvas: Canvas,
    scene: Scene,
    centre: tuple[float, float],
    pitch: float,
    body: tuple[float, float],
    unit: float,
) -> None:
    ahead = np.linspace(-math.pi / 2.0, math.pi / 2.0, 41)
    follower, _, _ = scene.motion_law.evaluate(scene.cam_angle + ahead, scene.stations, scene.motion_share)
    pitches = follower * scene.stations / (2.0 * math.pi)
    nearest = math.floor(scene.cam_angle / (2.0 * math.pi))
    # the surface turns downward: what is ahead comes from above
    rise = np.sin(ahead)
    # a groove is as wide as its roller, along the surface as across it, so it narrows where the surface turns away
    reach = (_ROLLER + 0.025) * pitch
    for track in range(nearest - 3, nearest + 4):
        middle = (pitches - track - 0.5) * pitch
        if middle.min() > (_HALF_WIDTH + 0.5) * pitch or middle.max() < -(_HALF_WIDTH + 0.5) * pitch:
            continue
        edges = []
        for side in (-reach, reach):
            across = middle + side
            place = np.clip(across / (_HALF_WIDTH * pitch), -1.0, 1.0)
            edges.append(np.stack((centre[0] + across, centre[1] - _radius(place, *body) * rise), axis=1))
        canvas.polygon(np.concatenate((edges[0], edges[1][::-1])), STEEL_DARK)
        canvas.line(edges[0], INK, unit)
        canvas.line(edges[1], STEEL_LIGHT, unit)


def _draw_rollers(canvas: Canvas, scene: Scene, view: Box, pitch: float, unit: float) -> None:
    x, y = view.centre
    # rollers sit on the turret, which the housing carries: its rotation is no motion against the cam
    turned = (scene.table_angle - scene.housing_angle) * scene.stations / (2.0 * math.pi)
    radius, shown = _ROLLER * pitch, min(view.width / (2.0 * pitch) + _ROLLER, 0.5 * scene.stations)
    first, last = math.ceil(turned - 0.5 - shown), math.floor(turned - 0.5 + shown)
    with canvas.only_inside(view):
        for roller in range(first, last + 1):
            place = x + (turned - roller - 0.5) * pitch
            cracked = roller % scene.stations in scene.cracked_stations
            engaged = abs(place - x) < _HALF_WIDTH * pitch
            canvas.circle(place, y, radius, PANEL, QUIET if not engaged else INK, 1.5 * unit)
            if cracked:
                canvas.circle(place, y, radius - 2.5 * unit, CRACK)
            if view.x < place - radius and place + radius < view.right:
                colour = PANEL if cracked else INK if engaged else QUIET
                canvas.write(str(roller % scene.stations), place, y, 11.0 * unit, colour, "center")


def _draw_phase(canvas: Canvas, scene: Scene, box: Box, unit: float) -> None:
    turns = scene.cam_angle / (2.0 * math.pi)
    phase = turns - math.floor(turns)
    label = canvas.write(f"cam {360.0 * phase:3.0f}°", box.x, box.y + 6.0 * unit, 11.0 * unit, QUIET)
    start = box.x + 62.0 * unit
    bar = Box(start, label.centery - 3.0 * unit, box.right - start, 6.0 * unit)
    canvas.rectangle(bar, BORDER, corner=3.0 * unit)
    for low, high in law_table(scene.motion_law, scene.stations, scene.motion_share).motions:
        for begin, end in ((low, min(high, 1.0)), (0.0, high - 1.0)):
            if begin < end:
                moving = Box(bar.x + begin * bar.width, bar.y, bar.width * (end - begin), bar.height)
                canvas.rectangle(moving, MOTION, corner=3.0 * unit)
    canvas.circle(bar.x + phase * bar.width, bar.y + bar.height / 2.0, 5.0 * unit, INK)
