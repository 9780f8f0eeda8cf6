"""A campaign: which machine, operating point and label each item of a data set has.

An `Item` is data, not a machine: the label and the values that differ from the base, by dotted path
("output_joint.backlash"). `build` turns it into what can be simulated, or says why it cannot be (the item is
then recorded as rejected). Each family of campaigns is one file in `campaigns/`, listed in
`datagen.campaigns.CAMPAIGNS`.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, ClassVar, TypeVar

import numpy as np

from datagen.laws import Law, make_law
from datagen.seeds import Part, stream
from indexer_env.checks import did_you_mean
from indexer_env.errors import refuse
from indexer_env.faults import Faults
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint

SUBSETS = ("calibration", "control", "validation")
"""The paper's three sets: to train, to stop the training, to judge it (paper.txt, section 4.1, step 2)."""

T = TypeVar("T")


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
    """One record to be: its number, its label and what differs from the base, by dotted path, SI units."""

    index: int
    label: Label
    machine: Mapping[str, Any] = field(default_factory=dict)
    faults: Mapping[str, Any] = field(default_factory=dict)
    operating_point: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Base:
    """What every item of a data set starts from."""

    machine: Machine
    operating_point: OperatingPoint
    faults: Faults = Faults()


@dataclass(frozen=True)
class Case:
    """An item ready to be simulated; `machine` already carries the faults, `faults` says how severe they
    are."""

    item: Item
    machine: Machine
    operating_point: OperatingPoint
    faults: Faults


class Campaign(ABC):
    """A family of data sets; frozen, configured from YAML, without state."""

    name: ClassVar[str]
    example_index: ClassVar[int] = 0
    """The item whose label the example file has."""
    decides: ClassVar[tuple[str, ...]] = ()
    """Fields of the machine, by dotted path, that every item gets from its class: the base machine's are not
    used."""

    @abstractmethod
    def draw(self, index: int, base: Base, rng: np.random.Generator) -> Item:
        """Item `index` (from 0), all its chance taken from `rng`."""

    @abstractmethod
    def classes(self) -> tuple[str, ...]:
        """Names of the classes, class 1 first."""

    def item(self, index: int, base: Base, seed: int) -> Item:
        """Item `index` of the data set with this seed; depends on nothing else."""
        return self.draw(index, base, stream(seed, Part.MACHINE, index))

    def example(self, base: Base, seed: int) -> Item:
        """An item of a machine that is in no data set of this seed."""
        return self.draw(self.example_index, base, stream(seed, Part.EXAMPLE_MACHINE, self.example_index))


def build(item: Item, base: Base) -> Case:
    """The machine of an item, its faults put in.

    Raises
    ------
    ParameterError
        The item's values break a rule of Machine, Joint, Faults or OperatingPoint.
    """
    faults = with_changes(base.faults, item.faults)
    machine = faults.applied_to(with_changes(base.machine, item.machine))
    return Case(item, machine, with_changes(base.operating_point, item.operating_point), faults)


def with_changes(target: T, changes: Mapping[str, Any]) -> T:
    """A copy of a frozen dataclass with the fields at these dotted paths replaced, all at once, so that only
    the final object has to pass its checks.

    Raises
    ------
    ParameterError
        A path that leads nowhere, or a value that the object refuses.
    """
    if not changes:
        return target
    owner = type(target).__name__
    names = _field_names(target)
    new: dict[str, Any] = {}
    inner: dict[str, dict[str, Any]] = {}
    for path, value in changes.items():
        head, _, rest = path.partition(".")
        if head not in names:
            raise refuse(owner, head, f"a field ({path})", head, did_you_mean(head, names))
        if rest:
            inner.setdefault(head, {})[rest] = value
        else:
            new[head] = value
    for head, below in inner.items():
        new[head] = with_changes(new.get(head, getattr(target, head)), below)
    return dataclasses.replace(target, **new)  # type: ignore[type-var]


def value_at(target: object, path: str) -> Any:
    """The field at a dotted path, e.g. value_at(machine, "output_joint.stiffness"); ParameterError where
    there is none."""
    for name in path.split("."):
        known = _field_names(target)
        if name not in known:
            raise refuse(type(target).__name__, name, f"a field ({path})", name, did_you_mean(name, known))
        target = getattr(target, name)
    return target


def number_at(target: object, path: str, owner: str) -> float:
    """The number at a dotted path; ParameterError, in the name of `owner` who wants to draw it, where there
    is none."""
    value = value_at(target, path)
    if isinstance(value, bool) or not isinstance(value, Real):
        raise refuse(owner, path, "a number of the machine, to be drawn", value, "leave it out")
    return float(value)


def _field_names(target: object) -> list[str]:
    return [entry.name for entry in dataclasses.fields(target)] if dataclasses.is_dataclass(target) else []


def laws_by_path(mapping: Mapping[str, Any], owner: str) -> dict[str, Law]:
    """The laws of a nested mapping that mirrors Machine: {output_joint: {stiffness: {law: ...}}} -> {dotted
    path: Law}."""
    laws: dict[str, Law] = {}
    for key, value in mapping.items():
        path = f"{owner}.{key}"
        if isinstance(value, Mapping) and "law" not in value:
            laws.update({f"{key}.{below}": law for below, law in laws_by_path(value, path).items()})
        else:
            laws[str(key)] = make_law(value, path)
    return laws
