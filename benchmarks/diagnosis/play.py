"""Episodes under a policy: on cases measured beforehand, or in the environment itself, by the same rules."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.diagnosis.measured import Measured
from benchmarks.diagnosis.policies import Known, Policy
from indexer_env.diagnosis import BANDS
from indexer_env.diagnosis_env import IndexerDiagnosisEnv


@dataclass(frozen=True, eq=False)
class Outcome:
    """What n episodes came to: the name was right (n,), cost of the measurements (n,) and their number (n,)."""

    right: np.ndarray
    cost: np.ndarray
    turns: np.ndarray

    def returns(self, right: float, wrong: float) -> np.ndarray:
        """Sum of rewards of each episode (n,)."""
        return np.where(self.right, right, -wrong) - self.cost


def play_measured(policy: Policy, cases: Measured, costs: np.ndarray, budget: float, seed: int) -> Outcome:
    """One episode per case. A setting taken twice costs twice and shows the same."""
    n, settings = len(cases), len(costs)
    rng = np.random.default_rng(seed)
    taken, left = np.zeros((n, settings), dtype=bool), np.full(n, budget)
    named, cost, turns = np.full(n, -1), np.zeros(n), np.zeros(n, dtype=int)
    open_rows = np.arange(n)
    while len(open_rows):
        known = Known(taken[open_rows], cases.levels[open_rows], costs <= left[open_rows, None])
        actions = policy.act(known, rng)
        is_name = actions >= settings
        pays = ~is_name & known.affordable[np.arange(len(known)), np.minimum(actions, settings - 1)]
        named[open_rows[is_name]] = actions[is_name] - settings
        rows, where = open_rows[pays], actions[pays]
        taken[rows, where] = True
        left[rows] -= costs[where]
        cost[rows] += costs[where]
        turns[rows] += 1
        open_rows = rows
    return Outcome(named == cases.names, cost, turns)


def play_in(env: IndexerDiagnosisEnv, policy: Policy, episodes: int, seed: int) -> Outcome:
    """Episodes in the environment, seeded once; the policy sees observations and action masks."""
    rng, settings = np.random.default_rng(seed), len(env.settings)
    right, cost, turns = np.zeros(episodes, dtype=bool), np.zeros(episodes), np.zeros(episodes, dtype=int)
    for episode in range(episodes):
        observation, info = env.reset(seed=seed if episode == 0 else None)
        taken, levels = np.zeros((1, settings), dtype=bool), np.zeros((1, settings, BANDS))
        terminated = False
        while not terminated:
            affordable = info["action_mask"][np.newaxis, :settings].astype(bool)
            action = int(policy.act(Known(taken, levels, affordable), rng)[0])
            observation, reward, terminated, _, info = env.step(action)
            if terminated:
                right[episode] = reward > 0.0
            else:
                taken[0, action], levels[0, action] = True, observation[:BANDS]
                cost[episode] -= reward
                turns[episode] += 1
    return Outcome(right, cost, turns)
