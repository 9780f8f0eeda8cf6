"""What a drive carries: constant forces, masses, springs and stops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from discrepancy.drives.effects.base import PHASES, DriveEffect, Size, standard
from discrepancy.drives.effects.ripple import varying
from indexer_env.effects.drive import TransmissionError
from indexer_env.effects.load import Imbalance

if TYPE_CHECKING:
    from discrepancy.drives.track import Track


standard(
    DriveEffect(
        "offset", "A constant force acts, as of a tilted guide or an amplifier's offset.", "F += F_0", "statics",
        (Size("force", "force F_0", "F", (0.1, -0.1, 0.4, -0.4), -20.0, 20.0, 0.0),),
        lambda m, p, base: np.full_like(m.v, p.force), alike=("friction.asymmetric", "sensor.offset_drift"),
        forward="offset",
    )
)  # fmt: skip

standard(
    DriveEffect(
        Imbalance.name, "An eccentric weight pulls once per turn.", "F += G sin(q + φ)", Imbalance.source,
        (
            Size("torque", "moment of the weight G", "F", (0.1, 0.4), 0.0, 20.0, 0.0),
            Size("phase", "phase φ at q = 0", "", PHASES, -20.0, 20.0, step=0.5),
        ),
        lambda m, p, base: p.torque * np.sin(m.q + p.phase), rotary=True, placed=True,
        alike=("offset", "spring.linear"), forward="imbalance", over="tabulated.position",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "inertia", "More mass or inertia moves than was assumed.", "F += m a", "Newton's second law",
        (Size("inertia", "what is added m", "F A-1", (0.1, -0.1, 0.4, -0.4), -5.0, 20.0, 0.0),),
        lambda m, p, base: p.inertia * m.a, alike=("sensor.gain",), forward="inertia",
    )
)  # fmt: skip


def _varied(m: Track, p, base) -> np.ndarray:
    angle = p.wavenumber * m.q + p.phase
    return p.inertia * (np.sin(angle) * m.a + 0.5 * p.wavenumber * np.cos(angle) * m.v**2)


standard(
    DriveEffect(
        "inertia.position", "What moves weighs more at one place than at another, as behind a crank or a linkage.",
        "F += J(q) a + v² dJ/dq/2, J = J_1 sin(k q + φ)",
        "Lagrange's equation with an inertia that varies, e.g. Dresig and Holzweißig, Dynamics of Machinery (2010), "
        "chapter 2",
        (
            Size("inertia", "amplitude J_1", "F A-1", (0.1,), 0.0, 20.0, 0.0),
            Size("wavenumber", "wavenumber k", "Q-1", (1.5, 4.0, 10.0), 1.0, 50.0, step=0.2),
            Size("phase", "phase φ at q = 0", "", PHASES, -20.0, 20.0, step=0.5),
        ),
        _varied, placed=True, alike=(TransmissionError.name, "inertia"), starts=varying, forward="varying",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "spring.linear", "A spring pulls towards one place of the stroke.",
        "F += k (q - q_m), q_m the middle of the stroke", "Hooke's law",
        (Size("stiffness", "stiffness k", "F Q-1", (0.1, 0.4, -0.1), -20.0, 50.0, 0.0),),
        lambda m, p, base: p.stiffness * (m.q - m.middle), alike=("spring.cubic", Imbalance.name),
        placed=True, forward="linear", over="tabulated.position",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "spring.cubic", "A spring hardens away from the middle of the stroke.", "F += k₃ (q - q_m)³",
        "Duffing's spring, e.g. Nayfeh and Mook, Nonlinear Oscillations, section 4.1",
        (Size("stiffness", "stiffness k₃", "F Q-3", (0.1, 0.4, -0.1), -20.0, 50.0, 0.0),),
        lambda m, p, base: p.stiffness * (m.q - m.middle) ** 3, alike=("spring.linear", "end_stop"),
        placed=True, forward="cubic", over="tabulated.position",
    )
)  # fmt: skip

standard(
    DriveEffect(
        "spring.bilinear", "From one place on, a contact adds its stiffness.",
        "F += k max(0, q - q_c) for k > 0; k max(0, q_c - q) where it lies on the other side",
        "piecewise linear stiffness, e.g. Shaw and Holmes, J. Sound Vib. 90 (1983) 129",
        (
            Size("stiffness", "stiffness k; below 0 for a contact at the lower side", "F Q-1",
                 (0.5, 2.0, -0.5, -2.0), -200.0, 200.0, 0.0),
            Size("place", "place of contact, from the middle of the stroke q_c - q_m", "Q", (-0.4, 0.0, 0.4, 0.8),
                 -1.0, 1.0, step=0.1),
        ),
        lambda m, p, base: _one_sided(m.q - m.middle - p.place, p.stiffness),
        placed=True, alike=("end_stop", "spring.linear"), forward="bilinear", over="tabulated.position",
    )
)  # fmt: skip


def _one_sided(x: np.ndarray, stiffness: float) -> np.ndarray:
    """A contact that pushes back: upwards of its place for k > 0, downwards for k < 0."""
    return stiffness * np.maximum(x, 0.0) if stiffness >= 0.0 else -stiffness * np.minimum(x, 0.0)


standard(
    DriveEffect(
        "end_stop", "Stops at both ends of the stroke push back.",
        "F += k max(0, |q - q_m| - q_s) sign(q - q_m)", "Shaw and Holmes, J. Sound Vib. 90 (1983) 129",
        (
            Size("stiffness", "stiffness k of a stop", "F Q-1", (1.0, 5.0, 20.0), 0.0, 1000.0, 0.0),
            Size("place", "distance q_s of the stops from the middle of the stroke", "Q", (0.7, 0.85, 0.95), 0.3, 1.0,
                 step=0.05),
        ),
        lambda m, p, base: p.stiffness * np.sign(m.q - m.middle) * np.maximum(np.abs(m.q - m.middle) - p.place, 0.0),
        placed=True, alike=("spring.cubic", "spring.bilinear"), forward="stops", over="tabulated.position",
    )
)  # fmt: skip
