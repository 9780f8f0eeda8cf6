"""What measurements say about the name: a Gaussian model of all settings' spectra together, learned from cases.

The spectrum at each setting is projected on its linear discriminants (R. A. Fisher, Annals of Eugenics 7 (1936) 179;
scatter within the classes shrunk towards a multiple of the identity). The projections of all settings of one case are
taken as jointly Gaussian within a component, for the machine is the same at each: what a first measurement says of it
is known when the second comes. A name has COMPONENTS of them, parts of its range of severities.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import scipy.cluster.vq
import scipy.special

from benchmarks.diagnosis.measured import Measured

COMPONENTS = 3
"""Gaussians of a name; one fits the names that combine two faults badly."""

SHRINKAGE = 0.05
"""Share of the identity in the scatter matrices [-]."""


@dataclass(frozen=True, eq=False)
class Conditional:
    """The Gaussians of one setting given what was measured at others: means `base + gain (z - centre)`, d projections.

    Attributes
    ----------
    base : ndarray (g, d)
    gain : ndarray (g, d, m)
        m numbers were measured before.
    centre : ndarray (g, m)
    factor : ndarray (g, d, d)
        Lower Cholesky factor of the covariance.
    whiten : ndarray (g, d, d)
        Its inverse.
    """

    base: np.ndarray
    gain: np.ndarray
    centre: np.ndarray
    factor: np.ndarray
    whiten: np.ndarray

    def means(self, z: np.ndarray) -> np.ndarray:
        """Means (n, g, d) given measured projections (n, m)."""
        return self.base + np.einsum("gdm,ngm->ngd", self.gain, z[:, None, :] - self.centre)

    def log_densities(self, values: np.ndarray, means: np.ndarray) -> np.ndarray:
        """Log densities (n, k, g) of values (n, k, d) under these means, but for a constant."""
        g, d, _ = self.whiten.shape
        white = (values @ self.whiten.reshape(g * d, d).T).reshape(*values.shape[:2], g, d)
        apart = white - np.einsum("gij,ngj->ngi", self.whiten, means)[:, None]
        scale = np.log(np.diagonal(self.whiten, axis1=1, axis2=2)).sum(axis=1)
        return scale - 0.5 * (apart**2).sum(axis=-1)


class Belief:
    """Probabilities of the names given any of the settings' spectra.

    Parameters
    ----------
    cases : Measured
        What it learns from.
    seed : int
        Of the division of the names into components.
    """

    def __init__(self, cases: Measured, seed: int = 0) -> None:
        self.count = int(cases.names.max()) + 1
        settings = range(cases.levels.shape[1])
        self._maps = [_discriminants(cases.levels[:, s], cases.names, self.count) for s in settings]
        z = self.projected(cases.levels)
        self.dimension = z.shape[2]
        flat = z.reshape(len(z), -1)
        members = _components(flat, cases.names, self.count, seed)
        self.owner = np.repeat(np.arange(self.count), COMPONENTS)
        self._means = np.stack([flat[rows].mean(axis=0) for rows in members])
        self._covariances = np.stack([_shrunk(np.cov(flat[rows].T)) for rows in members])
        shares = np.array([len(rows) for rows in members]) / len(flat)
        # each name is as likely, whatever the number of its cases
        self._log_prior = np.log(shares / np.bincount(self.owner, shares)[self.owner] / self.count)

    def projected(self, levels: np.ndarray) -> np.ndarray:
        """Projections (n, settings, d) of spectra (n, settings, bands)."""
        return np.stack([(levels[:, s] - mean) @ directions for s, (mean, directions) in enumerate(self._maps)], axis=1)

    def log_weights(self, taken: tuple[int, ...], z: np.ndarray) -> np.ndarray:
        """Log posterior (n, g) of the components given the projections (n, settings, d) at the settings taken."""
        log = np.tile(self._log_prior, (len(z), 1))
        for place, setting in enumerate(taken):
            before = taken[:place]
            model = self.conditional(before, setting)
            means = model.means(z[:, before].reshape(len(z), -1))
            log += model.log_densities(z[:, [setting]], means)[:, 0]
        return log - scipy.special.logsumexp(log, axis=1, keepdims=True)

    def names(self, weights: np.ndarray) -> np.ndarray:
        """Probabilities of the names (..., names) from those of the components (..., g)."""
        return weights.reshape(*weights.shape[:-1], self.count, COMPONENTS).sum(axis=-1)

    @functools.lru_cache(maxsize=4096)  # noqa: B019 (as many as there are sets of settings; a belief lives as long as its run)
    def conditional(self, taken: tuple[int, ...], setting: int) -> Conditional:
        """The components' Gaussians at a setting, given the projections at those taken."""
        d = self.dimension
        before = [d * s + i for s in taken for i in range(d)]
        now = range(d * setting, d * setting + d)
        means, covariances = self._means, self._covariances
        cross = covariances[:, now][:, :, before]
        own = covariances[:, now][:, :, now]
        gain = np.zeros((len(means), d, len(before)))
        if before:
            gain = np.linalg.solve(covariances[:, before][:, :, before], cross.transpose(0, 2, 1)).transpose(0, 2, 1)
        factor = np.linalg.cholesky(own - gain @ cross.transpose(0, 2, 1))
        return Conditional(means[:, now], gain, means[:, before], factor, np.linalg.inv(factor))


def _discriminants(levels: np.ndarray, names: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean (bands,) and directions (bands, names - 1) in which the scatter within the names is the identity."""
    mean = levels.mean(axis=0)
    centres = np.stack([levels[names == name].mean(axis=0) for name in range(count)])
    rest = levels - centres[names]
    within = _shrunk(rest.T @ rest / len(rest))
    factor = np.linalg.cholesky(within)
    apart = np.linalg.solve(factor, (centres - centres.mean(axis=0)).T)
    main = np.linalg.svd(apart, full_matrices=False)[0][:, : count - 1]
    return mean, np.linalg.solve(factor.T, main)


def _shrunk(covariance: np.ndarray) -> np.ndarray:
    size = len(covariance)
    return (1.0 - SHRINKAGE) * covariance + SHRINKAGE * np.trace(covariance) / size * np.eye(size)


def _components(flat: np.ndarray, names: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Rows of each component, name by name: k-means in the projections."""
    members = []
    for name in range(count):
        rows = np.flatnonzero(names == name)
        _, label = scipy.cluster.vq.kmeans2(flat[rows], COMPONENTS, minit="++", seed=np.random.default_rng(seed))
        members += [rows[label == part] for part in range(COMPONENTS)]
    return members
