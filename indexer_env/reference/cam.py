"""The motion law in closed form and plain floats: one smooth function per stretch of the cam turn.

`CamTurn` cuts the turn at every phase where the law changes its formula and where a bump begins or ends. On one stretch
β(α) is smooth and stays so a little beyond it, which a step needs that ends just past the edge.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any, NamedTuple

from indexer_env.machine import Machine
from indexer_env.motion_law import (
    Cycloidal,
    LawPieces,
    ModifiedSine,
    ModifiedTrapezoid,
    MotionLaw,
    Polynomial345,
    TableLaw,
)
from indexer_env.reference.tables import TURN, spline_of, table_of

PI = math.pi

Triple = tuple[float, float, float]
Curve = Callable[[float], Triple]
"""A value and its first two derivatives as a function of one variable."""

_SAME = 1e-12
"""Cam turns; edges nearer to each other than this are one."""


class Span(NamedTuple):
    """A smooth curve between two values of its variable."""

    low: float
    high: float
    curve: Curve


class Stretch(NamedTuple):
    """A stretch of the cam's rotation: its ends [rad], β, β', β'' as a function of α [rad], and the share of the
    process torque that acts at α."""

    low: float
    high: float
    follower: Curve
    process: Callable[[float], float]


def bump(y: float) -> Triple:
    """(1 - y²)⁴ and its first two derivatives, for |y| < 1."""
    q = 1.0 - y * y
    return q**4, -8.0 * y * q**3, q * q * (56.0 * y * y - 8.0)


def _sine_start(s: float) -> Triple:
    x = 4.0 * PI * s
    sine, cosine = math.sin(x), math.cos(x)
    return (PI * s - 0.25 * sine) / (4 + PI), PI * (1.0 - cosine) / (4 + PI), 4.0 * PI**2 * sine / (4 + PI)


def _sine_middle(s: float) -> Triple:
    x = (4.0 * PI * s + PI) / 3.0
    sine, cosine = math.sin(x), math.cos(x)
    velocity = PI * (1.0 - 3.0 * cosine) / (4 + PI)
    return (2.0 + PI * s - 2.25 * sine) / (4 + PI), velocity, 4.0 * PI**2 * sine / (4 + PI)


_CA = 8.0 * PI / (2.0 + PI)
_W = 4.0 * PI
_V1, _Y1 = _CA / _W, _CA * (1.0 / (8.0 * _W) - 1.0 / _W**2)
_V3, _Y3 = _V1 + _CA / 4.0, _Y1 + _V1 / 4.0 + _CA / 32.0
"""Modified trapezoid: peak acceleration, and velocity and height at s = 1/8 and s = 3/8."""


def _trapezoid_start(s: float) -> Triple:
    sine, cosine = math.sin(_W * s), math.cos(_W * s)
    return _CA * (s / _W - sine / _W**2), _CA * (1.0 - cosine) / _W, _CA * sine


def _trapezoid_flat(s: float) -> Triple:
    x = s - 0.125
    return _Y1 + _V1 * x + 0.5 * _CA * x * x, _V1 + _CA * x, _CA


def _trapezoid_middle(s: float) -> Triple:
    x = s - 0.375
    sine, cosine = math.sin(_W * x), math.cos(_W * x)
    return _Y3 + _V3 * x + _CA * (1.0 - cosine) / _W**2, _V3 + _CA * sine / _W, _CA * cosine


def _cycloid(s: float) -> Triple:
    sine, cosine = math.sin(TURN * s), math.cos(TURN * s)
    return s - sine / TURN, 1.0 - cosine, TURN * sine


def _polynomial_345(s: float) -> Triple:
    height = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return height, 30.0 * (s * (1.0 - s)) ** 2, 60.0 * s * (1.0 - 3.0 * s + 2.0 * s * s)


def _mirror(curve: Curve) -> Curve:
    """The second half of a rise from its first: y(s) = 1 - y(1 - s)."""

    def mirrored(s: float) -> Triple:
        y, v, a = curve(1.0 - s)
        return 1.0 - y, v, -a

    return mirrored


_RISES: dict[type[MotionLaw], tuple[Span, ...]] = {
    ModifiedSine: (
        Span(0.0, 1 / 8, _sine_start),
        Span(1 / 8, 7 / 8, _sine_middle),
        Span(7 / 8, 1.0, _mirror(_sine_start)),
    ),
    ModifiedTrapezoid: (
        Span(0.0, 1 / 8, _trapezoid_start),
        Span(1 / 8, 3 / 8, _trapezoid_flat),
        Span(3 / 8, 5 / 8, _trapezoid_middle),
        Span(5 / 8, 7 / 8, _mirror(_trapezoid_flat)),
        Span(7 / 8, 1.0, _mirror(_trapezoid_start)),
    ),
    Cycloidal: (Span(0.0, 1.0, _cycloid),),
    Polynomial345: (Span(0.0, 1.0, _polynomial_345),),
}
"""Normalised rises: height, velocity and acceleration at the share s (docs/explanation/physics.md, Motion laws)."""


def _scaled(rise: Curve, advance: float, share: float) -> Curve:
    def scaled(u: float) -> Triple:
        y, v, a = rise(u / share)
        return advance * y, advance * v / share, advance * a / share**2

    return scaled


def _joined(pieces: LawPieces, first: int, stop: int) -> Curve:
    """Pieces first … stop-1 as one curve; its outer ones reach beyond its ends."""
    edges = pieces.edges.tolist()
    coefficients = pieces.coefficients.tolist()

    def joined(u: float) -> Triple:
        k = min(max(bisect_right(edges, u) - 1, first), stop - 1)
        t = u - edges[k]
        c0, c1, c2, c3, c4, c5 = coefficients[k]
        return (
            c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))),
            2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)),
        )

    return joined


def law_spans(law: MotionLaw, stations: int, motion_share: float) -> list[Span]:
    """The law over the first cam turn: β [rad] and its derivatives by the cam's turns u, smooth on each span.

    The named rises are evaluated from their formulas. A table's pieces are its spline itself. Any other law is taken
    from its own `evaluate`, cut at the breaks of its pieces.
    """
    advance = TURN / stations
    if type(law) in _RISES:
        spans = [
            Span(motion_share * low, motion_share * high, _scaled(rise, advance, motion_share))
            for low, high, rise in _RISES[type(law)]
        ]
        return spans if motion_share == 1.0 else [*spans, Span(motion_share, 1.0, lambda u: (advance, 0.0, 0.0))]
    pieces = law.pieces(stations, motion_share)
    cuts = [k for k in range(len(pieces.edges)) if pieces.breaks[k] or k in (0, len(pieces.edges) - 1)]

    def evaluated(u: float) -> Triple:
        beta, beta1, beta2 = law.evaluate(TURN * u, stations, motion_share)
        return float(beta), TURN * float(beta1), TURN**2 * float(beta2)

    return [
        Span(
            float(pieces.edges[first]), float(pieces.edges[stop]),
            _joined(pieces, first, stop) if isinstance(law, TableLaw) else evaluated,
        )
        for first, stop in pairwise(cuts)
    ]  # fmt: skip


class CamTurn:
    """The cam of a machine with the effects that belong to it, cut into stretches.

    Parameters
    ----------
    machine : Machine
    effects : mapping of str to effect
        By name; cam.profile_error, cam.station_spacing, load.process and a table of the cam's motion are taken from it
        where present.
    """

    def __init__(self, machine: Machine, effects: Mapping[str, Any]) -> None:
        self.stations, self.advance = machine.stations, machine.advance
        self.spans = law_spans(machine.motion_law, machine.stations, machine.motion_share)
        self.rest = self.spans[0].curve(0.0)[0]
        self.spacing = effects.get("cam.station_spacing")
        self.profile = effects.get("cam.profile_error")
        self.pulse = effects.get("load.process")
        table = table_of(effects, moves=True)
        self.table = None if table is None else spline_of(table)
        edges = [0.0, 1.0, *(span.low for span in self.spans)]
        for local in (self.profile, self.pulse):
            if local is not None:
                edges += [(local.centre - local.half_width) % 1.0, (local.centre + local.half_width) % 1.0]
        if table is not None:
            edges += [k / len(table.grid) for k in range(len(table.grid))]
        edges.sort()
        self.edges = [edge for edge, next_edge in pairwise(edges) if next_edge - edge > _SAME]
        self.edges.append(1.0)

    def place(self, alpha: float) -> tuple[int, int]:
        """Cam turn and number of the stretch that hold the cam angle [rad]."""
        turn = math.floor(alpha / TURN)
        return turn, min(bisect_right(self.edges, alpha / TURN - turn), len(self.edges) - 1) - 1

    def beside(self, turn: int, number: int, step: int) -> tuple[int, int]:
        """The next stretch (step +1) or the one before (step -1)."""
        carry, number = divmod(number + step, len(self.edges) - 1)
        return turn + carry, number

    def stretch(self, turn: int, number: int) -> Stretch:
        """A stretch of cam turn `turn` with all that shapes the follower there."""
        low, high = self.edges[number], self.edges[number + 1]
        middle = 0.5 * (low + high)
        law = next(span.curve for span in self.spans if span.low <= middle < span.high)
        offset, factor, rest = self._station(turn)
        on_bump = _local(self.profile, middle)
        on_pulse = _local(self.pulse, middle)
        height = 0.0 if self.profile is None else self.profile.height
        per_rad = 1.0 / TURN

        def follower(alpha: float) -> Triple:
            u = alpha / TURN - turn
            b0, b1, b2 = law(u)
            b0, b1, b2 = offset + factor * (b0 - rest), factor * b1, factor * b2
            if on_bump is not None:
                centre, half_width = on_bump
                y0, y1, y2 = bump((u - centre) / half_width)
                b0, b1, b2 = b0 + height * y0, b1 + height * y1 / half_width, b2 + height * y2 / half_width**2
            b1, b2 = b1 * per_rad, b2 * per_rad**2
            if self.table is not None:
                e0, e1, e2 = (self.table(alpha, derivatives=n) for n in range(3))
                b0, b1, b2 = b0 + e0, b1 + e1, b2 + e2
            return b0, b1, b2

        def process(alpha: float) -> float:
            if on_pulse is None:
                return 0.0
            centre, half_width = on_pulse
            return bump((alpha / TURN - turn - centre) / half_width)[0]

        return Stretch(TURN * (turn + low), TURN * (turn + high), follower, process)

    def _station(self, turn: int) -> tuple[float, float, float]:
        """Where the table starts from in this cam turn [rad], the factor on its advance, and β at the turn's start."""
        start, factor = self.rest + turn * self.advance, 1.0
        if self.spacing is not None:
            error = self.spacing.error
            if (turn + 1) % self.stations == self.spacing.station:
                factor = 1.0 + error / self.advance
            elif turn % self.stations == self.spacing.station:
                start, factor = start + error, 1.0 - error / self.advance
        return start, factor, self.rest


def _local(effect: Any, phase: float) -> tuple[float, float] | None:
    """Centre (of the periodic image nearest to `phase`) and half width of a local effect that acts there; else None."""
    if effect is None:
        return None
    centre = effect.centre + math.floor(phase - effect.centre + 0.5)
    return (centre, effect.half_width) if abs(phase - centre) < effect.half_width else None
