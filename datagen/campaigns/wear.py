"""Run to failure: the play of the reducer grows turn by turn until it is too much (column `remaining_turns`).

Each life has its own machine, first play g_0, lifetime of N turns and speed-up q of its wear. Wear is faster the more
play there is, because teeth that have room hit each other: dg/dn = a + b g, which from g_0 to the play g_N at which the
machine counts as failed is

    g(n) = g_0 + (g_N - g_0) (q^(n/N) - 1) / (q - 1),   q = (dg/dn at failure) / (dg/dn when new),   linear for q = 1.

So any record can be made without the turns before it; within a record the play stays what it is. Item i is record
i mod R of life i // R.
"""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from datagen.campaign import Base, Campaign, Design
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from indexer_env.faults import BACKLASH_DEG
from indexer_env.law_reader import law_of_field, make_law
from indexer_env.laws import Fixed, Law, Sobol

BACKLASH = "faults.backlash"
_BACKLASHES = ("first_backlash_deg", "last_backlash_deg")


def play_after(share: float, first: float, last: float, speed_up: float) -> float:
    """g at the share n/N of a life, 0 … 1, in the unit of `first` and `last`."""
    growth = math.log(speed_up)
    grown = share if growth == 0.0 else math.expm1(growth * share) / math.expm1(growth)
    return first + (last - first) * grown


@dataclass(frozen=True, kw_only=True)
class Wear(Campaign):
    """Settings of the family, besides those of `Campaign`. The laws are drawn once for each life.

    Attributes
    ----------
    lives : int
        Machines run to failure in the whole campaign, >= 1.
    records_per_life : int or None
        Records of each life, >= 1, evenly from the first turn to the one at which it fails.
    turns : sequence of int or None
        Turns after which each life is recorded, >= 0, in place of records_per_life; a life that has failed by then
        gives a rejected item.
    first_backlash_deg, last_backlash_deg : law
        g_0 and g_N at the MOTOR shaft [degrees], added to what the machine has.
    life_turns : law
        N [turns], rounded to a whole number >= 1.
    speed_up : law
        q [-], > 0; 1 is wear at an even rate.
    """

    name: ClassVar[str] = "wear"
    lengths: ClassVar[tuple[str, ...]] = ("lives",)

    lives: int
    first_backlash_deg: Any
    last_backlash_deg: Any
    life_turns: Any
    speed_up: Any
    records_per_life: int | None = None
    turns: Sequence[int] | None = None

    def __post_init__(self) -> None:
        check_integer("campaign", "lives", self.lives, low=1)
        if (self.turns is None) == (self.records_per_life is None):
            rule = "given where records_per_life is null, and null where it is given"
            raise refuse("campaign", "turns", rule, self.turns)
        if self.records_per_life is not None:
            check_integer("campaign", "records_per_life", self.records_per_life, low=1)
        if self.turns is not None:
            self._check_turns(self.turns)
        ranges = {**dict.fromkeys(_BACKLASHES, BACKLASH_DEG), "life_turns": {"low": 1.0}, "speed_up": {"low": 1e-6}}
        for key, bounds in ranges.items():
            for value in make_law("campaign", key, getattr(self, key)).extremes:
                check_number("campaign", key, value, **bounds)
        first, last = (max(self.life_laws["first_backlash"].extremes), min(self.life_laws["last_backlash"].extremes))
        if first > last:
            raise refuse(
                "campaign", "last_backlash_deg", "a law that lies above first_backlash_deg", self.last_backlash_deg
            )
        super().__post_init__()

    @staticmethod
    def _check_turns(turns: object) -> None:
        if not isinstance(turns, list | tuple) or not turns:
            raise refuse("campaign", "turns", "a list of turns", turns)
        for turn in turns:
            check_integer("campaign", "turns", turn, low=0, unit="turns")

    @functools.cached_property
    def life_laws(self) -> dict[str, Law]:
        """Law of what each life has of its own, by name, in SI units."""
        laws: dict[str, Law] = {}
        names = ("first_backlash", "last_backlash", "life_turns", "speed_up")
        for key in (*_BACKLASHES, "life_turns", "speed_up"):
            name, law = law_of_field("campaign", key, getattr(self, key), names)
            if isinstance(law, Sobol) or law.needs_nominal:
                raise refuse("campaign", key, "a law other than sobol and {around: share}", law)
            laws[name] = law
        return laws

    @property
    def per_life(self) -> int:
        """Items of each life."""
        return len(self.turns) if self.turns is not None else self.records_per_life or 0

    @property
    def decides(self) -> tuple[str, ...]:
        return (BACKLASH,)

    @property
    def size(self) -> int:
        return self.lives * self.per_life

    @property
    def different(self) -> int:
        drawn = not all(isinstance(law, Fixed) for law in self.life_laws.values())
        return sys.maxsize if drawn else self.per_life

    def machine_draw(self, index: int) -> int:
        return index // self.per_life

    def design(self, index: int, rng: np.random.Generator, base: Base) -> Design:
        own = {name: law.draw(rng) for name, law in self.life_laws.items()}
        life, place = max(1, round(own["life_turns"])), index % self.per_life
        turn = self.turns[place] if self.turns is not None else round(life * place / max(1, self.per_life - 1))
        if turn > life:
            refused = f"campaign.turns must be <= {life} turns, which this machine lives, got {turn}."
            return Design({BACKLASH: own["last_backlash"]}, 0, refused)
        play = play_after(turn / life, own["first_backlash"], own["last_backlash"], own["speed_up"])
        return Design({BACKLASH: play}, life - turn)
