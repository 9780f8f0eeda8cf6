"""Machines drawn by laws: whatever a machine, its faults, effects, operating point and sensor are made of.

Items i · repeats … i · repeats + repeats - 1 are the repeats on machine draw i. Their classes are those of the faults
that were drawn (`datagen.labels`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from datagen.campaign import Campaign
from indexer_env.checks import check_integer


@dataclass(frozen=True, kw_only=True)
class Random(Campaign):
    """Settings of the family, besides those of `Campaign`.

    Attributes
    ----------
    machines : int
        Machine draws of the whole campaign, >= 1.
    repeats : int
        Records of each machine, >= 1.
    """

    name: ClassVar[str] = "random"
    lengths: ClassVar[tuple[str, ...]] = ("machines",)

    machines: int
    repeats: int = 1

    def __post_init__(self) -> None:
        check_integer("campaign", "machines", self.machines, low=1)
        check_integer("campaign", "repeats", self.repeats, low=1)
        super().__post_init__()

    @property
    def size(self) -> int:
        return self.machines * self.repeats

    def machine_draw(self, index: int) -> int:
        return index // self.repeats
