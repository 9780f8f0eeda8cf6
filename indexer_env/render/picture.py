"""The whole picture: panels with their captions, and what stands in them."""

from __future__ import annotations

from indexer_env.render.cam_view import draw_cam
from indexer_env.render.canvas import Canvas
from indexer_env.render.chart_view import draw_chart, draw_legend
from indexer_env.render.joint_view import draw_joint
from indexer_env.render.layout import Box, Layout, layout
from indexer_env.render.palette import BORDER, CRACK, INK, LOOSE, MOTION, PAGE, PANEL, QUIET, STEEL_LIGHT, Colour
from indexer_env.render.scene import Scene
from indexer_env.render.table_view import draw_table


def paint(scene: Scene, width: int, height: int) -> Canvas:
    """Everything that a scene shows, on a canvas of so many pixels."""
    canvas = Canvas(width, height, PAGE)
    parts = layout(width, height)
    _draw_header(canvas, scene, parts)
    factor = f"×{scene.exaggeration:g}"
    lean = f"{1e3 * scene.housing_angle:+.2f}".replace("-", "−")
    moved = f"θ = {lean} mrad, {factor}" if scene.loose_screws else ""
    draw_table(canvas, scene, _panel(canvas, parts, parts.table, "table from above", moved), parts.unit)
    draw_cam(canvas, scene, _panel(canvas, parts, parts.cam, "cam and rollers", ""), parts.unit)
    for number, box, name in ((1, parts.joint_1, "1 reducer"), (2, parts.joint_2, "2 rollers")):
        draw_joint(canvas, scene, number, _panel(canvas, parts, box, name, f"play {factor}"), parts.unit)
    chart = _panel(canvas, parts, parts.chart, "table acceleration in rad/s²", "")
    draw_legend(canvas, chart.right, parts.chart.y + 5.0 * parts.unit, parts.unit)
    draw_chart(canvas, scene, chart, parts.unit)
    return canvas


def _panel(canvas: Canvas, parts: Layout, box: Box, caption: str, note: str) -> Box:
    """Draw an empty panel with its caption and a note to the right of it; returns the room that is left."""
    unit = parts.unit
    canvas.rectangle(box, PANEL, BORDER, corner=6.0 * unit)
    inner = box.inset(9.0 * unit, 5.0 * unit, 9.0 * unit, 7.0 * unit)
    canvas.write(caption, inner.x, inner.y, parts.small, QUIET)
    if note:
        canvas.write(note, inner.right, inner.y, parts.small, QUIET, "topright")
    return inner.inset(0.0, 19.0 * unit, 0.0, 0.0)


def _draw_header(canvas: Canvas, scene: Scene, parts: Layout) -> None:
    box, unit = parts.header, parts.unit
    y = box.centre[1]
    right = canvas.write(f"t = {scene.time:.3f} s", box.x + 4.0 * unit, y, parts.large, INK, "midleft").right
    station = scene.station % scene.stations
    if scene.dwell:
        words, colour = f"dwell at station {station}", STEEL_LIGHT
    else:
        words, colour = f"index {station} → {(station + 1) % scene.stations}", MOTION
    # from a fixed place, so that it does not tremble with the digits of the time
    _chip(canvas, parts, max(right + 12.0 * unit, box.x + 120.0 * unit), words, colour, INK, "midleft")
    right = box.right - 4.0 * unit
    for present, text, colour in (
        (scene.loose_screws, "loose screws", LOOSE),
        (
            bool(scene.cracked_stations),
            "cracked rollers" if len(scene.cracked_stations) > 1 else "cracked roller",
            CRACK,
        ),
    ):
        if present:
            right = _chip(canvas, parts, right, text, colour, PANEL, "midright") - 8.0 * unit


def _chip(canvas: Canvas, parts: Layout, x: float, text: str, fill: Colour, ink: Colour, anchor: str) -> float:
    """Write words on a coloured label whose end (left or right, as anchored) is at x; returns its left end."""
    unit, y = parts.unit, parts.header.centre[1]
    inward = 9.0 * unit if anchor == "midleft" else -9.0 * unit
    words = canvas.write(text, x + inward, y, 12.0 * unit, ink, anchor)
    label = Box(words.left - 9.0 * unit, y - 10.0 * unit, words.width + 18.0 * unit, 20.0 * unit)
    canvas.rectangle(label, fill, corner=10.0 * unit)
    return label.x
