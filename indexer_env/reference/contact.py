"""One joint with play and bilinear stiffness: where its regions end, and its straight line in each.

With x = δ - g/2 at the positive flank and x = -δ - g/2, v = -δ̇, ρk for k at the negative one
(docs/explanation/physics.md)::

    clipped          M = k x + r v while x > 0 and k x + r v > 0 (pushes; with hardening k x + k_c x³ + r v)
    kelvin_voigt     M = k x + r v while x > 0
    damped_play      the same, and r δ̇ inside the play
    without play     M = k δ + r δ̇ for δ > 0, ρ k δ + r δ̇ for δ < 0; nothing separates
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Contact:
    """A joint as the reference solver sees it.

    Attributes
    ----------
    stiffness, damping, play, ratio : float
        k [N m/rad], r [N m s/rad], total play g [rad], ρ [-].
    law : str
        Contact law, of machine.CONTACT_LAWS.
    edged : bool
        False for a joint that is one straight line for all deflections: its region is always +1.
    cubic : float
        k_c [N m/rad³], acts in contact.
    """

    stiffness: float
    damping: float
    backlash: float
    ratio: float
    law: str
    edged: bool
    cubic: float = 0.0

    def depths(self, deflection: float, rate: float) -> tuple[float, float]:
        """How deep in contact the joint is at its positive and at its negative flank [rad]; < 0: not in contact.

        Under the clipped law a flank that withdraws is deep by the push that is left, (k x + k_c x³ + r v)/k.
        """
        plus, minus = deflection - 0.5 * self.backlash, -deflection - 0.5 * self.backlash
        if self.law == "clipped" and self.backlash > 0.0:
            softer = self.ratio * self.stiffness
            plus += (self.cubic * plus**3 + self.damping * min(rate, 0.0)) / self.stiffness
            minus += (self.cubic * minus**3 + self.damping * min(-rate, 0.0)) / softer
        return plus, minus

    def region(self, deflection: float, rate: float) -> int:
        """+1 in contact at the positive flank, -1 at the negative one, 0 inside the play."""
        plus, minus = self.depths(deflection, rate)
        if not self.edged or plus >= 0.0:
            return 1
        return -1 if minus >= 0.0 else 0

    def guard(self, region: int, deflection: float, rate: float) -> float:
        """Distance to the end of the region [rad], < 0 beyond it."""
        plus, minus = self.depths(deflection, rate)
        return plus if region > 0 else minus if region < 0 else -max(plus, minus)

    def region_after(self, region: int, deflection: float, rate: float) -> int:
        """The region entered when `region` ends at this deflection and rate."""
        if region == 0:
            plus, minus = self.depths(deflection, rate)
            return 1 if plus > minus else -1
        return 0 if self.backlash > 0.0 else -region

    def line(self, region: int) -> tuple[float, float, float, float]:
        """(k, offset, r, k_c) of a region: M = (k + k_c x²) x + r δ̇, x = δ - offset."""
        if region == 0:
            return 0.0, 0.0, self.damping if self.law == "damped_play" else 0.0, 0.0
        stiffness = self.stiffness if region > 0 else self.ratio * self.stiffness
        return stiffness, 0.5 * region * self.backlash, self.damping, self.cubic
