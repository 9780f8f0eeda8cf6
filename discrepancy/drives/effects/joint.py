"""What a joint between drive and load does, where the load has an encoder of its own: forces over the deflection.

δ = q - q_load, both on the drive's side of the gear
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.effects.base import DriveEffect, Size, standard

if TYPE_CHECKING:
    from discrepancy.drives.track import Track

_SOURCE = "two-mass drive, e.g. Leonhard, Control of Electrical Drives (2001), chapter on coupled masses"
_PLAYS = (0.1, 0.4, 1.0)
"""Plays at which a fit begins, in D."""


def _followed(m: Track, p, base) -> np.ndarray:
    stiff = m.u._replace(q_load=m.q, v_load=m.v, a_load=m.a)
    if not np.array_equal(base(m.q, m.v, m.a, stiff), base(m.q, m.v, m.a)):
        # a model that has the joint already would have it twice
        return np.zeros_like(m.q)
    return p.share * (base(m.u.q_load, m.u.v_load, m.u.a_load) - base(m.q, m.v, m.a))


standard(
    DriveEffect(
        "joint.load", "Part of what a rigid model moves follows the load's encoder, not the drive's.",
        "F += s (f(q_load, v_load, a_load) - f(q, v, a))", _SOURCE,
        (Size("share", "share s that lies behind the joint", "", (0.3, 0.7), 0.0, 1.0, 0.0, 0.2),),
        _followed, of_base=True, load="seen", alike=("joint.stiffness",),
    )
)  # fmt: skip

standard(
    DriveEffect(
        "joint.stiffness", "A joint passes on a force with its deflection.", "F += k δ", _SOURCE,
        (Size("stiffness", "stiffness k", "F D-1", (0.1, 0.5, 1.0, -0.1), -20.0, 50.0, 0.0),),
        lambda m, p, base: p.stiffness * m.deflection, load="seen", alike=("joint.load",),
        over="tabulated.deflection",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "joint.damping", "A joint passes on a force with the rate of its deflection.", "F += r dδ/dt", _SOURCE,
        (Size("damping", "damping r", "F D-1 T", (0.003, 0.03, 0.3), 0.0, 20.0, 0.0),),
        lambda m, p, base: p.damping * m.deflection_rate, load="seen",
    )
)  # fmt: skip


def _slack(m: Track, p, base) -> np.ndarray:
    beside = m.deflection - p.middle
    within = np.clip(beside, -0.5 * p.play, 0.5 * p.play)
    # no rate of a deflection beyond the play while that is crossed
    speed = np.where(np.abs(beside) < 0.5 * p.play, m.v, m.u.v_load)
    taut = m.u._replace(q_load=m.u.q_load + within, v_load=speed)
    return base(m.q, m.v, m.a, taut) - base(m.q, m.v, m.a)


def _about(m: Track, left: np.ndarray) -> list[tuple[float, ...]]:
    """Starts about the middle of the deflection: encoders need not be zeroed alike."""
    deflection = m.q - m.u.q_load
    low, high = float(deflection.min()), float(deflection.max())
    return [(share * 0.5 * (high - low), 0.5 * (low + high)) for share in _PLAYS]


standard(
    DriveEffect(
        "joint.play", "The joint of the model gives way inside its play before it passes on a force.",
        "F += f at δ - min(max(δ - δ_m, -g/2), g/2) - f at δ, dδ/dt = 0 inside the play g about δ_m",
        "dead zone, as in docs/explanation/physics.md, section Joints",
        (
            Size("play", "total play g", "D", _PLAYS, 0.0, 2.0, 0.0, 0.05),
            Size("middle", "deflection δ_m in the middle of the play", "D", (0.0,), step=0.05),
        ),
        _slack, of_base=True, load="seen", starts=_about,
    )
)  # fmt: skip
