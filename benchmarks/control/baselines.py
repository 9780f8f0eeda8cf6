"""The return of an episode under any policy, and what constant speeds and random commands reach."""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import numpy as np

import indexer_env  # noqa: F401 (registers the environment)
from indexer_env.registration import MAX_EPISODE_STEPS

ID = "indexer_env/Indexer-v1"
SEED = 1_000_000
"""Of the episodes measured; no training has it."""

EPISODES = 16
"""Episodes of a measurement, each with a start angle of its own."""

SHARES = np.round(np.arange(0.0, 1.0001, 0.005), 3)
"""Constant speeds that are tried [share of nominal]: close enough for every resonance with the index."""

Policy = Callable[[np.ndarray], np.ndarray]


def returns(policy: Policy, episodes: int = EPISODES) -> np.ndarray:
    """Sum of rewards of whole episodes (n,) under a policy of observations (n, 7) to actions (n, 1)."""
    env = gymnasium.make_vec(ID, num_envs=episodes, vectorization_mode="vector_entry_point")
    observations, _ = env.reset(seed=SEED)
    total, over = np.zeros(episodes), np.zeros(episodes, dtype=bool)
    for _ in range(MAX_EPISODE_STEPS):
        observations, rewards, terminated, truncated, _ = env.step(policy(observations))
        total += np.where(over, 0.0, rewards)
        over |= terminated | truncated
    env.close()
    return total


def constant(share: float) -> Policy:
    """Always the same speed [share of nominal]."""
    return lambda observations: np.full((len(observations), 1), 2.0 * share - 1.0)


def best_constant() -> tuple[float, np.ndarray]:
    """The best of SHARES on the very episodes that policies are measured on, and its returns."""
    shares = np.repeat(SHARES, EPISODES)
    found = _together(shares)
    best = int(found.mean(axis=1).argmax())
    return float(SHARES[best]), found[best]


def _together(shares: np.ndarray) -> np.ndarray:
    """Returns (speeds, episodes): every speed drives the same episodes."""
    env = gymnasium.make_vec(ID, num_envs=len(shares), vectorization_mode="vector_entry_point")
    env.reset(seed=[SEED + i % EPISODES for i in range(len(shares))])
    actions, total = 2.0 * shares[:, np.newaxis] - 1.0, np.zeros(len(shares))
    for _ in range(MAX_EPISODE_STEPS):
        total += env.step(actions)[1]
    env.close()
    return total.reshape(-1, EPISODES)


def random(seed: int) -> Policy:
    """Any command of the box, each as likely, anew in every period."""
    rng = np.random.default_rng(seed)
    return lambda observations: rng.uniform(-1.0, 1.0, (len(observations), 1))
