"""Novelty: whether a record is like those of the training at all, so that a fault or a machine never seen is refused
rather than given the nearest name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy.spatial import KDTree

from classifier.dataset import Dataset
from classifier.features import Scaling
from classifier.tasks.conformal import conformal_quantile, least_records
from classifier.tasks.need import count_independent, independent, need
from classifier.tasks.spectrum import Compression, Whitening
from indexer_env.checks import check_choice, check_number

ACCEPTED = 0.95
"""Share of records like those of the training that are accepted."""

_ROUNDING = 1e-9
"""Share by which the threshold is above the score that it is: how a product of matrices rounds a record's last digits
hangs on how many others it is scored with, and the record whose score it is lies within it."""

NOVEL = "is_novel"
"""Column that says whether a record is none of the classes."""

NEIGHBOURS = 5
"""Calibration records whose mean distance is the score "neighbours"."""

SCORES = ("neighbours", "distance", "residual")
"""What may stand for strangeness on the spectrum, t the whitened components of the compressed features z:

neighbours  mean distance |t − t_i| to the nearest calibration records
distance    |t|, that of Mahalanobis
residual    |z − z̄ − its part along the components| / its root mean square over the calibration records (SPE, Q)
"""


@dataclass(frozen=True, eq=False)
class Novelty:
    """A score of how unlike the calibration records a record is, and the threshold above which it is refused.

    score        one of SCORES
    compression, whitening  of the scaled features
    reference    (m, d) components of the calibration records; of no row for scores that need none
    threshold    the score that a share `accepted` of records like those of the training stays below

    The threshold is the conformal quantile of the scores of the control records, those that hang together (see
    `independent`) counted as one, so the share holds for a record of a new file or machine drawn as those were. Where
    these are too few for it, calibration and control records are one, and each is scored by what was fitted to those
    that do not hang together with it: cross-conformal. What hangs together counts as one there, too, since it is such
    groups that are left out and a new one that is expected. The share is then nearly that; its bound
    of 1 − 2 (1 − accepted) is for a new record that each of those fits scores, and here the fit to all does.
    Source: R. F. Barber, E. J. Candès, A. Ramdas, R. J. Tibshirani, Ann. Statist. 49 (2021) 486–507.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "novelty"

    score: str
    accepted: float
    compression: Compression
    whitening: Whitening
    reference: np.ndarray
    threshold: float

    def __post_init__(self) -> None:
        check_choice("Novelty", "score", self.score, SCORES)
        check_number("Novelty", "accepted", self.accepted, low=0.0, high=1.0, low_open=True, high_open=True)
        check_number("Novelty", "threshold", self.threshold, low=0.0)

    @classmethod
    def fit(
        cls,
        dataset: Dataset,
        features: np.ndarray,
        outputs: np.ndarray,
        seed: int,
        score: str = SCORES[0],
        accepted: float = ACCEPTED,
    ) -> Novelty:
        """Fitted to scaled features (n, count) of all records. Raises NotAvailable where control and calibration
        records together are too few."""
        calibration, control = dataset.rows("calibration"), dataset.rows("control")
        if enough(dataset, accepted):
            raw = cls._raw(features[calibration], score, accepted)
            scores, units = raw.scores(features[control]), independent(dataset, control)
        else:
            both = calibration | control
            raw, units = cls._raw(features[both], score, accepted), independent(dataset, both)
            scores = _cross_fitted(features[both], calibration[both], units, score, accepted)
        return replace(raw, threshold=(1.0 + _ROUNDING) * conformal_quantile(scores, accepted, units))

    @classmethod
    def _raw(cls, reference: np.ndarray, score: str, accepted: float) -> Novelty:
        """Fitted to scaled features (m, count) of reference records, without a threshold."""
        compression = Compression.fit(reference)
        compressed = compression.apply(reference)
        whitening = Whitening.fit(compressed)
        components = whitening.apply(compressed)
        kept = components if score == "neighbours" else components[:0]
        return cls(score, accepted, compression, whitening, kept, 0.0)

    def scores(self, features: np.ndarray) -> np.ndarray:
        """Scores (n,) of scaled features (n, count); higher is stranger."""
        compressed = self.compression.apply(features)
        components = self.whitening.apply(compressed)
        if self.score == "neighbours":
            return KDTree(self.reference).query(components, NEIGHBOURS)[0].mean(axis=1)
        if self.score == "distance":
            return np.linalg.norm(components, axis=1)
        return self.whitening.residual(compressed)

    def assess(self, features: np.ndarray, outputs: np.ndarray, records: np.ndarray) -> dict[str, np.ndarray]:
        """What it says of records: novelty (n,), the score over its threshold, and is_novel (n,), true above 1."""
        novelty = self.scores(features) / self.threshold
        return {"novelty": novelty, NOVEL: novelty > 1.0}

    @classmethod
    def restore(cls, body: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Novelty:
        """The part that gave this body and these arrays."""
        return cls(
            body["score"],
            body["accepted"],
            Compression(arrays["knee"]),
            Whitening(arrays["centre"], arrays["axes"], body["spread"]),
            arrays["reference"],
            body["threshold"],
        )

    def body(self) -> dict[str, Any]:
        """All of it that is no array."""
        return {
            "score": self.score,
            "accepted": self.accepted,
            "threshold": self.threshold,
            "spread": self.whitening.spread,
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        return {
            "knee": self.compression.knee,
            "centre": self.whitening.centre,
            "axes": self.whitening.axes,
            "reference": self.reference,
        }


def enough(dataset: Dataset, accepted: float = ACCEPTED) -> bool:
    """Whether a data set has control records enough to set a threshold apart from the calibration records; raises
    NotAvailable where even both together are too few."""
    check_number("Novelty", "accepted", accepted, low=0.0, high=1.0, low_open=True, high_open=True)
    least = least_records(accepted)
    if count_independent(dataset, "control") >= least and dataset.rows("calibration").sum() > NEIGHBOURS:
        return True
    count = count_independent(dataset, "calibration", "control")
    need("independent records of calibration and control", least, count)
    return False


def _cross_fitted(
    features: np.ndarray, calibration: np.ndarray, groups: np.ndarray, score: str, accepted: float
) -> np.ndarray:
    """Scores (n,) of scaled features (n, count), each group's by what is fitted to the others; of those `calibration`
    (n,) the scaling."""
    scores = np.empty(len(features))
    for group in np.unique(groups):
        inside = groups == group
        # A record that took part in the scaling is never beyond its ends, as new ones are.
        scaled = Scaling.fit(features[calibration & ~inside]).apply(features)
        scores[inside] = Novelty._raw(scaled[~inside], score, accepted).scores(scaled[inside])
    return scores
