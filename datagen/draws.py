"""What a campaign draws: a law for each varied quantity, and how often each drawn effect is there at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from datagen.quantities import laws_by_path
from indexer_env.checks import check_number
from indexer_env.effects import effects_by_name
from indexer_env.errors import ParameterError, refuse
from indexer_env.laws import Law, Sobol

PROBABILITY = "probability"
"""Key beside the parameters of a drawn effect: how likely it is there; 1 where it is not given."""


@dataclass(frozen=True)
class Draws:
    """Laws of varied quantities.

    Attributes
    ----------
    laws : mapping
        Law by path (`datagen.quantities`), in the order in which they are drawn.
    probabilities : mapping
        How likely each drawn effect is there [-], by its name.
    """

    laws: Mapping[str, Law]
    probabilities: Mapping[str, float]

    @classmethod
    def of(cls, mapping: object, owner: str) -> Draws:
        """From YAML: sections of quantities with their laws; an effect may have a `probability`.

        Raises
        ------
        ParameterError
            Whatever `laws_by_path` refuses, or a probability that is none.
        """
        if not isinstance(mapping, Mapping):
            raise ParameterError(f"{owner} must be a mapping of quantities to laws, got {mapping!r}.")
        sections = dict(mapping)
        probabilities: dict[str, float] = {}
        if isinstance(sections.get("effects"), Mapping):
            effects = effects_by_name(sections["effects"])
            for name, parameters in effects.items():
                if not isinstance(parameters, Mapping):
                    continue  # laws_by_path says what is wrong with it
                probability = parameters.get(PROBABILITY, 1.0)
                check_number(f"{owner}.effects.{name}", PROBABILITY, probability, low=0.0, high=1.0, unit="-")
                probabilities[name] = float(probability)
                effects[name] = {key: law for key, law in parameters.items() if key != PROBABILITY}
                if not effects[name]:
                    raise refuse(f"{owner}.effects", name, "a mapping of its parameters to values or laws", parameters)
            sections["effects"] = effects
        return cls(laws_by_path(sections, owner), probabilities)

    @property
    def dimensions(self) -> int:
        """Dimensions of the Sobol' sequence: one for each quantity with a sobol law."""
        return sum(isinstance(law, Sobol) for law in self.laws.values())

    def drawn(
        self, rng: np.random.Generator, nominal: Callable[[str], float], point: Sequence[float] = ()
    ) -> dict[str, Any]:
        """Value by path. Laws take one number each of `rng` in turn, then effects, whether they are there or not. So
        other numbers or another kind of a law shift no other quantity, but for a sobol law and a fixed value, which
        take none; a law more or less shifts those after it.

        `nominal(path)` is asked where a law is relative to it; `point` is the point of the Sobol' sequence.
        """
        coordinates = iter(point)
        values: dict[str, Any] = {}
        for path, law in self.laws.items():
            if isinstance(law, Sobol):
                values[path] = law.at(next(coordinates))
            else:
                values[path] = law.draw(rng, nominal(path) if law.needs_nominal else None)
        absent = [name for name, probability in self.probabilities.items() if rng.random() >= probability]
        return {path: value for path, value in values.items() if effect_of(path) not in absent}


def effect_of(path: str) -> str | None:
    """The effect that a path leads into, None for any other path: "friction.coulomb"."""
    section, _, rest = path.partition(".")
    return rest.rpartition(".")[0] if section == "effects" else None
