"""What the fit of a turn by simulation is worth: names, intervals of sizes, and what no fault of the table makes.

Everything is taken from simulated turns that no network was taught on, with noise, fitted as a measured one is. A fault
is named where the logistic law of its size over its spread says so; what the networks say of it has no part, as they
err where a third fault stands beside two, and a fit does not. Intervals are conformal in groups: each fault alone and
beside others (Mondrian).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from classifier.tasks.conformal import conformal_quantile, least_records
from twin.refine import POSSIBLE, Fits

ACCEPTED = 0.99
"""Share of healthy turns like the simulated ones that do not count as novel."""

_COMMON, _FAR = 0.95, 2.5
"""A fitted turn is novel from so many times as far above the median as this quantile of ln of what is left. Some
hundred turns tell no higher quantile: one fit in a wrong minimum would decide it."""

LEAST = 30
"""Fewest turns of a fault alone, or beside others, for an interval apart from the fault's own."""

IMPOSSIBLE = 2.0 * POSSIBLE
"""Logit of a fault that is not looked for."""

_FLOOR = 1e-3
"""Least standard deviation of a size: half of the smallest that is simulated."""

_RIDGE = 1e-2


@dataclass(frozen=True, eq=False)
class Weights:
    """Attributes
    ----------
    name : ndarray (2,)
        Of the logistic law: its constant, and what asinh(size over spread) counts.
    reach : ndarray (faults, 2)
        Half width of a size's interval over its standard deviation: named alone, and beside others.
    slope : float
        By which ln of a fit's usual remainder rises with ln(1 + rattling), at least 0: where the cam turns of the
        measured turn differ by chance, a simulated one differs from it by more of the same.
    rattled : float
        The largest rattling of the turns that the slope is from; it holds for no larger one.
    strange : float
        ln of the remainder above which a turn that does not rattle is strange.
    quiet, quiet_mean : float
        Remainder of a turn without alarm, which is not fitted, above which it is strange: with its stations known, and
        by its mean cam turn alone.
    pooled : ndarray (faults,) of bool
        Whether too few turns named the fault for a half width of its own: it has that of all faults together.
    """

    name: np.ndarray
    reach: np.ndarray
    slope: float
    rattled: float
    strange: float
    quiet: float
    quiet_mean: float
    pooled: np.ndarray

    def plain(self) -> dict[str, Any]:
        """As YAML knows it."""
        return {key: np.asarray(value).tolist() for key, value in vars(self).items()}

    @classmethod
    def restore(cls, given: Mapping[str, Any]) -> Weights:
        """What gave these values."""
        arrays = {key: np.array(given[key]) for key in ("name", "reach", "pooled")}
        return cls(**arrays, **{key: given[key] for key in ("slope", "rattled", "strange", "quiet", "quiet_mean")})

    def logits(self, fits: Fits) -> np.ndarray:
        """Logit (n, faults) of each fault; far below 0 where it was not thought possible."""
        return _logits(self.name, fits)

    def strangeness(self, fits: Fits) -> np.ndarray:
        """rms of a fit's remainder (n,) over its threshold; above 1 a turn is like none of the simulated ones."""
        rattling = np.log1p(np.minimum(fits.rattling, self.rattled))
        return np.sqrt(fits.left / np.exp(self.slope * rattling + self.strange))

    def oddness(self, left: np.ndarray, *, stations_known: bool) -> np.ndarray:
        """The same of turns (n,) without alarm, which are not fitted."""
        return np.sqrt(left / (self.quiet if stations_known else self.quiet_mean))


def spread(fits: Fits) -> np.ndarray:
    """Spread (n, faults) of sizes: their standard deviation times what is left of the turn, as a remainder shows a
    minimum that is not the right one, which lies farther off than noise alone would put it."""
    error = np.where(np.isfinite(fits.error), fits.error, 0.0)
    return np.hypot(error * np.maximum(1.0, fits.left)[:, None], _FLOOR)


