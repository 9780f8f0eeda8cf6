"""Novelty: whether a record is like those of the training at all, so that a fault or a machine never seen is refused
rather than given the nearest name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.spatial import KDTree

from classifier.dataset import Dataset
from classifier.tasks.conformal import conformal_quantile, least_records
from classifier.tasks.spectrum import Compression, Whitening
from indexer_env.checks import check_choice, check_number

ACCEPTED = 0.95
"""Share of records like those of the training that are accepted."""

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

    The threshold is the conformal quantile of the scores of the control records, so the share holds for new records of
    machines drawn as those were. Raises ParameterError.
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
    ) -> Novelty | None:
        """Fitted to scaled features (n, count) of all records; None where the control records are too few."""
        calibration, control = features[dataset.rows("calibration")], features[dataset.rows("control")]
        if len(control) < least_records(accepted) or len(calibration) <= NEIGHBOURS:
            return None
        compression = Compression.fit(calibration)
        compressed = compression.apply(calibration)
        whitening = Whitening.fit(compressed)
        components = whitening.apply(compressed)
        reference = components if score == "neighbours" else components[:0]
        raw = cls(score, accepted, compression, whitening, reference, 0.0)
        return cls(
            score, accepted, compression, whitening, reference, conformal_quantile(raw.scores(control), accepted)
        )

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
        return {"novelty": novelty, "is_novel": novelty > 1.0}

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
