"""Torque of one joint: four shapes in one, and the regions between their edges.

For a deflection δ with rate δ̇ (docs/explanation/physics.md, section Joints; the paper, fig. 3)::

    M = k (δ - g/2) + r δ̇   for δ > g/2        region +1
    M = ρ k (δ + g/2) + r δ̇ for δ < -g/2       region -1
    M = 0 (or r δ̇)          inside the play    region  0

Within a region the torque is one straight line, so a step that stays in its region integrates a smooth system; the
integrator lands on the edges between them. Three contact laws differ only in the edges and in the free damping:
Kelvin-Voigt leaves contact where δ = ±g/2; the clipped law already where the torque would begin to pull,
k x + k_c x³ + r δ̇ = 0; damped play keeps r δ̇ inside the play.
"""

from __future__ import annotations

from .compiling import scalar


@scalar
def penetration_plus(deflection, rate, edge, release, hardening):
    """Depth of contact at the positive flank [rad]: >= 0 in contact. For the clipped law it is the push left over k:
    `release` = r/k [s], `hardening` = k_c/k [1/rad²]; else both are 0."""
    x = deflection - edge
    return x + hardening * x * x * x + release * min(rate, 0.0)


@scalar
def penetration_minus(deflection, rate, edge, release_minus, hardening_minus):
    """Depth of contact at the negative flank [rad]; its stiffness is ρ k in place of k."""
    x = -deflection - edge
    return x + hardening_minus * x * x * x + release_minus * min(-rate, 0.0)


@scalar
def region_of(deflection, rate, edge, release, hardening, release_minus, hardening_minus):
    """Contact region (+1, -1 or 0) of a state that carries no history, of a joint that has edges."""
    if penetration_plus(deflection, rate, edge, release, hardening) >= 0.0:
        return 1.0
    if penetration_minus(deflection, rate, edge, release_minus, hardening_minus) >= 0.0:
        return -1.0
    return 0.0


@scalar
def region_guard(region, deflection, rate, edge, release, hardening, release_minus, hardening_minus):
    """Distance to the edges of the present region [rad]: > 0 inside it, < 0 once it has been left."""
    plus = penetration_plus(deflection, rate, edge, release, hardening)
    minus = penetration_minus(deflection, rate, edge, release_minus, hardening_minus)
    free = -max(plus, minus)
    contact = plus if region > 0.0 else minus
    return free if region == 0.0 else contact


@scalar
def region_after(region, deflection, edge):
    """Region entered when the guard of `region` has run out at `deflection`; without play contact passes over."""
    if region == 0.0:
        return 1.0 if deflection > 0.0 else -1.0
    return -region if edge == 0.0 else 0.0


@scalar
def region_line(region, stiffness, damping, edge, ratio, free_damping):
    """The line (stiffness, offset, damping) of a region: M = stiffness (δ - offset) + damping δ̇."""
    if region > 0.0:
        return stiffness, max(edge, 0.0), damping
    if region < 0.0:
        return ratio * stiffness, -edge, damping
    return 0.0, 0.0, free_damping


@scalar
def line_torque(stiffness, offset, damping, deflection, rate, cubic):
    """Torque on a joint's line [N m], with a cubic hardening [N m/rad³] where there is one."""
    x = deflection - offset
    return (stiffness * x + damping * rate) + cubic * x * (x * x)


@scalar
def straight_torque(stiffness, offset, damping, deflection, rate):
    """The same without hardening."""
    return stiffness * (deflection - offset) + damping * rate