def evidence(fits: Fits) -> np.ndarray:
    """1 and asinh(size over spread) of each fault (n, faults, 2)."""
    size = np.abs(fits.size)
    return np.stack([np.ones_like(size), np.arcsinh(size / spread(fits))], axis=2)


def weights_of(
    fits: Fits, there: np.ndarray, size: np.ndarray, sound_left: Sequence[np.ndarray], coverage: float
) -> Weights:
    """From faulty turns (fits, truth) and the remainders of healthy ones, with their stations and by their means, each
    kind for itself: so that the many healthy ones do not decide what may be left of faulty ones."""
    possible = np.isfinite(fits.error)
    x, y = evidence(fits)[possible], there[possible]
    scale = np.maximum(x.std(axis=0), 1.0)

    def loss(w: np.ndarray) -> float:
        z = x @ (w / scale)
        return float((np.logaddexp(0.0, z) - y * z).mean() + _RIDGE * (w[1:] ** 2).sum() / len(y))

    name = minimize(loss, np.zeros(x.shape[1]), method="BFGS").x / scale
    named = _logits(name, fits) > 0.0
    # a fit that names the wrong faults lies in a wrong minimum and tells nothing of what a right one may leave
    right = (named == there).all(axis=1)
    some = right if right.sum() >= LEAST else np.full(len(there), True)
    rattling, left = np.log1p(fits.rattling[some]), np.log(fits.left[some])
    line = np.linalg.lstsq(np.stack([rattling, np.ones_like(rattling)], axis=1), left)[0]
    slope = max(float(line[0]), 0.0)
    strange, (quiet, quiet_mean) = _far(left - slope * rattling), map(_limit, sound_left)
    error = np.abs(fits.size - size) / spread(fits)
    reach, pooled = reaches(error, named & there, named, coverage)
    return Weights(name, reach, slope, float(fits.rattling[some].max()), strange, quiet, quiet_mean, pooled)


def _logits(name: np.ndarray, fits: Fits) -> np.ndarray:
    return np.where(np.isfinite(fits.error), evidence(fits) @ name, IMPOSSIBLE)


def _far(values: np.ndarray) -> float:
    """What lies so far above the median that few bad fits among `values` (n,) do not matter."""
    middle, common = np.quantile(values, (0.5, _COMMON))
    return float(middle + _FAR * (common - middle))


def _limit(values: np.ndarray) -> float:
    """What a share ACCEPTED of new turns stays below; of too few turns to tell it the largest."""
    enough = len(values) >= least_records(ACCEPTED)
    return float(conformal_quantile(values, ACCEPTED) if enough else values.max())


def reaches(
    error: np.ndarray, right: np.ndarray, named: np.ndarray, coverage: float, turns: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Conformal quantiles (faults, 2) of errors in units of their spread, where a fault is rightly named: alone, and
    beside others. A group too small takes its fault's, and a fault with too few turns for the coverage everybody's,
    which the second array (faults,) tells; where all are too few, nothing bounds a size. `turns` (n,) tells looks at
    the same turn, which hang together."""
    turns = np.arange(len(error)) if turns is None else turns
    beside = named.sum(axis=1) > 1

    def reach(mine: np.ndarray, least: int) -> float | None:
        units = np.broadcast_to(turns[:, None], error.shape)[mine]
        enough = len(np.unique(units)) >= max(least, least_records(coverage))
        return conformal_quantile(error[mine], coverage, units) if enough else None

    whole = reach(right, 1)
    found = np.full((error.shape[1], 2), np.inf if whole is None else whole)
    pooled = np.zeros(error.shape[1], dtype=bool)
    for fault in range(error.shape[1]):
        mine = right & (np.arange(error.shape[1]) == fault)
        own = reach(mine, 1)
        pooled[fault] = own is None
        for group in (0, 1):
            those = reach(mine & (beside == bool(group))[:, None], LEAST)
            found[fault, group] = next(r for r in (those, own, found[fault, group]) if r is not None)
    return found, pooled
