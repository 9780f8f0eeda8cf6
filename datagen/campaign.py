"""A campaign: which machine, operating point, sensor and label each item of a data set has.

An `Item` is data, not a machine: the label and the values that differ from the base, by dotted path
("output_joint.backlash"). `build` turns it into what can be simulated, or says why it cannot be (the item is
then recorded as rejected). Each family of campaigns is one file in `campaigns/`, listed in
`datagen.campaigns.CAMPAIGNS`.
"""

from __future__ import annotations

import dataclasses
import functools
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, ClassVar

import numpy as np

from datagen.base import Base, base_value, fault_values
from datagen.changes import with_changes
from datagen.draws import Draws
from datagen.labels import FAULT_CLASSES, SUBSETS, fault_class, subset_schedule
from datagen.quantities import SECTIONS
from datagen.seeds import Chance
from indexer_env.effects import MachineEffect, SensorEffect, make_effect
from indexer_env.errors import ParameterError, refuse
from indexer_env.faults import Faults, severities
from indexer_env.machine import Machine
from indexer_env.motion_law import motion_law
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor

__all__ = ["SUBSETS", "Base", "Campaign", "Case", "Design", "Item", "Label", "build"]


@dataclass(frozen=True)
class Label:
    """What an item is an example of.

    Attributes
    ----------
    number : int
        Class, from 1.
    name : str
        The class in words.
    code : str
        The network's target, one character 0 or 1 per output.
    subset : str
        One of SUBSETS; items that share a machine draw share the subset.
    machine_draw : int
        Which machine of the data set; items with the same number are repeats on the same machine.
    remaining_turns : int or None
        Turns of the table until the machine fails, >= 0; None where it is not run to failure.
    """

    number: int
    name: str
    code: str
    subset: str
    machine_draw: int
    remaining_turns: int | None = None


@dataclass(frozen=True)
class Item:
    """One record to be: its number, its label and what differs from the base, by dotted path, SI units.

    `effects` holds parameters by effect; `refused` says why the item cannot be, empty where nothing is known
    against it.
    """

    index: int
    label: Label
    machine: Mapping[str, Any] = field(default_factory=dict)
    faults: Mapping[str, Any] = field(default_factory=dict)
    operating_point: Mapping[str, Any] = field(default_factory=dict)
    sensor: Mapping[str, Any] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    refused: str = ""

    @classmethod
    def of(cls, index: int, label: Label, values: Mapping[str, Any], refused: str = "") -> Item:
        """From values by path (`datagen.quantities`)."""
        parts: dict[str, dict[str, Any]] = {section: {} for section in SECTIONS}
        for path, value in values.items():
            section, _, rest = path.partition(".")
            parts[section][rest] = value
        effects: dict[str, dict[str, Any]] = {}
        for path, value in parts.pop("effects").items():
            name, _, parameter = path.rpartition(".")
            effects.setdefault(name, {})[parameter] = value
        return cls(index, label, **parts, effects=effects, refused=refused)


@dataclass(frozen=True)
class Case:
    """An item ready to be simulated and read; `machine` already carries the faults. `severities` says by fault how
    severe it is in all, with the machine's own effects that are such faults."""

    item: Item
    machine: Machine
    operating_point: OperatingPoint
    faults: Faults
    severities: Mapping[str, Any]
    sensor: Sensor


@dataclass(frozen=True)
class Design:
    """What a family decides of an item before anything is varied: values by path (`datagen.quantities`), the turns
    left and why the item cannot be."""

    values: Mapping[str, Any] = field(default_factory=dict)
    remaining_turns: int | None = None
    refused: str = ""


