"""One's own machine: machines drawn jointly from what healthy records left open, with faults of a table on top.

Machine draw d has row d mod rows of the joint draws (`posterior`, a Parquet file with one column a quantity, named by
its path), by which it gets its subset, one of the operating points, and a number of faults drawn by `how_many`; which
ones is drawn without replacement. What a fault sets is added to what the row, or else the machine as configured, has of
the same quantity, so growing friction adds to friction that was there; a phase that is there stays, so an imbalance
grows where it is.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from datagen.base import Base, fault_values
from datagen.campaign import Campaign, Design
from datagen.draws import effect_of
from datagen.labels import NO_FAULTS, combinations
from datagen.quantities import laws_by_path
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer, check_number
from indexer_env.effects import LOADABLE
from indexer_env.errors import ParameterError, refuse
from indexer_env.laws import Law
from indexer_env.operating_point import OperatingPoint

LOAD_FACTOR = "load_factor"
"""Column of the joint draws that is no quantity: the factor by which loads are other than stated."""

_LOAD = "operating_point.load_torque"

_HEALTHY = "healthy"

_MOST_FAULTS = 12
"""Each combination of faults has a name in the manifest."""


@dataclass(frozen=True, kw_only=True)
class Own(Campaign):
    """Settings of the family, besides those of `Campaign`.

    Attributes
    ----------
    machines : int
        Machine draws of the whole campaign, >= 1; each has one record.
    posterior : str or None
        Parquet file of joint draws; None: the machine as configured.
    posterior_sha256 : str or None
        Checksum of that file, so that a data set is not gone on with from another one; filled in where not given.
    faults : mapping
        For each fault its effect and laws of the effect's parameters: {crack: {roller.crack: {stiffness_loss: LAW}}}.
    how_many : sequence of float
        Probabilities of none, one, two ... faults in a record; they sum up to 1.
    points : sequence of mapping
        Operating points as stated, each as likely; none: as configured, or as `draws` has it. Their loads are times the
        row's `load_factor`, where the joint draws have one.
    """

    name: ClassVar[str] = "own"
    lengths: ClassVar[tuple[str, ...]] = ("machines",)

    machines: int
    posterior: str | None = None
    posterior_sha256: str | None = None
    faults: Mapping[str, Any] = field(default_factory=dict)
    how_many: Sequence[float] = (1.0,)
    points: Sequence[Mapping[str, Any]] = ()

    def __post_init__(self) -> None:
        check_integer("campaign", "machines", self.machines, low=1)
        for number, share in enumerate(self.how_many):
            check_number("campaign", f"how_many[{number}]", share, low=0.0, high=1.0)
        if abs(sum(self.how_many) - 1.0) > 1e-6 or len(self.how_many) > len(self.faults) + 1:
            rule = f"probabilities of 0 to {len(self.faults)} faults that sum up to 1"
            raise refuse("campaign", "how_many", rule, list(self.how_many))
        if self.posterior is not None:
            found = _checksum(self.posterior)
            if self.posterior_sha256 not in (None, found):
                remedy = "the file is another one now; leave posterior_sha256 out for a new data set"
                raise refuse("campaign", "posterior", f"the file with SHA-256 {self.posterior_sha256}", found, remedy)
            object.__setattr__(self, "posterior_sha256", found)
        check_integer("campaign", "number of faults", len(self.faults), high=_MOST_FAULTS)
        _ = self._rows, self._fault_laws, self._points
        super().__post_init__()
        self._check_rows_of_subsets()
        decided = {path for laws in self._fault_laws.values() for path in laws}
        for key, stage in (("draws", self.machine_laws), ("drift", self.item_laws)):
            for path in sorted(decided.intersection(stage.laws)):
                rule, law = "left to campaign.faults, which decides the label", stage.laws[path]
                remedy = "give what healthy machines differ in by campaign.posterior, or leave out the fault"
                raise refuse(f"campaign.{key}", path, rule, law, remedy)

    def _check_rows_of_subsets(self) -> None:
        """Each subset has rows of its own, or there is one machine for all."""
        rows, least = len(self._rows[1]), 1 + max(map(self._schedule.index, self._schedule))
        if 1 < rows < least:
            rule = f"a table of one row, the machine of all subsets, or of {least}, a row for each of campaign.split"
            raise refuse("campaign", "posterior", rule, f"{rows} rows", "draw more machines")

    @functools.cached_property
    def _rows(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Paths (k,) and values (rows, k) of the joint draws."""
        if self.posterior is None:
            return (), np.zeros((1, 0))
        import pyarrow.parquet

        try:
            table = pyarrow.parquet.read_table(self.posterior)
        except pyarrow.ArrowInvalid:
            rule, remedy = "a Parquet file of joint draws", "indexer twin leaves one, posterior.parquet"
            raise refuse("campaign", "posterior", rule, self.posterior, remedy) from None
        paths = tuple(table.column_names)
        known = {path: 1.0 for path in paths if path != LOAD_FACTOR}
        values = np.column_stack([table.column(path).to_numpy() for path in paths])
        if not len(values) or not np.isfinite(values).all():
            raise refuse("campaign", "posterior", "a table of finite numbers with a row or more", self.posterior)
        for path in NO_FAULTS.keys() & known:
            rule = "without a fault, which campaign.faults decides"
            raise refuse("campaign", "posterior", rule, path, "give what healthy machines have as an effect")
        laws_by_path(_nested(known), "campaign.posterior")
        return paths, values

    @functools.cached_property
    def _fault_laws(self) -> dict[str, dict[str, Law]]:
        """Laws by path of each fault."""
        return {
            name: laws_by_path({"effects": effects}, f"campaign.faults.{name}") for name, effects in self.faults.items()
        }

    @functools.cached_property
    def _points(self) -> tuple[dict[str, float], ...]:
        """The operating points, by path."""
        points = [from_mapping(OperatingPoint, point, f"campaign.points[{k}]") for k, point in enumerate(self.points)]
        return tuple({f"operating_point.{name}": value for name, value in vars(point).items()} for point in points)

    @property
    def size(self) -> int:
        return self.machines

    @property
    def decides(self) -> tuple[str, ...]:
        paths = (path for path in self._rows[0] if path != LOAD_FACTOR)
        return (*paths, *(self._points[0] if self._points else ()), *NO_FAULTS)

    @property
    def refines(self) -> tuple[str, ...]:
        return self._rows[0]

    @property
    def different(self) -> int:
        if self.faults and self.how_many[0] < 1.0:
            return self.machines
        return len(self._rows[1]) * max(1, len(self._points))

    def machine_draw(self, index: int) -> int:
        return index

    def machine_number(self, index: int) -> int:
        return self.split_number(index)

    def split_number(self, index: int) -> int:
        """The row, so that no machine is in two subsets; of a single one the draws, which differ in faults alone."""
        rows = len(self._rows[1])
        return index % rows if rows > 1 else index

    def row(self, draw: int) -> dict[str, float]:
        """The joint draw of a machine, by path."""
        paths, rows = self._rows
        return dict(zip(paths, rows[draw % len(rows)].tolist(), strict=True))

    def design(self, index: int, rng: np.random.Generator, base: Base) -> Design:
        row = self.row(self.machine_draw(index))
        factor = row.pop(LOAD_FACTOR, 1.0)
        values: dict[str, Any] = NO_FAULTS | {path: _plain(path, value) for path, value in row.items()}
        if self._points:
            values |= self._points[int(rng.integers(len(self._points)))]
            values[_LOAD] *= factor
        there = fault_values(base) | values
        number = int(rng.choice(len(self.how_many), p=np.asarray(self.how_many) / sum(self.how_many)))
        names = list(self._fault_laws)
        for name in rng.permutation(len(names))[:number].tolist():
            for path, law in self._fault_laws[names[name]].items():
                values[path] = there[path] = _with_fault(path, there.get(path), law.draw(rng))
        return Design(values)

    def classes(self) -> tuple[str, ...]:
        return self._classes

    @functools.cached_property
    def _classes(self) -> tuple[str, ...]:
        return combinations(list(self._fault_laws), _HEALTHY)

    def classify(self, index: int, values: Mapping[str, Any], base: Base) -> tuple[int, str, str]:
        had = fault_values(base) | self.row(self.machine_draw(index))
        laws = self._fault_laws.values()
        there = [any(values.get(path) not in (None, had.get(path)) for path in paths) for paths in laws]
        code = "".join("1" if one else "0" for one in there) or "0"
        number = int(code, 2)
        return number + 1, self._classes[number], code


def _with_fault(path: str, there: Any, drawn: Any) -> Any:
    """A quantity with what a fault draws for it, given what is there (None: nothing): a size grows, a phase stays, and
    any other quantity is the fault's."""
    if there is not None and path.endswith(".phase"):
        return there
    return _plain(path, drawn) if there is None or not _is_size(path) else there + drawn


def _is_size(path: str) -> bool:
    effect = effect_of(path)
    assert effect is not None, "what faults draw is an effect's"
    (field,) = (one for one in dataclasses.fields(LOADABLE[effect]) if path.endswith(f"{effect}.{one.name}"))
    return field.metadata["null"] is not None


def _plain(path: str, value: Any) -> Any:
    return int(value) if path.endswith(".station") else value


def _checksum(path: str) -> str:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise ParameterError(f"campaign.posterior {path} cannot be read ({error.strerror}); check the path.") from None


def _nested(values: Mapping[str, float]) -> dict[str, Any]:
    """Values by path as sections of quantities."""
    sections: dict[str, Any] = {}
    for path, value in values.items():
        section, _, rest = path.partition(".")
        owner, _, name = rest.rpartition(".")
        below = sections.setdefault(section, {})
        if owner:
            below = below.setdefault(owner, {})
        below[name] = value
    return sections
