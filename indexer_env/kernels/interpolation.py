"""Angles inside a step: a motor on its ramp, and the quintic through what is known at both ends."""

from __future__ import annotations

from .compiling import scalar


@scalar
def ramp(time, angle, rate, acceleration):
    """Angle and rate of a motor on its commanded ramp after a time."""
    return angle + time * (rate + 0.5 * time * acceleration), rate + time * acceleration


@scalar
def hermite(h, x0, v0, a0, x1, v1, a1):
    """Coefficients (c1 … c5) of x0 + c1 s + … + c5 s⁵, the quintic over a step of length h with these end values, rates
    and accelerations, s its share."""
    c1, c2 = h * v0, 0.5 * h * h * a0
    x, v, a = x1 - x0 - c1 - c2, h * v1 - c1 - 2.0 * c2, 0.5 * h * h * a1 - c2
    return c1, c2, 10.0 * x - 4.0 * v + a, -15.0 * x + 7.0 * v - 2.0 * a, 6.0 * x - 3.0 * v + a


@scalar
def value(s, x0, c1, c2, c3, c4, c5):
    """The quintic at share s."""
    q = s * s
    return (x0 + c1 * s) + q * ((c2 + c3 * s) + q * (c4 + c5 * s))


@scalar
def slope(s, c1, c2, c3, c4, c5):
    """Its derivative by the share."""
    q = s * s
    return (c1 + 2.0 * c2 * s) + q * ((3.0 * c3 + 4.0 * c4 * s) + q * (5.0 * c5))


@scalar
def bend(s, c2, c3, c4, c5):
    """Its second derivative by the share."""
    return (2.0 * c2 + 6.0 * c3 * s) + s * s * (12.0 * c4 + 20.0 * c5 * s)
