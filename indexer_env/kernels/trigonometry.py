"""Sine and cosine in plain arithmetic: a call of the C library inside a loop keeps its lanes scalar.

The angle is reduced to x = n π/2 + r, |r| <= π/4, with π/2 in three parts (Cody and Waite, Software Manual for the
Elementary Functions, 1980); then sin r and cos r are their Taylor series. Below 1.6e6 rad, where n times the first two
parts is exact, both are within 2e-16 and the sine alone within 3e-16; beyond, the error grows as the angle's own
rounding does.
"""

from __future__ import annotations

from .compiling import scalar

_PER_QUARTER = 0.6366197723675814
"""2/π."""

_QUARTER_1, _QUARTER_2, _QUARTER_3 = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""π/2, the first two parts with 33 bits each."""

_ROUND = 1.5 * 2.0**52
"""Added and taken off again, it leaves the nearest whole number, without a call and in any lane."""


@scalar
def nearest(x):
    """The whole number nearest to x, |x| < 2^51; halves go to the even one."""
    return (x + _ROUND) - _ROUND


@scalar
def sine_and_cosine(x):
    """sin x and cos x of an angle [rad]."""
    n = nearest(x * _PER_QUARTER)
    r = ((x - n * _QUARTER_1) - n * _QUARTER_2) - n * _QUARTER_3
    q = r * r
    s = q * q  # odd and even terms apart: the lanes wait for each product
    sine = r + r * q * (
        (-1.0 / 6.0 + s * (-1.0 / 5040.0 + s * (-1.0 / 39916800.0 - s * (1.0 / 1307674368000.0))))
        + q * (1.0 / 120.0 + s * (1.0 / 362880.0 + s * (1.0 / 6227020800.0)))
    )
    cosine = 1.0 - (0.5 * q - s * (
        (1.0 / 24.0 + s * (1.0 / 40320.0 + s * (1.0 / 479001600.0 + s * (1.0 / 20922789888000.0))))
        - q * (1.0 / 720.0 + s * (1.0 / 3628800.0 + s * (1.0 / 87178291200.0)))
    ))  # fmt: skip
    half = nearest(0.5 * n)
    odd = n - 2.0 * half  # 1 or -1 in odd quarters, where sine and cosine change places
    sign = 1.0 - 2.0 * abs(half - 2.0 * nearest(0.5 * half))
    if odd == 0.0:
        return sign * sine, sign * cosine
    return sign * (odd * cosine), sign * (-odd * sine)


@scalar
def sine_alone(x):
    """sin x alone, at a third of the cost: x = n π + r, |r| <= π/2, and one series for all of that."""
    n = nearest(x * (0.5 * _PER_QUARTER))
    r = ((x - n * (2.0 * _QUARTER_1)) - n * (2.0 * _QUARTER_2)) - n * (2.0 * _QUARTER_3)
    q = r * r
    s = q * q
    sine = r + r * q * (
        (-1.0 / 6.0 + s * (-1.0 / 5040.0 + s * (-1.0 / 39916800.0 + s * (
            -1.0 / 1307674368000.0 - s * (1.0 / 121645100408832000.0)))))
        + q * (1.0 / 120.0 + s * (1.0 / 362880.0 + s * (1.0 / 6227020800.0 + s * (
            1.0 / 355687428096000.0 + s * (1.0 / 51090942171709440000.0)))))
    )  # fmt: skip
    return sine * (1.0 - 2.0 * abs(n - 2.0 * nearest(0.5 * n)))
