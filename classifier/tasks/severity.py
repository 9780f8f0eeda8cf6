"""How bad each fault is, in its own unit, with an interval: the paper's fig. 11 made a measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import torch

from classifier.dataset import Dataset
from classifier.features import Scaling
from classifier.network import Mlp
from classifier.tasks.conformal import conformal_quantile, least_records
from classifier.tasks.spectrum import Compression
from classifier.trainers import Examples
from classifier.trainers.trainscg import TrainScg
from indexer_env.checks import check_number
from indexer_env.errors import refuse


class Quantity(NamedTuple):
    """A severity: the column of `datagen.schema` that holds it, the factor to the unit it is told in, and its range."""

    column: str
    factor: float
    high: float


QUANTITIES = {
    "backlash_deg": Quantity("fault_backlash", 180.0 / math.pi, math.inf),
    "crack": Quantity("fault_roller_crack", 1.0, 1.0),
    "looseness": Quantity("fault_screw_looseness", 1.0, 1.0),
}
"""Backlash in degrees at the motor shaft; crack and looseness as shares, see `indexer_env.faults.Faults`."""

COVERAGE = 0.9
"""Share of new records whose true severity lies within its interval."""

_NETWORKS = 10
_HIDDEN = 20


def severities_of(dataset: Dataset) -> dict[str, np.ndarray]:
    """True severities (n,) by name, of those that every row states and that vary over the calibration records."""
    found = {}
    for name, (column, factor, _) in QUANTITIES.items():
        if column not in dataset.table.column_names or dataset.table.column(column).null_count:
            continue
        values = factor * dataset.table.column(column).to_numpy()
        if np.ptp(values[dataset.rows("calibration")]) > 0.0:
            found[name] = values
    return found


def halves(draws: np.ndarray) -> np.ndarray:
    """Mask (n,) that takes every second of the machine draws (n,) whole, so that no machine is on both sides."""
    return np.isin(draws, np.unique(draws)[::2])


@dataclass(frozen=True, eq=False)
class Severity:
    """A committee of networks with one linear output for each severity, and the intervals around their mean.

        ŷ = mean_i f_i(x),   interval ŷ ± q · u(x),   u(x) = sqrt(variance_i f_i(x) + s²)

    Inputs are the compressed features. Half of the control machines stop the training, the other half give the
    conformal q of the scores |y − ŷ| / u; s, the root mean square error on the first half, keeps u from 0 where all
    networks agree. Intervals are cut at what a severity can be.

    names       severities told, keys of QUANTITIES
    coverage    share of new records whose true value lies within
    network     their shape; all have one
    compression, scaling  of the features before they enter
    parameters  (networks, network.count)
    span        (names,) greatest calibration value: outputs are shares of it
    floor       (names,) s, as a share of the span
    quantile    (names,) q

    The promise is made for records of machines drawn as those of the training were, and for the mean over them: an
    interval may hold less often for one severity and more often for another. Raises ParameterError.
    """

    kind: ClassVar[str] = "severity"

    names: tuple[str, ...]
    coverage: float
    network: Mlp
    compression: Compression
    scaling: Scaling
    parameters: np.ndarray
    span: np.ndarray
    floor: np.ndarray
    quantile: np.ndarray

    def __post_init__(self) -> None:
        unknown = [name for name in self.names if name not in QUANTITIES]
        if unknown or not self.names:
            raise refuse("Severity", "names", f"some of {', '.join(QUANTITIES)}", self.names)
        check_number("Severity", "coverage", self.coverage, low=0.0, high=1.0, low_open=True, high_open=True)
        if self.parameters.ndim != 2 or self.parameters.shape[1] != self.network.count:
            raise refuse("Severity", "parameters", f"of shape (networks, {self.network.count})", self.parameters.shape)
        for name in ("span", "floor", "quantile"):
            if getattr(self, name).shape != (len(self.names),):
                raise refuse("Severity", name, f"one number for each of {self.names}", getattr(self, name))

    @classmethod
    def fit(
        cls, dataset: Dataset, features: np.ndarray, outputs: np.ndarray, seed: int, coverage: float = COVERAGE
    ) -> Severity | None:
        """Fitted to scaled features (n, count) of all records; None where no severity is stated and varies, or the
        control machines are too few for an interval."""
        values = severities_of(dataset)
        calibration, control = dataset.rows("calibration"), dataset.rows("control")
        if not values:
            return None
        draws = dataset.table.column("machine_draw").to_numpy()
        stop = np.zeros_like(control)
        stop[control] = halves(draws[control])
        held_out = control & ~stop
        if held_out.sum() < least_records(coverage):
            return None

        names = tuple(values)
        truth = np.stack([values[name] for name in names], axis=1)
        span = truth[calibration].max(axis=0)
        compression = Compression.fit(features[calibration])
        scaling = Scaling.fit(compression.apply(features[calibration]))
        inputs = torch.from_numpy(scaling.apply(compression.apply(features)))
        targets = torch.from_numpy(truth / span)
        network = Mlp(inputs.shape[1], _HIDDEN, len(names), output_function="linear")
        start = network.initial(_NETWORKS, torch.Generator().manual_seed(seed))
        teach, watch = (Examples(inputs[rows], targets[rows]) for rows in (calibration, stop))
        trained = TrainScg().train(network, start, teach, watch).parameters.numpy()

        raw = cls(names, coverage, network, compression, scaling, trained, span, *np.ones((2, len(names))))
        mean, _ = raw.estimate(features)
        floor = np.sqrt(np.mean((mean - truth)[stop] ** 2, axis=0)) / span
        raw = cls(names, coverage, network, compression, scaling, trained, span, floor, np.ones(len(names)))
        mean, unit = raw.estimate(features[held_out])
        scores = np.abs(truth[held_out] - mean) / unit
        quantile = np.array([conformal_quantile(column, coverage) for column in scores.T])
        return cls(names, coverage, network, compression, scaling, trained, span, floor, quantile)

    def estimate(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Means ŷ and units u of the intervals, both (n, names), for scaled features (n, count)."""
        inputs = torch.from_numpy(self.scaling.apply(self.compression.apply(features)))
        outputs = self.network.outputs_of(torch.from_numpy(self.parameters), inputs).numpy()
        unit = np.sqrt(outputs.var(axis=0) + self.floor**2)
        return outputs.mean(axis=0) * self.span, unit * self.span

    def assess(self, features: np.ndarray, outputs: np.ndarray) -> dict[str, np.ndarray]:
        """Each severity (n,) under its name, and the ends of its interval under NAME_low and NAME_high."""
        mean, unit = self.estimate(features)
        columns = {}
        for place, name in enumerate(self.names):
            middle, reach = mean[:, place], self.quantile[place] * unit[:, place]
            for ending, value in (("", middle), ("_low", middle - reach), ("_high", middle + reach)):
                columns[name + ending] = np.clip(value, 0.0, QUANTITIES[name].high)
        return columns

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Severity:
        """The part that gave this body and these arrays."""
        return cls(
            tuple(body["names"]),
            body["coverage"],
            Mlp(**body["network"]),
            Compression(arrays["knee"]),
            Scaling(arrays["low"], arrays["high"]),
            *(arrays[name] for name in ("parameters", "span", "floor", "quantile")),
        )

    def body(self) -> dict[str, Any]:
        """All of it that is no array."""
        return {"names": list(self.names), "coverage": self.coverage, "network": asdict(self.network)}

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        return {
            "knee": self.compression.knee,
            "low": self.scaling.low,
            "high": self.scaling.high,
            **{name: getattr(self, name) for name in ("parameters", "span", "floor", "quantile")},
        }
