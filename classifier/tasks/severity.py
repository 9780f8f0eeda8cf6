"""How bad each fault is, in its own unit, with an interval: the paper's fig. 11 made a measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from classifier.dataset import Dataset
from classifier.tasks.conformal import conformal_quantile, least_records
from classifier.tasks.need import (
    NotAvailable,
    count_independent,
    draws_are_machines,
    independent,
    machines,
    need,
)
from classifier.tasks.regression import FOLDS, KernelRidge, cross_fitted, fit_at
from classifier.tasks.spectrum import Compression, Standard
from indexer_env.checks import check_number
from indexer_env.errors import refuse
from indexer_env.units import DEGREE


class Quantity(NamedTuple):
    """What is told: its column of `datagen.schema`, the factor to the unit in which it is told, and its most."""

    column: str
    factor: float
    high: float


QUANTITIES = {
    "backlash_deg": Quantity("fault_backlash", 1.0 / DEGREE, math.inf),
    "crack": Quantity("fault_roller_crack", 1.0, 1.0),
    "looseness": Quantity("fault_screw_looseness", 1.0, 1.0),
}
"""Backlash in degrees at the motor shaft; crack and looseness as shares, see `indexer_env.faults.Faults`."""

COVERAGE = 0.9
"""Share of new records whose true severity lies within its interval."""

_LEAST_RECORDS = 10 * FOLDS
_LEAST_GROUPS = 2
"""Of which the rest predict each: errors on a machine that was learned from say nothing of another."""

_ERROR_RIDGE = 1.0
"""Sizes of errors scatter more than severities, so the regression of them is held smoother."""


def severities_of(dataset: Dataset, quantities: Mapping[str, Quantity] = QUANTITIES) -> dict[str, np.ndarray]:
    """True values (n,) of quantities by name, of those that every row states and that vary over the calibration
    records."""
    found = {}
    for name, (column, factor, _) in quantities.items():
        if column not in dataset.table.column_names or dataset.table.column(column).null_count:
            continue
        values = factor * dataset.table.column(column).to_numpy()
        if np.ptp(values[dataset.rows("calibration")]) > 0.0:
            found[name] = values
    return found


@dataclass(frozen=True, eq=False)
class Severity:
    """One regression for all severities and another for the size of its errors, and conformal intervals.

        ŷ = f(x),   interval ŷ ± q · u(x),   u(x) = max(e(x), e_0)

    f and e are `KernelRidge` on the compressed and standardised features x; e learns the absolute errors that f makes
    on calibration machines it was not fitted to, e_0 is a fifth of their mean. The conformal q is that of the scores
    |y − ŷ| / u of the control records. Intervals are cut at what a severity can be.

    names         severities told, keys of QUANTITIES
    coverage      share of new records whose true value lies within
    compression, standard  of the scaled features
    value, error  f and e, with one output for each name; in units of the span
    span          (names,) greatest calibration value
    floor         (names,) e_0
    quantile      (names,) q

    The share is promised for records of machines drawn as those of the training were, averaged over them: the interval
    of a healthy machine may hold more often, that of a rare severity less often. With fewer than nine machines in the
    control subset (for 90 %), or measured files that were not kept apart by their machine, it is promised for new
    records or files of those machines; new ones may have less, see `unpromised`. Raises ParameterError.
    """

    kind: ClassVar[str] = "severity"
    quantities: ClassVar[Mapping[str, Quantity]] = QUANTITIES
    missing: ClassVar[str] = "no size of a fault that every row states and that varies"

    names: tuple[str, ...]
    coverage: float
    compression: Compression
    standard: Standard
    value: KernelRidge
    error: KernelRidge
    span: np.ndarray
    floor: np.ndarray
    quantile: np.ndarray

    def __post_init__(self) -> None:
        if not self.names or any(name not in self.quantities for name in self.names):
            raise refuse("Severity", "names", f"some of {', '.join(self.quantities)}", self.names)
        check_number("Severity", "coverage", self.coverage, low=0.0, high=1.0, low_open=True, high_open=True)
        for name in ("span", "floor", "quantile"):
            if getattr(self, name).shape != (len(self.names),):
                raise refuse("Severity", name, f"one number for each of {self.names}", getattr(self, name))

    @classmethod
    def fit(
        cls, dataset: Dataset, features: np.ndarray, outputs: np.ndarray, seed: int, coverage: float = COVERAGE
    ) -> Self:
        """Fitted to scaled features (n, count) of all records. Raises NotAvailable where no severity is stated and
        varies, or the records are too few for a regression and its interval."""
        values = severities_of(dataset, cls.quantities)
        if not values:
            raise NotAvailable(cls.missing)
        calibration, control = dataset.rows("calibration"), dataset.rows("control")
        need("calibration records", _LEAST_RECORDS, int(calibration.sum()))
        cls.check_control(dataset, coverage)
        names, truth = tuple(values), np.stack(list(values.values()), axis=1)
        span = truth[calibration].max(axis=0)
        compression = Compression.fit(features[calibration])
        standard = Standard.fit(compression.apply(features[calibration]))
        inputs = standard.apply(compression.apply(features[calibration]))
        groups = dataset.table.column("machine_draw").to_numpy()[calibration]
        need("machines or files among the calibration records", _LEAST_GROUPS, len(np.unique(groups)))
        value, missed = cross_fitted(inputs, truth[calibration] / span, groups, np.random.default_rng(seed))
        error = fit_at(inputs, np.abs(missed), value.centres, value.width, _ERROR_RIDGE)
        floor = 0.2 * np.abs(missed).mean(axis=0)
        raw = cls(names, coverage, compression, standard, value, error, span, floor, np.ones(len(names)))
        told, unit = raw.estimate(features[control])
        scores = np.abs(truth[control] - told) / unit
        units = cls.units_of(dataset, coverage)
        quantile = [conformal_quantile(column, coverage, units) for column in scores.T]
        return replace(raw, quantile=np.array(quantile))

    @classmethod
    def check_control(cls, dataset: Dataset, coverage: float) -> None:
        """Raise NotAvailable where the control records are too few for an interval of this coverage."""
        need("independent control records", least_records(coverage), count_independent(dataset, "control"))

    @classmethod
    def units_of(cls, dataset: Dataset, coverage: float = COVERAGE) -> np.ndarray:
        """Labels (k,) of the k control records, alike for those that hang together, which is what a new record is new
        in: those of one machine, where there are enough machines for an interval, else as `independent`."""
        control = dataset.rows("control")
        return independent(dataset, control) if cls.unpromised(dataset, coverage) else machines(dataset, control)

    @classmethod
    def unpromised(cls, dataset: Dataset, coverage: float = COVERAGE) -> str:
        """Why the share is not promised for records of new machines; "" where it is."""
        found, least = len(np.unique(machines(dataset, dataset.rows("control")))), least_records(coverage)
        share = f"the intervals hold for {100 * coverage:g} % of new"
        if found < least:
            few = f"{found} machines or files in the control subset, {least} needed"
            return f"{few}; {share} records of these, new ones may have less"
        if not draws_are_machines(dataset):
            files = "files of the control subset may be of machines that taught (split.by=machine keeps them apart)"
            return f"{files}; {share} files of these machines, new machines may have less"
        return ""

    def estimate(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values ŷ and units u of their intervals, both (n, names), for scaled features (n, count)."""
        inputs = self.standard.apply(self.compression.apply(features))
        unit = np.maximum(self.error.predict(inputs), self.floor)
        return self.value.predict(inputs) * self.span, unit * self.span

    def assess(self, features: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """Each severity (n,) under its name, and the ends of its interval under NAME_low and NAME_high."""
        value, unit = self.estimate(features)
        columns = {}
        for place, name in enumerate(self.names):
            middle, reach = value[:, place], self.quantile[place] * unit[:, place]
            for ending, told in (("", middle), ("_low", middle - reach), ("_high", middle + reach)):
                columns[name + ending] = np.clip(told, 0.0, self.quantities[name].high)
        return columns

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Self:
        """The part that gave this body and these arrays."""
        value, error = (
            KernelRidge(arrays["centres"], body[f"{name}_width"], arrays[f"{name}_weights"], arrays[f"{name}_offset"])
            for name in ("value", "error")
        )
        return cls(
            tuple(body["names"]),
            body["coverage"],
            Compression(arrays["knee"]),
            Standard(arrays["mean"], arrays["deviation"]),
            value,
            error,
            *(arrays[name] for name in ("span", "floor", "quantile")),
        )

    def body(self) -> dict[str, Any]:
        """All of it that is no array."""
        widths = {"value_width": self.value.width, "error_width": self.error.width}
        return {"names": list(self.names), "coverage": self.coverage, **widths}

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name; both regressions have the same centres."""
        return {
            "knee": self.compression.knee,
            "mean": self.standard.mean,
            "deviation": self.standard.deviation,
            "centres": self.value.centres,
            "value_weights": self.value.weights,
            "value_offset": self.value.offset,
            "error_weights": self.error.weights,
            "error_offset": self.error.offset,
            "span": self.span,
            "floor": self.floor,
            "quantile": self.quantile,
        }
