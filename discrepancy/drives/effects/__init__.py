"""The standard effects of drives, each sized by the record itself.

In reading order:
    base        what an effect is; the registry
    friction    viscous, quadratic, dry in six forms, presliding
    load        offset, imbalance, inertia, springs, end stops
    coupling    play, compliance, transmission error
    joint       the same with the load's own encoder: forces over the measured deflection
    ripple      cogging and ripple, a line at a fixed frequency
    tabulated   a force over speed, position or deflection, or over two of these, as a spline: tables, not laws
    reading     delay, lags, gain, saturation, quantisation, drift

A new effect is one `standard(DriveEffect(...))` in one of these files; to act in the forward form too it needs its line
in `forces`.
"""

from discrepancy.drives.effects import coupling, friction, joint, load, reading, ripple
from discrepancy.drives.effects.base import EFFECTS, DriveEffect, Size
from discrepancy.drives.effects.tabulated import TABLES

__all__ = ["EFFECTS", "TABLES", "DriveEffect", "Size", "coupling", "friction", "joint", "load", "reading", "ripple"]
