"""A machine and its records as the chain of stages takes them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from discrepancy.form import Form
from discrepancy.model import Model
from discrepancy.origin import Origin
from discrepancy.place import Point


@dataclass(frozen=True, eq=False)
class Axis:
    """One way to sort the samples of all windows into cells.

    Attributes
    ----------
    name : str
        As a sentence may hold it: "cam phase", "station".
    labels : tuple of str
        One for each cell.
    cells : ndarray (w, n) of int
        Cell of each sample; -1 for none.
    """

    name: str
    labels: tuple[str, ...]
    cells: np.ndarray


@dataclass(frozen=True, eq=False)
class Line:
    """A frequency at which a residual may stand in every record: fixed, or locked to a shaft.

    Attributes
    ----------
    name : str
        "order 1 of the motor shaft", "50 Hz".
    kind : str
        What it is locked to: "motor shaft", "cam", "table", "fixed frequency".
    frequency : ndarray (records,)
        [Hz]
    """

    name: str
    kind: str
    frequency: np.ndarray


@dataclass(frozen=True, eq=False)
class Torque:
    """A residual as the torque or force that the model lacks, and over what it is drawn.

    Attributes
    ----------
    name : str
        With its unit: "missing torque on the table [N m]".
    per_unit : float
        Torque that one unit of (measured - simulated) stands for.
    over : mapping of str to ndarray (w, n)
        What it is drawn over, by name with its unit: "cam angle [°]".
    """

    name: str
    per_unit: float
    over: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class View:
    """A model's records, window by window.

    Attributes
    ----------
    names : tuple of str
        Of the records.
    unit : str
        Of the records.
    groups : ndarray (w,) of int
        Record of each window.
    inside : ndarray (w, n) of bool
        Samples that a window has.
    time : ndarray (w, n)
        Since the record's first sample [s].
    measured : ndarray (w, n)
        [unit]
    noise : ndarray (records,)
        Standard deviation [unit].
    estimated : tuple of bool
        Which records' noise was estimated from all of these records together, as `noise.shared_noise` does.
    axes : tuple of Axis
    map_axes : (str, str)
        Names of the axes of the map: upwards and across.
    lines : tuple of Line
    window : str
        What a window is called.
    aligned : bool
        Whether windows begin at the same place of what repeats, so that those of the same cells can be compared.
    shafts : mapping of str to ndarray (records,)
        Speeds [Hz] of the shafts that a line may be locked to.
    torque : Torque or None
        What a residual amounts to as a torque or force that is missing.
    colour : ndarray (records,) or None
        Correlation of the noise from sample to sample; None where it is white.
    """

    names: tuple[str, ...]
    unit: str
    groups: np.ndarray
    inside: np.ndarray
    time: np.ndarray
    measured: np.ndarray
    noise: np.ndarray
    estimated: tuple[bool, ...]
    axes: tuple[Axis, ...]
    map_axes: tuple[str, str]
    lines: tuple[Line, ...] = ()
    window: str = "stretch"
    aligned: bool = False
    shafts: Mapping[str, np.ndarray] = field(default_factory=dict)
    torque: Torque | None = None
    colour: np.ndarray | None = None

    def axis(self, name: str) -> Axis:
        """The axis of that name."""
        return next(axis for axis in self.axes if axis.name == name)


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measurement that could be made, imagined.

    Attributes
    ----------
    name : str
        What to do, as a sentence may hold it: "1200 rpm, 40 N m, 2 turns of the table".
    model : Model
        The model as it came with records of these conditions, all 0: its residuals are predictions.
    scale : float
        Its residuals times this are in units of the measuring noise.
    """

    name: str
    model: Model
    scale: float = 1.0


class Subject(ABC):
    """A model with records to fit and to hold out, and what reports need beyond them.

    Attributes
    ----------
    kind : str
        "cam indexing machine"
    model, held_out : Model
        The base model with the records to fit, and with those held out.
    notes : tuple of str
        What was put right or assumed when the records were taken in.
    """

    kind: str
    model: Model
    held_out: Model
    notes: tuple[str, ...]

    @abstractmethod
    def view(self, model: Model) -> View:
        """The records of `model`."""

    @abstractmethod
    def files(self, model: Model, place: Point) -> Mapping[str, str]:
        """The machine that a place of `model` stands for, as YAML texts by file name; always the same names,
        machine.yaml first."""

    @abstractmethod
    def meaning(self, effect: str) -> str:
        """An effect of the library in one sentence."""

    @abstractmethod
    def measurements(self, model: Model) -> tuple[Measurement, ...]:
        """Measurements that could be made next, beside the records of `model`, with their noise."""

    def origin(self, model: Model, place: Point) -> Origin | None:
        """Where what a fitted place of `model` leaves comes from; None where nothing shows, or nothing is known of
        what could be missing at which joint."""
        return None

    def elsewhere(self, model: Model, place: Point, without: Point, effect: str) -> str:
        """In words, what explains better than an effect what a fitted place `without` it leaves, given that of the set
        with it; "" where nothing does, or nothing can be said of it."""
        return ""

    def of_records(self, model: Model, place: Point) -> tuple[str, ...]:
        """What a fitted place of `model` says of its single records, a sentence each; nothing where they have nothing
        of their own."""
        return ()

    def forms(self) -> tuple[Form, ...]:
        """Variables over which what remains may be tabulated; none where it cannot be."""
        return ()

    def shop(self, name: str, values: Sequence[float]) -> str:
        """Values of a parameter, ``effect.parameter`` or the machine's own, as they are said in the shop; "" where they
        are said in their SI unit."""
        return ""

    def part(self, effect: str) -> str:
        """The part of the machine where an effect acts, one of `report.picture.PARTS`; "" where none is drawn."""
        return ""


def told_apart(values: Sequence[float], unit: str) -> tuple[str, ...]:
    """Values with their unit, in as few digits, two or more, as tell each from the next."""
    for digits in range(2, 9):
        said = [f"{float(f'{value:.{digits}g}'):.{max(digits, 6)}g}" for value in values]
        if len(set(said)) == len(said):
            break
    return tuple(f"{one} {unit}" for one in said)


def bounded(value: float, digits: int = 4) -> str:
    """A number in so many digits, or that it has no bound."""
    return "no bound" if math.isinf(value) else f"{value:.{digits}g}"


def binned(values: np.ndarray, edges: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Cell (w, n) of values (w, n) between edges (k+1,); what lies beyond goes to the first or last, outside is -1."""
    cells = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return np.where(inside, cells, -1)
