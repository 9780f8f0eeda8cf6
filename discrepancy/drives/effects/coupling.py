"""What lies between the measured motion and the load: play, a soft coupling, a transmission that wavers."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from discrepancy.drives.effects.base import PHASES, DriveEffect, Size, standard
from discrepancy.drives.effects.ripple import ringing
from indexer_env.compiled import kernel_fingerprint
from indexer_env.effects.drive import TransmissionError
from indexer_env.effects.friction import CoulombFriction
from indexer_env.filters import BRACKET_LIMIT, bracket_sections, filtered
from indexer_env.kernels.joints import line_torque, region_line

if TYPE_CHECKING:
    from discrepancy.drives.track import Track

_CONTACT = 0.5
"""Frequency of the load on its contact over half the inner rate, four times the cut-off: a load without play then moves
with its joint to 2 % of its force at half the cut-off, 7 % at it. At half of it these are 8 and 33 %; at twice 0.4 and
1.4 %, but a fit no longer finds its way."""

LAWS = ("clipped", "kelvin_voigt", "damped_in_play")
"""Contact laws of play, as the joints of the indexing machine have them."""


@njit(cache=True)
def dragged(q: np.ndarray, play: float) -> np.ndarray:
    """Where a load stands in its play, q - x (n,) within ±play/2, if friction holds it until it is pushed."""
    inside = np.zeros_like(q)
    for k in range(1, len(q)):
        inside[k] = min(max(inside[k - 1] + q[k] - q[k - 1], -0.5 * play), 0.5 * play)
    return inside


def _held(m: Track, p, base) -> np.ndarray:
    """The share that lies behind the play is not felt while it is crossed; smooth over 5 % of the play at its edges, so
    that a fit sees which way to go."""
    if p.play <= 0.0:
        return np.zeros_like(m.q)
    free = np.clip((0.5 * p.play - np.abs(dragged(m.q, p.play))) / (0.05 * p.play), 0.0, 1.0)
    return -p.share * base(m.q, m.v, m.a) * free


standard(
    DriveEffect(
        "play", "Part of the load is not felt while the play is crossed after a reversal; friction holds it meanwhile.",
        "F -= s f inside the play g, x(t) = min(max(x, q - g/2), q + g/2)",
        "play operator, e.g. Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989)",
        (
            Size("play", "total play g", "Q", (0.005, 0.03, 0.1), 0.0, 1.0, 0.0),
            Size("share", "share s of the force that lies behind it", "", (0.5,), 0.05, 1.0, step=0.2),
        ),
        _held, of_base=True, load="unseen", alike=("friction.presliding", "play.contact"),
    )
)  # fmt: skip


def entry(fingerprint: str):
    """The compiled `carried`; `fingerprint` stands for the kernels that it calls in the key of numba's cache."""

    @njit(cache=True)
    def carried(
        q: np.ndarray, v: np.ndarray, step: float, play: float, dry: float, omega: float, damping: float, law: int,
        out: np.ndarray,
    ) -> str:  # fmt: skip
        """Contact force over mass of a load behind play, into out (n,): ẍ = M(q - x, q̇ - ẋ) - d sign(ẋ), advanced by
        Moreau's time-stepping, eight steps to a sample, and averaged over the sample that each is the middle of; the
        contact is that of `indexer_env.kernels.joints`, with stiffness ω² and damping 2 ζ ω per mass."""
        x, y, sub = q[0], v[0], 8
        h = step / sub
        stiffness_1, damping_1, edge = omega * omega, 2.0 * damping * omega, 0.5 * play
        before = 0.0
        for k in range(len(q) - 1):
            early, late = 0.0, 0.0
            for i in range(sub):
                share = i / sub
                d = q[k] + share * (q[k + 1] - q[k]) - x
                rate = v[k] + share * (v[k + 1] - v[k]) - y
                region = 1.0 if d > edge else (-1.0 if d < -edge else 0.0)
                stiffness, offset, r = region_line(
                    region, stiffness_1, damping_1, edge, 1.0, damping_1 if law == 2 else 0.0
                )
                force = line_torque(stiffness, offset, r, d, rate, 0.0)
                if law == 0 and region * force < 0.0:
                    force = 0.0
                y += h * force
                y = max(y - h * dry, 0.0) if y > 0.0 else min(y + h * dry, 0.0)
                x += h * y
                if 2 * i < sub:
                    early += force
                else:
                    late += force
            out[k] = (before + early) / (sub if k > 0 else 0.5 * sub)
            before = late
        out[-1] = before / (0.5 * sub)
        return fingerprint

    return carried


@functools.cache
def contact() -> Callable[..., str]:
    """The compiled `carried`."""
    return entry(kernel_fingerprint())


def _contact(m: Track, p, base) -> np.ndarray:
    if p.play <= 0.0:
        return np.zeros_like(m.q)
    mass = p.share * _mass(m, base)
    if mass <= 0.0:
        return np.zeros_like(m.q)
    return mass * (_carried(m, p.play, p.friction / mass, int(p.law)) - _without_play(m, int(p.law)))


def _carried(m: Track, play: float, dry: float, law: int) -> np.ndarray:
    """Contact force over mass (n,) of a load behind play."""
    omega = 2.0 * math.pi * _CONTACT * 0.5 / m.step
    out = np.empty_like(m.q)
    contact()(m.q, m.v, m.step, play, dry, omega, 0.5, law, out)
    return out


