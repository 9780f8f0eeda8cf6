"""Smooth shapes and words on a pygame surface.

Shapes are drawn at twice the size and averaged down, which smooths every edge alike; words are written at full size on
top, where pygame smooths them itself. Coordinates and widths are pixels of the finished picture, fractions allowed.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame
from numpy.typing import ArrayLike

from indexer_env.render.layout import Box
from indexer_env.render.palette import Colour

_FINE = 2
"""Pixels of the drawing per pixel of the picture, in each direction."""


@dataclass(frozen=True)
class Word:
    """A text and the pixels it covers."""

    text: str
    box: pygame.Rect


class Canvas:
    """A picture in the making.

    Attributes
    ----------
    words : list of Word
        All texts written so far.
    """

    def __init__(self, width: int, height: int, background: Colour) -> None:
        self._fine = pygame.Surface((_FINE * width, _FINE * height), depth=32)
        self._fine.fill(background)
        self._size = (width, height)
        self._written: list[tuple[pygame.Surface, pygame.Rect]] = []
        self.words: list[Word] = []

    def polygon(self, points: ArrayLike, fill: Colour | None, edge: Colour | None = None, width: float = 1.0) -> None:
        """A filled polygon (n, 2), outlined where `edge` is given."""
        fine = _fine(points)
        if fill is not None:
            pygame.draw.polygon(self._fine, fill, fine)
        if edge is not None:
            pygame.draw.lines(self._fine, edge, True, fine, _thick(width))

    def circle(
        self, x: float, y: float, radius: float, fill: Colour | None, edge: Colour | None = None, width: float = 1.0
    ) -> None:
        """A disc, outlined where `edge` is given."""
        centre = (_FINE * x, _FINE * y)
        if fill is not None:
            pygame.draw.circle(self._fine, fill, centre, _FINE * radius)
        if edge is not None:
            pygame.draw.circle(self._fine, edge, centre, _FINE * radius, _thick(width))

    def rectangle(
        self, box: Box, fill: Colour | None, edge: Colour | None = None, corner: float = 0.0, width: float = 1.0
    ) -> None:
        """A box with round corners of a radius, outlined where `edge` is given."""
        area = pygame.Rect(*(round(_FINE * side) for side in (box.x, box.y, box.width, box.height)))
        radius = round(_FINE * corner)
        if fill is not None:
            pygame.draw.rect(self._fine, fill, area, border_radius=radius)
        if edge is not None:
            pygame.draw.rect(self._fine, edge, area, _thick(width), border_radius=radius)

    def line(self, points: ArrayLike, colour: Colour, width: float = 1.0) -> None:
        """A line through at least two points (n, 2)."""
        pygame.draw.lines(self._fine, colour, False, _fine(points), _thick(width))

    def dashes(self, points: ArrayLike, colour: Colour, width: float = 1.0, length: float = 4.0) -> None:
        """A line of dashes along points (n, 2), as long as the gaps between them."""
        stops = along(points, length)
        for start, end in zip(stops[:-1:2], stops[1::2], strict=False):
            pygame.draw.line(self._fine, colour, _FINE * start, _FINE * end, _thick(width))

    def dots(self, points: ArrayLike, colour: Colour, radius: float, spacing: float) -> None:
        """Dots along a line through points (n, 2), evenly spaced whatever its slope."""
        size = max(2, round(2 * _FINE * radius))
        dot = pygame.Surface((size, size), pygame.SRCALPHA)
        pygame.draw.circle(dot, colour, (size / 2, size / 2), size / 2)
        corners = np.rint(_FINE * along(points, spacing) - size / 2).astype(int).tolist()
        self._fine.blits([(dot, corner) for corner in corners], False)

    @contextmanager
    def only_inside(self, box: Box) -> Iterator[None]:
        """Draw nothing outside a box; words excepted."""
        before = self._fine.get_clip()
        left, top = math.floor(_FINE * box.x), math.floor(_FINE * box.y)
        right, bottom = math.ceil(_FINE * box.right), math.ceil(_FINE * box.bottom)
        self._fine.set_clip(pygame.Rect(left, top, right - left, bottom - top).clip(before))
        try:
            yield
        finally:
            self._fine.set_clip(before)

    def write(self, text: str, x: float, y: float, size: float, colour: Colour, anchor: str = "topleft") -> pygame.Rect:
        """A text whose anchor (a pygame.Rect point such as "midtop") is at a place; returns the pixels it covers."""
        picture = _text(text, max(1, round(size)), colour)
        place = picture.get_rect(**{anchor: (round(x), round(y))})
        self._written.append((picture, place))
        self.words.append(Word(text, place))
        return place

    def finished(self) -> pygame.Surface:
        """The picture at its size."""
        surface = pygame.transform.smoothscale(self._fine, self._size)
        surface.blits(self._written, False)
        return surface


def along(points: ArrayLike, spacing: float) -> np.ndarray:
    """Points (m, 2) every so many pixels along a line through points (n, 2)."""
    corners = np.asarray(points, dtype=np.float64)
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    distance = np.concatenate(([0.0], np.cumsum(lengths)))
    stops = np.arange(0.0, distance[-1] + 1e-9, spacing)
    return np.stack((np.interp(stops, distance, corners[:, 0]), np.interp(stops, distance, corners[:, 1])), axis=1)


def _fine(points: ArrayLike) -> list[list[float]]:
    return (_FINE * np.asarray(points, dtype=np.float64)).tolist()


def _thick(width: float) -> int:
    return max(1, round(_FINE * width))


# Fonts die with pygame.font.quit, which any other user of pygame may call; pictures of words do not.
@functools.lru_cache(maxsize=512)
def _text(text: str, size: int, colour: Colour) -> pygame.Surface:
    if not pygame.font.get_init():
        pygame.font.init()
    return pygame.font.Font(_font_file(), size).render(text, True, colour)


@functools.cache
def _font_file() -> str:
    # pygame's own font is bold only; matplotlib carries one that also has Greek letters
    import matplotlib

    return str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf")