@dataclass(frozen=True, kw_only=True)
class Campaign(ABC):
    """A family of data sets; frozen, configured from YAML, without state.

    An item is the base, on it what the family decides (`design`), on that what is drawn once for its machine
    (`draws`), on that what is drawn for the item alone (`drift`); a law around a nominal value is around what stands
    there before it.

    Attributes
    ----------
    draws, drift : mapping
        Laws of what is varied, as `Draws.of` takes them.
    split : mapping
        Machine draws of each subset, as `subset_schedule` takes them.
    """

    name: ClassVar[str]
    lengths: ClassVar[tuple[str, ...]] = ()
    """Settings that say how many items there are, and change none of them."""
    example_index: ClassVar[int] = 0
    """The item whose label the example file has."""

    draws: Mapping[str, Any] = field(default_factory=dict)
    drift: Mapping[str, Any] = field(default_factory=dict)
    split: Mapping[str, Any] = field(default_factory=lambda: dict.fromkeys(SUBSETS, 1))

    def __post_init__(self) -> None:
        for key, stage in (("draws", self.machine_laws), ("drift", self.item_laws)):
            for path, law in stage.laws.items():
                if path in self.decides and not law.needs_nominal:
                    rule = f"left out or {{around: share}}, as the campaign {self.name} decides it"
                    raise refuse(f"campaign.{key}", path, rule, law)
        for path, law in self.item_laws.laws.items():
            if path in self.machine_laws.laws and not law.needs_nominal:
                raise refuse("campaign.drift", path, "{around: share}, as the campaign draws it for each machine", law)
        if self.item_laws.dimensions or self.item_laws.probabilities:
            raise refuse("campaign", "drift", "free of effects and of sobol laws", self.drift, "put them into draws")
        _ = self._schedule

    @property
    @abstractmethod
    def size(self) -> int:
        """Items of the whole campaign; a data set may have fewer or go on with more."""

    @property
    def decides(self) -> tuple[str, ...]:
        """Quantities, by path, that every item gets from its family: the base's are not used."""
        return ()

    @property
    def refines(self) -> tuple[str, ...]:
        """Those of them that a preset states, too, because the family draws what it leaves open about it."""
        return ()

    def check_base(self, base: Base) -> None:  # noqa: B027  most families can label any base
        """Raise ParameterError for a base whose items would not be what their labels say."""

    @property
    def different(self) -> int:
        """Items that differ where nothing is drawn: those of one machine draw."""
        return 1

    @abstractmethod
    def machine_draw(self, index: int) -> int:
        """Number of the machine of item `index`, from 0."""

    def machine_number(self, index: int) -> int:
        """What the column `machine_draw` tells of item `index`: the same for all items of one machine."""
        return self.machine_draw(index)

    def split_number(self, index: int) -> int:
        """Number by which item `index` gets its subset; equal for all items of a machine."""
        return self.machine_draw(index)

    def design(self, index: int, rng: np.random.Generator, base: Base) -> Design:
        """What the family decides of item `index`; `rng` is its machine's own stream, from its beginning, and `base`
        what all items begin with."""
        return Design()

    def classes(self) -> tuple[str, ...]:
        """Names of the classes, class 1 first."""
        return FAULT_CLASSES

    def classify(self, index: int, values: Mapping[str, Any], base: Base) -> tuple[int, str, str]:
        """Class from 1, name and code of item `index`, whose quantities have these values, by path."""
        return fault_class(values)

    def varies(self, path: str, design: Design) -> bool:
        """Whether what was drawn for this quantity is for an item of this design."""
        return True

    @functools.cached_property
    def machine_laws(self) -> Draws:
        """What is drawn once for a machine."""
        return Draws.of(self.draws, "campaign.draws")

    @functools.cached_property
    def item_laws(self) -> Draws:
        """What is drawn for each item."""
        return Draws.of(self.drift, "campaign.drift")

    @functools.cached_property
    def _schedule(self) -> tuple[str, ...]:
        return subset_schedule(self.split, "campaign.split")

    def item(self, index: int, base: Base, seed: int) -> Item:
        """Item `index` of the data set with this seed; depends on nothing else."""
        return self.draw(index, base, Chance(seed))

    def example(self, base: Base, seed: int) -> Item:
        """An item drawn apart from all items of this seed."""
        return self.draw(self.example_index, base, Chance(seed, example=True))

    def draw(self, index: int, base: Base, chance: Chance) -> Item:
        """Item `index` (from 0), all its chance taken from `chance`."""
        machine_draw = self.machine_draw(index)
        rng = chance.machine(machine_draw)
        design = self.design(index, rng, base)
        values = dict(design.values)

        def nominal(path: str) -> float:
            return _number(values[path] if path in values else base_value(base, path), path)

        point = chance.point(machine_draw, self.machine_laws.dimensions)
        drawn = self.machine_laws.drawn(rng, nominal, point)
        values |= {path: value for path, value in drawn.items() if self.varies(path, design)}
        if self.item_laws.laws:
            drifted = self.item_laws.drawn(chance.record(index), nominal)
            values |= {path: value for path, value in drifted.items() if self.varies(path, design)}
        subset = self._schedule[self.split_number(index) % len(self._schedule)]
        classified = self.classify(index, {**fault_values(base), **values}, base)
        label = Label(*classified, subset, self.machine_number(index), design.remaining_turns)
        return Item.of(index, label, values, design.refused)


def build(item: Item, base: Base) -> Case:
    """The machine of an item, its faults put in, and the sensor that reads it.

    Raises
    ------
    ParameterError
        The item's values break a rule of Machine, Joint, Faults, OperatingPoint, Sensor or an effect, or its campaign
        refuses it.
    """
    if item.refused:
        raise ParameterError(item.refused)
    changes = dict(item.machine)
    if "motion_law" in changes:
        changes["motion_law"] = motion_law(changes["motion_law"])
    machine = with_changes(base.machine, changes)
    sensor = with_changes(base.sensor, item.sensor)
    for name, parameters in item.effects.items():
        own = next((effect for effect in machine.effects if effect.name == name), None)
        effect = dataclasses.replace(own, **parameters) if own else make_effect(name, parameters)
        if isinstance(effect, SensorEffect):
            sensor = effect.extend_sensor(sensor)
        elif isinstance(effect, MachineEffect):
            machine = machine.with_effects(effect)
    faults = with_changes(base.faults, item.faults)
    point = with_changes(base.operating_point, item.operating_point)
    return Case(item, faults.applied_to(machine), point, faults, severities(machine, faults), sensor)


def _number(value: Any, path: str) -> float:
    if isinstance(value, float):  # first, as it is by far the commonest and a question to an abstract class is slow
        return value
    if isinstance(value, bool) or not isinstance(value, Real):
        rule = "a law other than {around: share}, as there is no number to be around"
        raise refuse("campaign", path, rule, value, "write {around: [nominal, share]} or another law")
    return float(value)
