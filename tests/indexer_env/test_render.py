"""The picture shows what the scene says: looked for by colour and place, without any screen."""

from __future__ import annotations

import dataclasses
import itertools
import math
import subprocess
import sys
import time

import numpy as np
import pygame
import pytest
from gymnasium.error import DependencyNotInstalled

from indexer_env import ParameterError
from indexer_env.motion_law import ModifiedSine
from indexer_env.render import Scene, Window, draw, palette, picture
from indexer_env.render.layout import Box, layout

STATIONS = 8
PITCH = 2.0 * math.pi / STATIONS
DWELL = 1.5 * math.pi
"""A cam angle in the first dwell, after which the table stands at station 1."""


def scene(**changed: object) -> Scene:
    moment = Scene(cam_angle=DWELL, table_angle=PITCH, housing_angle=0.0, stations=STATIONS, dwell=True)
    return dataclasses.replace(moment, **changed)


def places(pixels: np.ndarray, colour: palette.Colour, box: Box | None = None) -> np.ndarray:
    """Pixels (n, 2), x and y, of exactly this colour, in a box of the picture."""
    y, x = np.nonzero((pixels == colour).all(axis=2))
    found = np.stack((x, y), axis=1)
    if box is None:
        return found
    inside = (box.x <= x) & (x < box.right) & (box.y <= y) & (y < box.bottom)
    return found[inside]


def reddish(pixels: np.ndarray, box: Box) -> np.ndarray:
    """Pixels (n, 2) of the real acceleration's dots, too small to have its pure colour."""
    red = pixels[..., 0].astype(int) - pixels[..., 2] > 60
    return places(red[..., None].repeat(3, axis=2), (1, 1, 1), box)


def runs(row: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], row, [False])).astype(int)))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2], strict=True)]


PARTS = layout(640, 480)


@pytest.mark.parametrize("size", [(640, 480), (960, 640), (481, 363)])
def test_pixels_have_the_shape_asked_for(size):
    pixels = draw(scene(), *size)
    assert (pixels.shape, pixels.dtype) == ((size[1], size[0], 3), np.uint8)
    assert pixels.flags.c_contiguous
    assert pixels.flags.writeable


def test_the_same_scene_is_the_same_picture_and_another_is_another():
    first = draw(scene())
    pygame.quit()  # as Gymnasium's environments do when they close
    second = draw(scene())
    assert first is not second
    np.testing.assert_array_equal(first, second)
    assert (draw(scene(table_angle=PITCH + 0.01)) != first).any()
    assert (draw(scene(cam_angle=DWELL + 0.1)) != first).any()


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.7, 3.5, 5.9, -2.0, 40.0])
def test_the_mark_is_where_the_table_is(angle):
    """Clockwise from the top, about the middle between the mark's places half a turn apart."""
    here, there = (places(draw(scene(table_angle=angle + turn)), palette.MARK).mean(axis=0) for turn in (0.0, math.pi))
    right, down = here - there
    assert math.hypot(right, down) > 150.0
    error = math.atan2(right, -down) - angle
    assert abs((error + math.pi) % (2.0 * math.pi) - math.pi) < 0.01


def follower(cam_angle: float) -> float:
    return float(ModifiedSine().evaluate(cam_angle, STATIONS, 0.5)[0])


def tracks(cam_angle: float) -> np.ndarray:
    """Middles of the cam's tracks [px] on the line of the rollers, which are put between them."""
    pixels = draw(scene(cam_angle=cam_angle, table_angle=follower(cam_angle) + PITCH / 2.0))
    view = PARTS.cam
    # the cam's phase, below, takes 20 pixels and the caption, above, 24
    row = pixels[round(view.y + 24.0 + (view.height - 24.0 - 27.0) / 2.0)]
    dark = [run for run in runs((row == palette.STEEL_DARK).all(axis=1)) if run[1] - run[0] > 15]
    return np.array([(first + last) / 2.0 for first, last in dark])


@pytest.mark.parametrize("cam_angle", [0.4, 1.2, 2.0, 2.9])
def test_the_cams_tracks_follow_the_law(cam_angle):
    left, right = tracks(DWELL)
    middle, pitch = (left + right) / 2.0, right - left
    share = follower(cam_angle) / PITCH
    found = (tracks(cam_angle) - middle) / pitch
    # those cut by an end of the cam are narrower
    whole = [place for place in share - 0.5 + np.arange(-2, 3) if abs(place) < 0.95]
    for place in whole:
        assert np.abs(found - place).min() < 0.03


