"""Which part of the picture stands where, at any size."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Box:
    """A rectangle: left and top edge, width and height, in pixels."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Right edge."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """Bottom edge."""
        return self.y + self.height

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the box (x, y)."""
        return self.x + self.width / 2.0, self.y + self.height / 2.0

    def inset(self, left: float, top: float, right: float, bottom: float) -> Box:
        """The box made smaller by so much on each side."""
        return Box(self.x + left, self.y + top, self.width - left - right, self.height - top - bottom)


@dataclass(frozen=True)
class Layout:
    """Boxes of the parts, and the unit by which words and lines grow with the picture.

    Attributes
    ----------
    unit : float
        Pixels per pixel of a picture of 640 × 480.
    header, table, cam, joint_1, joint_2, chart : Box
    """

    unit: float
    header: Box
    table: Box
    cam: Box
    joint_1: Box
    joint_2: Box
    chart: Box

    @property
    def small(self) -> float:
        """Height of small letters' font [px]."""
        return 11.0 * self.unit

    @property
    def large(self) -> float:
        """Height of large letters' font [px]."""
        return 14.0 * self.unit


def layout(width: int, height: int) -> Layout:
    """The parts of a picture of so many pixels."""
    unit = min(width / 640.0, height / 480.0)
    gap = 7.0 * unit
    header = Box(gap, 0.0, width - 2.0 * gap, 34.0 * unit)
    chart_height = 0.27 * height
    chart = Box(gap, height - gap - chart_height, width - 2.0 * gap, chart_height)
    top, bottom = header.bottom, chart.y - gap
    # the table is as wide as it is high, and leaves room for the cam beside it
    table = Box(gap, top, min(bottom - top, 0.5 * width), bottom - top)
    x, joint_height = table.right + gap, 0.44 * (bottom - top)
    cam = Box(x, top, width - gap - x, bottom - top - joint_height - gap)
    joint_width = (cam.width - gap) / 2.0
    joint_1 = Box(x, cam.bottom + gap, joint_width, joint_height)
    joint_2 = Box(x + joint_width + gap, joint_1.y, joint_width, joint_height)
    return Layout(unit, header, table, cam, joint_1, joint_2, chart)
