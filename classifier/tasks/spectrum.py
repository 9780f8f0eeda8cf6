"""Scaled features as severities and novelty are judged on: compressed like a logarithm, and whitened."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from indexer_env.checks import check_number
from indexer_env.errors import refuse


@dataclass(frozen=True, eq=False)
class Compression:
    """Each feature on a scale that is logarithmic where it is large and linear where it is small.

        z_j = asinh(x_j / m_j),   m_j a low quantile of |x_j| over the calibration records

    knee  (count,) m_j > 0, in the unit of the scaled features

    Densities span decades, so that a linear scale shows the strongest records alone; the logarithm itself has no value
    for a feature below the least of the calibration records, which scaling puts below 0. Features that are logarithms
    already are hardly changed.
    Source: J. B. Burbidge, L. Magee, A. L. Robb, J. Am. Stat. Assoc. 83 (1988) 123–127.

    Raises ParameterError.
    """

    knee: np.ndarray

    def __post_init__(self) -> None:
        if self.knee.ndim != 1 or not (np.isfinite(self.knee).all() and (self.knee > 0).all()):
            raise refuse("Compression", "knee", "a vector of finite numbers > 0", "another")

    @classmethod
    def fit(cls, features: np.ndarray, quantile: float = 0.1) -> Compression:
        """Compression fitted to scaled features (n, count) of the calibration records."""
        knee = np.quantile(np.abs(features), quantile, axis=0)
        # A feature that does not vary, or of which most records have none, is compressed as the others are.
        usual = np.median(knee[knee > 0]) if (knee > 0).any() else 1.0
        return cls(np.where(knee > 0, knee, usual))

    def apply(self, features: np.ndarray) -> np.ndarray:
        """Compressed features (n, count)."""
        return np.arcsinh(features / self.knee)


@dataclass(frozen=True, eq=False)
class Standard:
    """Each feature with mean 0 and standard deviation 1 over the calibration records; 0 where it does not vary there.

    mean, deviation  (count,)
    """

    mean: np.ndarray
    deviation: np.ndarray

    @classmethod
    def fit(cls, features: np.ndarray) -> Standard:
        """Fitted to features (n, count) of the calibration records."""
        return cls(features.mean(axis=0), features.std(axis=0))

    def apply(self, features: np.ndarray) -> np.ndarray:
        """Standardised features (n, count)."""
        flat = self.deviation == 0.0
        return np.where(flat, 0.0, (features - self.mean) / np.where(flat, 1.0, self.deviation))


@dataclass(frozen=True, eq=False)
class Whitening:
    """Principal components of the compressed features, each with mean 0 and variance 1 over the calibration records.

        t = (z − z̄) V,   V = (v_1/√λ_1 … v_d/√λ_d),   λ, v eigenvalues and eigenvectors of the covariance of z

    centre   (count,) z̄
    axes     (count, d) V
    spread   standard deviation of what the d components leave of a record, over all count features
    """

    centre: np.ndarray
    axes: np.ndarray
    spread: float

    def __post_init__(self) -> None:
        if self.centre.ndim != 1 or self.axes.ndim != 2 or len(self.axes) != len(self.centre):
            raise refuse("Whitening", "axes", f"of shape ({len(self.centre)}, d)", self.axes.shape)
        check_number("Whitening", "spread", self.spread, low=0.0)

    @classmethod
    def fit(cls, compressed: np.ndarray, share: float = 0.999) -> Whitening:
        """Whitening with the fewest components that hold a share of the variance of (n, count) compressed features."""
        centre = compressed.mean(axis=0)
        _, singular, rows = np.linalg.svd(compressed - centre, full_matrices=False)
        variances = singular**2 / max(1, len(compressed) - 1)
        if variances.sum() == 0.0:
            raise refuse("Whitening", "features", "features that vary over the calibration records", "constant ones")
        kept = 1 + int(np.searchsorted(np.cumsum(variances) / variances.sum(), share))
        kept = min(kept, int((variances > 1e-12 * variances[0]).sum()))
        return cls(centre, rows[:kept].T / np.sqrt(variances[:kept]), float(np.sqrt(variances[kept:].sum())))

    def apply(self, compressed: np.ndarray) -> np.ndarray:
        """Whitened components (n, d)."""
        return (compressed - self.centre) @ self.axes

    def residual(self, compressed: np.ndarray) -> np.ndarray:
        """Root mean square (n,) of what the components leave of compressed features (n, count), over `spread`."""
        centred = compressed - self.centre
        directions = self.axes / np.linalg.norm(self.axes, axis=0)
        rest = centred - centred @ directions @ directions.T
        return np.linalg.norm(rest, axis=1) / max(self.spread, np.finfo(np.float64).tiny)
