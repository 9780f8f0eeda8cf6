"""Play of joints 1 and 2: what drives sits between two flanks, each on the spring that the joint is.

The gap is the play and the place of what is between is the deflection, both drawn larger by the factor that stands in
the picture, at a lever as long as the joint's picture is wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from indexer_env.render.cam_view import loaded_station
from indexer_env.render.canvas import Canvas
from indexer_env.render.layout import Box
from indexer_env.render.palette import CONTACT, CRACK, INK, PANEL, QUIET, STEEL, STEEL_DARK, STEEL_LIGHT, Colour
from indexer_env.render.scene import Scene


@dataclass(frozen=True)
class Flanks:
    """Places across the picture, from the middle of the joint [px], and what touches.

    Attributes
    ----------
    between : float
        Middle of what is between the flanks.
    left, right : float
        Faces of the flanks, pushed back where something presses.
    contact : int
        -1: the left flank carries; 1: the right one; 0: none.
    """

    between: float
    left: float
    right: float
    contact: int


def flanks(deflection: float, half_play: float, scale: float, half_width: float, room: float) -> Flanks:
    """Where flanks and what is between them stand.

    Parameters
    ----------
    deflection, half_play : float
        δ and g/2 [rad].
    scale : float
        Exaggerated pixels per radian.
    half_width : float
        Half of what is between [px].
    room : float
        Farthest place of a flank's face [px]; what is larger is drawn there.
    """
    reach = room - half_width
    gap = min(scale * half_play, reach)
    place = max(-reach, min(reach, scale * deflection))
    contact = (deflection > half_play) - (deflection < -half_play)
    left, right = -gap, gap
    if contact > 0:
        right = max(gap, place)
    elif contact < 0:
        left = min(-gap, place)
    if half_play == 0.0:
        # without play both flanks stay in touch
        left = right = place
    return Flanks(place, left - half_width, right + half_width, contact)


def draw_joint(canvas: Canvas, scene: Scene, joint: int, box: Box, unit: float) -> None:
    """Draw joint 1 or 2 and its numbers into a box."""
    deflection, half_play = scene.deflections[joint - 1], scene.half_plays[joint - 1]
    cracked = joint == 2 and loaded_station(scene) in scene.cracked_stations
    line = 15.0 * unit
    view = box.inset(0.0, 0.0, 0.0, 2.0 * line + 2.0 * unit)
    x, y = view.centre
    width = min(view.width, 2.4 * view.height)
    half_width = 0.12 * width
    height = 0.36 * view.height
    room = 0.41 * width
    state = flanks(deflection, half_play, scene.exaggeration * width, half_width, room)

    for side, face in ((-1, state.left), (1, state.right)):
        wall = x + side * 0.5 * width
        carries = state.contact == side
        spring = CONTACT if carries else CRACK if cracked and side < 0 else STEEL_DARK
        plate = 5.0 * unit
        _draw_spring(canvas, x + face + side * plate, wall, y, 0.45 * height, spring, unit)
        canvas.line([(wall, y - height), (wall, y + height)], INK, 2.0 * unit)
        left = min(x + face, x + face + side * plate)
        canvas.rectangle(
            Box(left, y - height, plate, 2.0 * height), CONTACT if carries else STEEL, None if carries else STEEL_DARK
        )
    if joint == 1:
        _draw_tooth(canvas, x + state.between, y, half_width, height, unit)
    else:
        canvas.circle(x + state.between, y, half_width, CRACK if cracked else STEEL_LIGHT, INK, 1.5 * unit)
        canvas.circle(x + state.between, y, 0.3 * half_width, PANEL, INK, unit)
    name = "δ₁" if joint == 1 else "δ₂"
    milli, play = f"{1e3 * deflection:+.2f}".replace("-", "−"), f"{2e3 * half_play:.2f}"
    canvas.write(f"{name} = {milli} mrad", x, box.bottom - 2.0 * line, 11.0 * unit, INK, "midtop")
    canvas.write(f"play {play} mrad", x, box.bottom - line, 11.0 * unit, QUIET, "midtop")


def _draw_tooth(canvas: Canvas, x: float, y: float, half_width: float, height: float, unit: float) -> None:
    # straight where it touches, so that the gap is as wide as the play at every height
    top = 0.8 * height
    corners = [(-1.0, -0.6), (-0.7, -1.0), (0.7, -1.0), (1.0, -0.6), (1.0, 1.2), (-1.0, 1.2)]
    canvas.polygon([(x + half_width * a, y + top * b) for a, b in corners], STEEL_LIGHT, INK, 1.5 * unit)


def _draw_spring(
    canvas: Canvas, start: float, end: float, y: float, height: float, colour: Colour, unit: float
) -> None:
    turns = 7
    along = np.linspace(start, end, turns + 1)
    swing = np.where(np.arange(turns + 1) % 2 == 0, -0.5, 0.5) * height
    swing[0] = swing[-1] = 0.0
    canvas.line(np.stack((along, y + swing), axis=1), colour, 1.5 * unit)
