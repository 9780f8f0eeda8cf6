"""Friction of a drive's guides and bearings; dry friction truly sticks: at rest it takes whatever force holds."""

from __future__ import annotations

import numpy as np
from numba import njit

from discrepancy.drives.effects.base import DriveEffect, Size, standard
from indexer_env.effects.friction import CoulombFriction, StribeckFriction, ViscousFriction

LOAD_FRICTION = "friction.load"

standard(
    DriveEffect(
        ViscousFriction.name, "Drag grows in proportion to the speed.", "F += c v", ViscousFriction.source,
        (Size("coefficient", "drag c", "F V-1", (0.1, 0.3, 1.0), 0.0, 30.0, 0.0),),
        lambda m, p, base: p.coefficient * m.v, alike=("friction.quadratic",), forward="viscous",
        over="tabulated.speed",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "friction.quadratic", "Drag grows with the square of the speed, as of a fan or a fluid.", "F += c |v| v",
        "drag at high Reynolds number, e.g. White, Fluid Mechanics, section 7.6",
        (Size("coefficient", "drag c", "F V-2", (0.1, 0.3, 1.0), 0.0, 30.0, 0.0),),
        lambda m, p, base: p.coefficient * np.abs(m.v) * m.v, alike=(ViscousFriction.name,),
        forward="quadratic", over="tabulated.speed",
    )
)  # fmt: skip

standard(
    DriveEffect(
        CoulombFriction.name, "Dry friction opposes the motion with a constant force, and holds at rest.",
        "F += F_c sign(v); at rest any force in ±F_c", CoulombFriction.source,
        (Size("force", "dry friction F_c", "F", (0.1, 0.3, 0.8), 0.0, 20.0, 0.0),),
        lambda m, p, base, direction: np.full_like(m.v, p.force), acts="dry",
        alike=("friction.presliding", "friction.stribeck"), forward="coulomb",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "friction.asymmetric", "Dry friction is larger in one direction than in the other.",
        "F += F_a sign(v)² beside a larger F_c sign(v): F_c + F_a forwards, F_c - F_a backwards",
        "Armstrong-Hélouvry, Dupont, Canudas de Wit (1994), section 2.2",
        (Size("force", "half of the difference F_a", "F", (0.1, 0.3, -0.1, -0.3), -20.0, 20.0, 0.0),),
        lambda m, p, base, direction: p.force * direction, acts="dry",
        alike=("offset",), forward="asymmetric",
    )
)  # fmt: skip

standard(
    DriveEffect(
        StribeckFriction.name, "Dry friction is higher at low speed and falls as the lubricant's film builds up.",
        "F += F_s/(1 + (v/v_s)²) sign(v)", StribeckFriction.source,
        (
            Size("force", "breakaway above the dry friction F_s", "F", (0.1, 0.3, 0.8), 0.0, 20.0, 0.0),
            Size("speed", "speed v_s at which half is left", "V", (0.05, 0.15, 0.4), 0.01, 2.0, step=0.05),
        ),
        lambda m, p, base, direction: p.force / (1.0 + (m.v / p.speed) ** 2), acts="dry",
        alike=(CoulombFriction.name, "friction.presliding"), forward="stribeck",
        limits=(CoulombFriction.name,),
    )
)  # fmt: skip

standard(
    DriveEffect(
        LOAD_FRICTION, "Dry friction grows with the load that the drive carries, as in gears and screws.",
        "F += μ |f| sign(v), f the force of the model without friction",
        "friction of a screw or worm, e.g. Shigley, Mechanical Engineering Design, section 8-2",
        (Size("coefficient", "share μ", "", (0.05, 0.15, 0.4), 0.0, 0.95, 0.0),),
        lambda m, p, base, direction: p.coefficient * np.abs(base(m.q, m.v, m.a)), acts="dry", of_base=True,
        alike=(CoulombFriction.name, "sensor.gain"), forward="load",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "friction.position", "Dry friction rises along the stroke, as of a bent guide.",
        "F += F_p (q - q_m)/Q sign(v), q_m the middle and Q half of the stroke",
        "first term of a friction law over position",
        (Size("force", "what is added at the end of the stroke F_p", "F", (0.1, 0.3, -0.1, -0.3), -20.0, 20.0, 0.0),),
        lambda m, p, base, direction: p.force * (m.q - m.middle) / m.stroke, acts="dry", placed=True,
        forward="tilted",
    )
)  # fmt: skip


standard(
    DriveEffect(
        "friction.time", "Dry friction grows while the drive runs, as a lubricant is lost; or falls, as it warms.",
        "F += r t sign(v), t from the record's first sample", "first term of a friction law over time",
        (Size("rate", "rate r at which it grows", "F T-1", (1e-4, -1e-4, 1e-3, -1e-3), -1.0, 1.0, 0.0),),
        lambda m, p, base, direction: p.rate * m.t, acts="dry", alike=(CoulombFriction.name, "friction.stribeck"),
    )
)  # fmt: skip


@njit(cache=True)
def dahl(q: np.ndarray, reach: float) -> np.ndarray:
    """Deflection over its largest value, z/z_max, of Dahl's bristle along a path: dz/dq = 1 - sign(dq) z/z_max, solved
    exactly from sample to sample."""
    z = np.zeros_like(q)
    for k in range(1, len(q)):
        moved = q[k] - q[k - 1]
        left = np.exp(-abs(moved) / reach)
        side = 1.0 if moved > 0.0 else -1.0
        z[k] = side * (1.0 - left) + z[k - 1] * left
    return z


standard(
    DriveEffect(
        "friction.presliding", "Dry friction builds up over a short way after each reversal, as of bristles.",
        "F += F_c z, dz/dq = (1 - sign(v) z)/d", "Dahl, A solid friction model, Aerospace Corp. TOR-158 (1968)",
        (
            Size("force", "dry friction F_c", "F", (0.1, 0.3, 0.8), 0.0, 20.0, 0.0),
            Size("distance", "way d over which it builds up", "Q", (0.004, 0.02, 0.1), 0.002, 0.5, step=0.01),
        ),
        lambda m, p, base: p.force * dahl(m.q, p.distance),
        alike=(CoulombFriction.name, StribeckFriction.name, "play"), forward="presliding",
        limits=(CoulombFriction.name,),
    )
)  # fmt: skip
