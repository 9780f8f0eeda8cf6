"""Baselines of the diagnosis task; each chooses actions for many episodes at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import scipy.special

from benchmarks.diagnosis.belief import Belief

DRAWS = 4
"""Measurements imagined per component of the belief to estimate what one is worth."""

NEGLIGIBLE = 1e-3
"""Probability of a component below which nothing is imagined of it: its share of the expected information is small."""


@dataclass(frozen=True, eq=False)
class Known:
    """What is known in n episodes.

    Attributes
    ----------
    taken : ndarray (n, settings) of bool
        Settings measured so far.
    levels : ndarray (n, settings, bands)
        The spectra; what is not taken is not to be looked at.
    affordable : ndarray (n, settings) of bool
        Settings that the budget still pays.
    """

    taken: np.ndarray
    levels: np.ndarray
    affordable: np.ndarray

    def __len__(self) -> int:
        return len(self.taken)

    def __getitem__(self, rows: np.ndarray) -> Known:
        return Known(self.taken[rows], self.levels[rows], self.affordable[rows])


class Policy(ABC):
    """A policy: settings come before names in the numbering of its actions, as in the environment."""

    label: str

    @abstractmethod
    def act(self, known: Known, rng: np.random.Generator) -> np.ndarray:
        """An action for each episode, (n,) of int."""


class RandomPolicy(Policy):
    """Any action that the mask allows, each as likely."""

    def __init__(self, names: int) -> None:
        self.label, self._names = "random", names

    def act(self, known: Known, rng: np.random.Generator) -> np.ndarray:
        allowed = np.concatenate([known.affordable, np.ones((len(known), self._names), dtype=bool)], axis=1)
        return np.argmax(np.where(allowed, rng.random(allowed.shape), -1.0), axis=1)


class FixedTurns(Policy):
    """The same turns in every episode, then the likeliest name."""

    def __init__(self, label: str, belief: Belief, settings: tuple[int, ...]) -> None:
        self.label, self._belief, self.settings = label, belief, settings

    def act(self, known: Known, rng: np.random.Generator) -> np.ndarray:
        missing = [s for s in self.settings if not known.taken[0, s]]
        if missing:
            return np.full(len(known), missing[0])
        z = self._belief.projected(known.levels)
        weights = np.exp(self._belief.log_weights(self.settings, z))
        return known.taken.shape[1] + self._belief.names(weights).argmax(axis=1)


class GreedyInformation(Policy):
    """The turn whose expected information is worth most above its cost; the likeliest name once none is worth it.

    Expected information: the entropy of the names less that expected after the turn, E log2 p(name | turn) -
    log2 p(name) (D. V. Lindley, Annals of Mathematical Statistics 27 (1956) 986), by Monte Carlo over the belief.

    Parameters
    ----------
    belief : Belief
    costs : ndarray (settings,)
    worth : float
        Reward that a bit of information is taken to be worth.
    seed : int
        Of the measurements imagined.
    """

    def __init__(self, belief: Belief, costs: np.ndarray, worth: float, seed: int = 0) -> None:
        self.label = f"greedy information, {worth:g} per bit"
        self._belief, self._costs, self.worth = belief, costs, worth
        self._normals = np.random.default_rng(seed).standard_normal((len(belief.owner), DRAWS, belief.dimension))

    def act(self, known: Known, rng: np.random.Generator) -> np.ndarray:
        z = self._belief.projected(known.levels)
        actions = np.zeros(len(known), dtype=int)
        patterns, of = np.unique(known.taken, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            rows = np.flatnonzero(of.ravel() == number)
            taken = tuple(np.flatnonzero(pattern).tolist())
            log_weights = self._belief.log_weights(taken, z[rows])
            profit = np.full((len(rows), len(pattern)), -np.inf)
            for setting in np.flatnonzero(~pattern):
                gain = self._information(taken, int(setting), z[rows], log_weights)
                profit[:, setting] = self.worth * gain - self._costs[setting]
            profit[~known.affordable[rows]] = -np.inf
            likeliest = self._belief.names(np.exp(log_weights)).argmax(axis=1)
            best = profit.argmax(axis=1)
            actions[rows] = np.where(profit.max(axis=1) > 0.0, best, len(pattern) + likeliest)
        return actions

    def _information(self, taken: tuple[int, ...], setting: int, z: np.ndarray, log_weights: np.ndarray) -> np.ndarray:
        """Expected information of a turn at a setting [bit], (n,)."""
        model = self._belief.conditional(taken, setting)
        if not taken:  # as long as nothing is known all episodes are the same
            z, log_weights = z[:1], log_weights[:1]
        means = model.means(z[:, taken].reshape(len(z), -1))
        weights = np.exp(log_weights)
        after = np.zeros(len(z))
        for component, normals in enumerate(self._normals):
            rows = np.flatnonzero(weights[:, component] > NEGLIGIBLE)
            values = means[rows, component, None] + normals @ model.factor[component].T
            log = log_weights[rows, None, :] + model.log_densities(values, means[rows])
            posterior = np.exp(log - scipy.special.logsumexp(log, axis=-1, keepdims=True))
            after[rows] += weights[rows, component] * _entropy(self._belief.names(posterior)).mean(axis=1)
        return _entropy(self._belief.names(weights)) - after


def _entropy(probabilities: np.ndarray) -> np.ndarray:
    """Entropy [bit] over the last axis."""
    return scipy.special.entr(probabilities).sum(axis=-1) / np.log(2.0)