@functools.lru_cache(maxsize=64)
def _without_play(m: Track, law: int) -> np.ndarray:
    """The same of a load without play or friction: its acceleration as the contact gives it and not as measured, whose
    error would seem to be there for any play and gone for none."""
    return _carried(m, 0.0, 0.0, law)


standard(
    DriveEffect(
        "play.contact", "Part of the mass, with dry friction of its own, lies behind play and strikes its flanks.",
        "F += M - s m a, s m ẍ = M(q - x, v - ẋ) - F_l sign(ẋ), with play g and a stiff contact",
        "the joint of the indexing machine: docs/explanation/physics.md, section Joints",
        (
            Size("play", "total play g", "Q", (0.003, 0.02), 0.0, 1.0, 0.0, 0.005),
            Size("share", "share s of the mass that lies behind it", "", (0.4, 0.8), 0.05, 1.0, step=0.2),
            Size("friction", "dry friction F_l of that part", "F", (0.02, 0.3), 0.0, 20.0, step=0.1),
        ),
        _contact, of_base=True, load="unseen", alike=("play", "compliance"), forward="play",
        limits=(CoulombFriction.name,),
        choices=tuple({"law": float(k)} for k in range(len(LAWS))),
    )
)  # fmt: skip


def _rung(m: Track, left: np.ndarray) -> list[tuple[float, float, float]]:
    """Starts at the frequencies at which the record rings: a fit of a lightly damped one reaches no further than its
    resonance is wide."""
    return [(0.5, 1.0 / omega**2, 0.05) for _, omega, _ in ringing(m, left)]


def _swings(m: Track, p) -> bool:
    """Whether samples can follow the load on its spring."""
    limit = 0.5 * BRACKET_LIMIT / m.step
    return p.share > 0.0 and 1.0 / (2.0 * math.pi * math.sqrt(p.inverse_square)) < limit


def _compliance(m: Track, p, base) -> np.ndarray:
    if not _swings(m, p):
        return np.zeros_like(m.q)
    frequency = 1.0 / (2.0 * math.pi * math.sqrt(p.inverse_square))
    felt = filtered(bracket_sections(frequency, p.damping, 1.0 / m.step), m.a[None])[0]
    return p.share * (base(m.q, m.v, felt) - base(m.q, m.v, m.a))


def _ringing_down(m: Track, p, base) -> np.ndarray:
    """The load's free swing from the record's first sample, of a speed beside the joint's of the motion's rms."""
    if not _swings(m, p):
        return np.zeros((0, len(m.q)))
    omega = 1.0 / math.sqrt(p.inverse_square)
    t, beside = m.t - m.t[0], math.sqrt(1.0 - p.damping**2)
    size = omega * float(np.sqrt(np.mean(m.v**2)))
    waves = np.stack([np.cos(omega * beside * t), np.sin(omega * beside * t)]) * np.exp(-p.damping * omega * t)
    return p.share * _mass(m, base) * size * waves


def _mass(m: Track, base) -> float:
    """Mass of the model: how its force grows with the acceleration."""
    size = float(np.std(m.a))
    return float(np.median(base(m.q, m.v, m.a + size) - base(m.q, m.v, m.a))) / size


standard(
    DriveEffect(
        "compliance", "Part of the mass hangs on a spring behind the measured motion.",
        "F += s (f(q, v, ẍ) - f(q, v, a)), ẍ + 2 ζ ω (ẋ - v) + ω² (x - q) = 0",
        "two-mass drive, e.g. Leonhard, Control of Electrical Drives (2001), chapter on coupled masses",
        (
            Size("share", "share s of the mass on the spring", "", (0.3, 0.7), 0.0, 1.0, 0.0, 0.2),
            Size("inverse_square", "1/ω² of the mass on its spring", "T2", (0.001, 0.01, 0.06, 0.3), 1e-6, 4.0,
                 step=0.003),
            Size("damping", "damping ratio ζ", "", (0.05,), 0.005, 0.9, step=0.05),
        ),
        _compliance, of_base=True, load="unseen", alike=("delay", "play.contact"), starts=_rung,
        begins=_ringing_down, forward="soft",
    )
)  # fmt: skip


def _wavering(m: Track, p, base) -> np.ndarray:
    n = p.order
    s, c = np.sin(n * m.q + p.phase), np.cos(n * m.q + p.phase)
    e, first, second = p.amplitude * s, p.amplitude * n * c, -p.amplitude * n * n * s
    moved = base(m.q + e, m.v * (1.0 + first), m.a * (1.0 + first) + second * m.v**2)
    return (1.0 + first) * moved - base(m.q, m.v, m.a)


standard(
    DriveEffect(
        TransmissionError.name, "The load's angle wavers about the measured one at an order of the gears.",
        "F += x' f(x, ẋ, ẍ) - f(q, v, a), x = q + e sin(n q + φ), x' = dx/dq",
        TransmissionError.source,
        (
            Size("amplitude", "amplitude e", "Q", (0.003, 0.03), 0.0, 0.2, 0.0),
            Size("phase", "phase φ at q = 0", "", PHASES, -20.0, 20.0, step=0.5),
        ),
        _wavering, rotary=True, placed=True, of_base=True, forward="error",
        alike=("ripple", "cogging", "inertia.position"),
        choices=tuple({"order": float(n)} for n in (1, 2, 3, 4)),
    )
)  # fmt: skip