@pytest.mark.parametrize("cam_angle", [1.5, 2.0, DWELL])
def test_rollers_are_in_their_tracks_where_nothing_gives_way(cam_angle):
    """The roller of station 0 is in the middle of the cam, in the track that drives it away from there."""
    on_law = scene(cam_angle=cam_angle, table_angle=follower(cam_angle), cracked_stations=(0,))
    roller = places(draw(on_law), palette.CRACK, PARTS.cam)[:, 0].mean()
    assert np.abs(tracks(cam_angle) - roller).min() < 1.0
    behind = scene(cam_angle=cam_angle, table_angle=follower(cam_angle) - 0.3 * PITCH, cracked_stations=(0,))
    assert roller - places(draw(behind), palette.CRACK, PARTS.cam)[:, 0].mean() > 15.0


def test_rollers_follow_the_table():
    """The cracked roller of station 0 moves by as many pitches as the table."""

    def middle(table_angle: float) -> float:
        pixels = draw(scene(cam_angle=1.0, table_angle=table_angle, cracked_stations=(0,), dwell=False))
        return float(places(pixels, palette.CRACK, PARTS.cam)[:, 0].mean())

    start, half_way, end = middle(0.0), middle(0.5 * PITCH), middle(PITCH)
    assert half_way - start == pytest.approx(end - half_way, abs=0.6)
    assert end - start > 50.0


def test_the_cracks_colour_appears_only_when_cracked():
    assert len(places(draw(scene()), palette.CRACK)) == 0
    one = draw(scene(cracked_stations=(0,)))
    everywhere = draw(scene(cracked_stations=tuple(range(STATIONS))))
    seen = [len(places(pixels, palette.CRACK, PARTS.cam)) for pixels in (one, everywhere)]
    assert seen[0] > 200
    assert seen[1] > 3 * seen[0]
    # joint 2 shows the roller under load: station 0's in this dwell
    assert len(places(one, palette.CRACK, PARTS.joint_2)) > 200
    assert len(places(draw(scene(cracked_stations=(4,))), palette.CRACK, PARTS.joint_2)) == 0


@pytest.mark.parametrize(("joint", "box"), [(1, PARTS.joint_1), (2, PARTS.joint_2)])
def test_the_gap_grows_with_the_play_by_the_factor_written(joint, box):
    def gap(play: float, exaggeration: float = 25.0) -> int:
        plays = tuple(play / 2.0 if number == joint else 0.0 for number in (1, 2, 3))
        moment = scene(half_plays=plays, exaggeration=exaggeration)
        plates = places(draw(moment), palette.STEEL, box)
        middle = box.centre[0]
        left, right = plates[plates[:, 0] < middle, 0].max(), plates[plates[:, 0] > middle, 0].min()
        return int(right - left)

    widths = [gap(play) for play in (0.0, 2e-3, 4e-3, 8e-3)]
    assert all(narrow < wide for narrow, wide in itertools.pairwise(widths))
    assert widths[3] - widths[0] == pytest.approx(2.0 * (widths[2] - widths[0]), abs=2.0)
    assert gap(4e-3, exaggeration=50.0) == pytest.approx(widths[3], abs=1.0)
    words = {word.text for word in picture.paint(scene(exaggeration=50.0), 640, 480).words}
    assert "play ×50" in words


@pytest.mark.parametrize(("joint", "box"), [(1, PARTS.joint_1), (2, PARTS.joint_2)])
def test_the_flank_in_contact_is_highlighted(joint, box):
    def sides(deflection: float) -> tuple[bool, bool]:
        deflections = tuple(deflection if number == joint else 0.0 for number in (1, 2, 3))
        pixels = draw(scene(deflections=deflections, half_plays=(1e-3, 1e-3, 0.0)))
        found = places(pixels, palette.CONTACT, box)[:, 0] - box.centre[0]
        return bool((found < 0).any()), bool((found > 0).any())

    assert sides(-1.5e-3) == (True, False)
    assert sides(0.5e-3) == (False, False)
    assert sides(1.5e-3) == (False, True)


def test_screws_are_red_when_loose_and_moved():
    reds = [
        len(places(draw(scene(housing_angle=angle, loose_screws=loose)), palette.LOOSE, PARTS.table))
        for angle, loose in [(0.0, False), (1e-3, False), (0.0, True), (1e-3, True)]
    ]
    assert reds[:3] == [0, 0, 0]
    assert reds[3] > 400


