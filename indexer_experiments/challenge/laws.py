"""Motion laws of the challenge in closed form: height, velocity and acceleration at the share s of the motion.

Sources: Norton, Cam Design and Manufacturing Handbook (2002); the integrals of the modified trapezoid are our own.
"""

from __future__ import annotations

import math

import numba

LAWS = ("modified_sine", "modified_trapezoid", "cycloidal", "polynomial_345")
"""A law's number is its place here."""


@numba.njit
def rise(law: float, s: float) -> tuple[float, float, float]:
    """Height, velocity and acceleration of the unit rise; all laws are symmetric about its middle."""
    if s > 0.5:
        y, v, a = first_half(law, 1.0 - s)
        return 1.0 - y, v, -a
    return first_half(law, s)


@numba.njit
def first_half(law: float, s: float) -> tuple[float, float, float]:
    """The same for 0 <= s <= 1/2."""
    if law == 0.0:
        return modified_sine(s)
    if law == 1.0:
        return modified_trapezoid(s)
    if law == 2.0:
        x = 2.0 * math.pi * s
        return s - math.sin(x) / (2.0 * math.pi), 1.0 - math.cos(x), 2.0 * math.pi * math.sin(x)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * (s - s * s) ** 2, 60.0 * s - 180.0 * s * s + 120.0 * s**3


@numba.njit
def modified_sine(s: float) -> tuple[float, float, float]:
    """Quarter sines of two periods, the short one at the ends."""
    if s < 0.125:
        x = 4.0 * math.pi * s
        y = (math.pi * s - 0.25 * math.sin(x)) / (4.0 + math.pi)
        return y, math.pi * (1.0 - math.cos(x)) / (4.0 + math.pi), 4.0 * math.pi**2 * math.sin(x) / (4.0 + math.pi)
    x = (4.0 * math.pi * s + math.pi) / 3.0
    y = (2.0 + math.pi * s - 2.25 * math.sin(x)) / (4.0 + math.pi)
    v = math.pi * (1.0 - 3.0 * math.cos(x)) / (4.0 + math.pi)
    return y, v, 4.0 * math.pi**2 * math.sin(x) / (4.0 + math.pi)


@numba.njit
def modified_trapezoid(s: float) -> tuple[float, float, float]:
    """Quarter sine to s = 1/8, constant to 3/8, quarter cosine to 1/2; integrated from rest."""
    w, peak = 4.0 * math.pi, 8.0 * math.pi / (2.0 + math.pi)
    if s <= 0.125:
        y, v, a = s / w - math.sin(w * s) / w**2, (1.0 - math.cos(w * s)) / w, math.sin(w * s)
    elif s <= 0.375:
        x, v, a = s - 0.125, 1.0 / w + s - 0.125, 1.0
        y = 0.125 / w - 1.0 / w**2 + x / w + 0.5 * x * x
    else:
        x = s - 0.375
        v, a = 1.0 / w + 0.25 + math.sin(w * x) / w, math.cos(w * x)
        y = 0.125 / w - 1.0 / w**2 + 0.25 / w + 0.03125 + (1.0 / w + 0.25) * x + (1.0 - math.cos(w * x)) / w**2
    return peak * y, peak * v, peak * a
