"""Errors of the cam's profile and of the turret's spacing."""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from indexer_env.effects.base import LEAST_HALF_WIDTH, MachineEffect, Sought, ladder, parameter, register
from indexer_env.errors import refuse

if TYPE_CHECKING:
    from indexer_env.machine import Machine


_PLACES = tuple(0.1 + 0.07 * k for k in range(13))
"""Cam phases at which a bump is looked for, over the one at which the table comes to rest."""


@register
@dataclass(frozen=True)
class ProfileError(MachineEffect):
    """A local bump on the cam's track: the same at every station, once per cam turn."""

    name = "cam.profile_error"
    sentence = "A local bump on the cam's track disturbs every index at the same cam angle."
    equation = "β += A (1 - y²)⁴ for |y| < 1, y = (cam phase - centre)/half_width; β', β'' with it"
    source = "own choice: smooth bump with three continuous derivatives"
    enters = "motion law"

    height: float = parameter(
        "height A, at the follower",
        "rad",
        null=0.0,
        low=-0.05,
        high=0.05,
        sought=Sought("deflection", ladder(0.08, 5, 2.0, both=True), 0.05, -16.0, 16.0),
    )
    centre: float = parameter(
        "cam phase of the bump",
        "turns",
        default=0.25,
        low=0.0,
        high=1.0,
        sought=Sought("motion", _PLACES, 0.04, 0.0, 1.0),
    )
    half_width: float = parameter(
        "half width of the bump",
        "turns",
        default=0.05,
        low=LEAST_HALF_WIDTH,
        high=0.5,
        sought=Sought("-", (0.06, 0.12), 0.03, 0.01, 0.3),
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        coefficients["bump_height"] = self.height
        coefficients["bump_centre"] = self.centre
        coefficients["bump_half_width"] = self.half_width


@register
@dataclass(frozen=True)
class StationSpacing(MachineEffect):
    """One station of the turret stands off its place: the index to it is longer, the next one shorter."""

    name = "cam.station_spacing"
    sentence = "One station stands off its place, so that one index is longer and the next one shorter."
    equation = "advance to the station h + e, away from it h - e, each with the same normalised law"
    source = "geometry of the turret"
    enters = "motion law"

    error: float = parameter(
        "angular error e of the station",
        "rad",
        null=0.0,
        low=-0.05,
        high=0.05,
        sought=Sought("deflection", ladder(0.16, 5, both=True), 0.16),
    )
    station: int = parameter(
        "station, 0 the one the table starts from", "-", default=1, low=0, whole=True, sought=Sought("-")
    )

    def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
        if self.station >= machine.stations:
            raise refuse(self.name, "station", f"below the machine's {machine.stations} stations", self.station)
        if abs(self.error) >= machine.advance:
            pitch = f"the pitch of the machine's {machine.stations} stations, {machine.advance:.4g} rad"
            raise refuse(self.name, "error", f"smaller, either way, than {pitch}", self.error)
        coefficients["spacing_error"] = self.error
        coefficients["spacing_station"] = float(self.station)