def test_the_chart_shows_theory_as_a_line_and_reality_as_dots():
    past = np.linspace(-2.0, 0.0, 2001)
    moment = scene(
        history_time=past, theoretical_acceleration=np.full(2001, 10.0), acceleration=np.full(2001, -10.0),
        acceleration_scale=20.0,
    )  # fmt: skip
    pixels = draw(moment)
    plot = PARTS.chart.inset(60.0, 30.0, 20.0, 0.0)
    line, dots = places(pixels, palette.THEORY, plot), reddish(pixels, plot)
    assert np.ptp(line[:, 1]) <= 3
    assert len(np.unique(line[:, 0])) == pytest.approx(plot.width, abs=1.0)
    dotted = runs(np.isin(np.arange(640), dots[:, 0]))
    assert len(dotted) == pytest.approx(plot.width / 4.0, abs=2.0)
    silent = draw(scene(acceleration_scale=20.0))
    assert len(places(silent, palette.THEORY, plot)) == len(reddish(silent, plot)) == 0
    # both as far from zero, which has a line of its own, and each beside its number
    zero = places(draw(dataclasses.replace(moment, theoretical_acceleration=np.zeros(2001))), palette.THEORY, plot)
    above, below = zero[:, 1].mean() - line[:, 1].mean(), dots[:, 1].mean() - zero[:, 1].mean()
    assert above == pytest.approx(below, abs=1.0)
    words = {word.text: word.box.centery for word in picture.paint(moment, 640, 480).words}
    assert line[:, 1].mean() == pytest.approx(words["10"], abs=1.5)
    assert dots[:, 1].mean() == pytest.approx(words["−10"], abs=1.5)


WORDY = scene(
    cam_angle=8.0 * math.pi * 40.0 + DWELL, table_angle=1e-1, housing_angle=-1.55e-3, time=1234.567,
    deflections=(-12.34e-3, 23.45e-3, -1.55e-3), half_plays=(14e-3, 14e-3, 0.0), exaggeration=12.5,
    cracked_stations=tuple(range(STATIONS)), loose_screws=True, acceleration_scale=1500.0, window=2.05,
)  # fmt: skip


@pytest.mark.parametrize("size", [(480, 360), (640, 480), (960, 640), (1280, 480), (480, 900)])
@pytest.mark.parametrize("moment", [WORDY, scene(), scene(stations=24), scene(stations=2, table_angle=2.0)])
def test_no_word_touches_another_or_leaves_the_picture(moment, size):
    words = picture.paint(moment, *size).words
    page = pygame.Rect(0, 0, *size)
    assert len(words) > 15
    assert [word.text for word in words if not page.contains(word.box)] == []
    pairs = itertools.combinations(words, 2)
    assert [(one.text, other.text) for one, other in pairs if one.box.colliderect(other.box)] == []


def test_a_frame_takes_less_than_a_sixtieth_of_a_second():
    """Of the processor's time, and the best of some, as other programs may be at work."""
    past = np.linspace(1232.5, 1234.5, 2001)
    full = dataclasses.replace(
        WORDY, history_time=past, acceleration=900.0 * np.sin(300.0 * past), theoretical_acceleration=np.sin(6.0 * past)
    )
    times = []
    for _ in range(15):
        start = time.process_time()
        draw(full)
        times.append(time.process_time() - start)
    assert min(times) < 1.0 / 60.0


@pytest.mark.parametrize(("size", "name"), [((479, 480), "width"), ((640, 359), "height"), ((640.0, 480), "width")])
def test_a_picture_too_small_for_words_is_refused(size, name):
    with pytest.raises(ParameterError, match=rf"^draw\.{name} must be a whole number >= \d+ px, got "):
        draw(scene(), *size)
    with pytest.raises(ParameterError, match=rf"^Window\.{name} must be"):
        Window(*size)


def test_the_window_shows_the_picture_and_keeps_its_pace(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Window(render_fps=50.0)
    assert not window.is_open
    try:
        start = time.perf_counter()
        for angle in (0.0, 0.1, 0.2, 0.3):
            window.show(scene(table_angle=angle))
        assert time.perf_counter() - start > 3 / 50.0
        assert window.is_open
        shown = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
        np.testing.assert_array_equal(shown, draw(scene(table_angle=0.3)))
    finally:
        window.close()
    window.close()
    assert not window.is_open
    assert not pygame.display.get_init()
    window.show(scene())
    assert window.is_open
    pygame.quit()  # as Gymnasium's environments do when they close, with windows of others still open
    window.show(scene())
    assert pygame.display.get_surface() is not None
    window.close()


def test_drawing_opens_no_window():
    pygame.quit()
    draw(scene(time=0.123))  # words that were not written before
    assert not pygame.display.get_init()


@pytest.mark.parametrize("show", [draw, Window().show])
def test_a_missing_pygame_is_one_sentence(monkeypatch, show):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(
        DependencyNotInstalled, match=r"^pygame is not installed, run .*\"indexer-diagnosis\[render\]\""
    ):
        show(scene())


def test_scenes_are_built_without_pygame():
    program = "import sys; sys.modules['pygame'] = None; import indexer_env.render as r; r.Scene(0.0, 0.0, 0.0, 8)"
    subprocess.run([sys.executable, "-c", program], check=True, env={"PYTHONPATH": ":".join(sys.path)})
