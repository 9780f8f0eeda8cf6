"""The laws by which a campaign draws numbers; YAML names one beside every drawn quantity."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from indexer_env.build import from_mapping
from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse


class Law(ABC):
    """A law of chance for one number."""

    @abstractmethod
    def draw(self, rng: np.random.Generator, nominal: float) -> float:
        """One value for a quantity whose nominal value is `nominal`, in the same unit; takes the same amount
        from `rng` whatever `nominal` is, so that one drawn quantity never shifts another."""


@dataclass(frozen=True)
class UniformAround(Law):
    """nominal · (1 + w u), u uniform in [−1, 1): the ±10 % of the paper for w = 0.1 (paper.txt, section 4.1).

    Attributes
    ----------
    half_width : float
        w, relative half-width [-], >= 0; 0 keeps the nominal value.
    """

    half_width: float

    def __post_init__(self) -> None:
        check_number("UniformAround", "half_width", self.half_width, low=0.0, unit="-", remedy="0.1 stands for ±10 %")

    def draw(self, rng: np.random.Generator, nominal: float) -> float:
        return nominal * (1.0 + self.half_width * float(rng.uniform(-1.0, 1.0)))


LAWS: dict[str, type[Law]] = {"uniform_around": UniformAround}
"""Law by name: `{law: uniform_around, half_width: 0.1}`."""


def make_law(mapping: object, owner: str) -> Law:
    """The law of a mapping `{law: NAME, ...parameters}`; `owner` (the drawn quantity) begins the sentence of
    an error."""
    if not isinstance(mapping, Mapping) or "law" not in mapping:
        raise refuse(owner, "law", "a mapping {law: NAME, ...}", mapping, f"NAME is one of {', '.join(LAWS)}")
    check_choice(owner, "law", mapping["law"], LAWS)
    parameters = {key: value for key, value in mapping.items() if key != "law"}
    return from_mapping(LAWS[mapping["law"]], parameters, owner=owner)
