"""A policy learned on beliefs: fitted Q-iteration, backwards from the last turn that it may take.

The state is the belief (probabilities of the names), the settings taken and with them the budget left. As every case
was measured at every setting, each state of it shows what every action leads to, so nothing is explored: the value of a
turn is regressed on the values of the beliefs it led to (D. Ernst et al., JMLR 6 (2005) 503), that of stopping on
whether the likeliest name was right, which also corrects a belief that is too sure of itself.
"""

from __future__ import annotations

import itertools

import numpy as np
import torch
from torch import nn

from benchmarks.diagnosis.belief import Belief
from benchmarks.diagnosis.measured import Measured
from benchmarks.diagnosis.policies import Known, Policy

MOST_TURNS = 3
"""Turns after which a name is given: greedy information takes 1.7 on average."""

EPOCHS, BATCH, LEARNING_RATE = 8, 1024, 2e-3
"""Of a regression with Adam, whose rate falls in a straight line to 0."""

UNLIKELY = 1e-4
"""Probability below which the network does not tell names apart: it sees logarithms."""


class LearnedPolicy(Policy):
    """Takes the turn or the name with the highest value.

    Parameters
    ----------
    belief : Belief
    cases : Measured
        Others than the belief has learned from, on which it would be too sure.
    costs : ndarray (settings,)
    budget : float
    right, wrong : float
        Reward for the right name, loss for a wrong one.
    seed : int
        Of the networks' weights and of the order of the cases.
    """

    def __init__(
        self, belief: Belief, cases: Measured, costs: np.ndarray, budget: float, right: float, wrong: float, seed: int
    ) -> None:
        self.label = f"learned on beliefs, seed {seed}"
        self._belief, self._costs, self._rewards = belief, costs, (right, wrong)
        self._nets: dict[int, nn.Module] = {}
        torch.manual_seed(seed)
        z = belief.projected(cases.levels)
        for turns in reversed(range(MOST_TURNS + 1)):
            patterns = [
                taken
                for taken in itertools.combinations(range(len(costs)), turns)
                if costs[list(taken)].sum() <= budget
            ]
            self._nets[turns] = self._fitted(patterns, cases.names, z, budget)

    def act(self, known: Known, rng: np.random.Generator) -> np.ndarray:
        actions = np.zeros(len(known), dtype=int)
        z = self._belief.projected(known.levels)
        patterns, of = np.unique(known.taken, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            rows = np.flatnonzero(of.ravel() == number)
            taken = tuple(np.flatnonzero(pattern).tolist())
            names = self._names(taken, z[rows])
            values = self._values(taken, names)
            values[:, :-1][~known.affordable[rows] | pattern] = -np.inf
            best = values.argmax(axis=1)
            actions[rows] = np.where(best < len(pattern), best, len(pattern) + names.argmax(axis=1))
        return actions

    def _names(self, taken: tuple[int, ...], z: np.ndarray) -> np.ndarray:
        """Probabilities of the names (n, names)."""
        return self._belief.names(np.exp(self._belief.log_weights(taken, z)))

    def _values(self, taken: tuple[int, ...], names: np.ndarray) -> np.ndarray:
        """Values (n, settings + 1) of a turn at each setting and, last, of the likeliest name."""
        values = np.full((len(names), len(self._costs) + 1), -np.inf)
        if len(taken) not in self._nets:
            values[:, -1] = 0.0
            return values
        with torch.no_grad():
            found = self._nets[len(taken)](self._seen(taken, names)).numpy()
        if len(taken) < MOST_TURNS:
            values[:, :-1] = found[:, :-1]
        values[:, -1] = found[:, -1]
        return values

    def _seen(self, taken: tuple[int, ...], names: np.ndarray) -> torch.Tensor:
        """What the network is given (n, names + settings): log probabilities, and which settings were taken."""
        flags = np.zeros((len(names), len(self._costs)))
        flags[:, list(taken)] = 1.0
        return torch.as_tensor(np.concatenate([np.log(names + UNLIKELY), flags], axis=1), dtype=torch.float32)

    def _fitted(self, patterns: list[tuple[int, ...]], truths: np.ndarray, z: np.ndarray, budget: float) -> nn.Module:
        """The network of all states in which the settings of one of the patterns were taken."""
        seen, targets = [], []
        for taken in patterns:
            names = self._names(taken, z)
            seen.append(self._seen(taken, names))
            targets.append(self._targets(taken, names, truths, z, budget))
        return _regressed(torch.cat(seen), torch.as_tensor(np.concatenate(targets), dtype=torch.float32))

    def _targets(
        self, taken: tuple[int, ...], names: np.ndarray, truths: np.ndarray, z: np.ndarray, budget: float
    ) -> np.ndarray:
        """What each action came to in each case (n, settings + 1); NaN where it cannot be taken."""
        right, wrong = self._rewards
        targets = np.full((len(z), len(self._costs) + 1), np.nan)
        targets[:, -1] = np.where(names.argmax(axis=1) == truths, right, -wrong)
        left = budget - self._costs[list(taken)].sum()
        for setting in range(len(self._costs)) if len(taken) < MOST_TURNS else ():
            if setting not in taken and self._costs[setting] <= left:
                after = tuple(sorted((*taken, setting)))
                values = self._values(after, self._names(after, z))
                affordable = [*(self._costs <= left - self._costs[setting]), True]
                affordable = np.array(affordable) & ~np.isin(np.arange(len(affordable)), after)
                targets[:, setting] = values[:, affordable].max(axis=1) - self._costs[setting]
        return targets


def _regressed(seen: torch.Tensor, targets: torch.Tensor) -> nn.Module:
    """A network with two hidden layers of 64 whose outputs are the means of the targets, those that are there."""
    net = nn.Sequential(
        nn.Linear(seen.shape[1], 64), nn.ReLU(), nn.Linear(64, 64), nn.ReLU(), nn.Linear(64, targets.shape[1])
    )
    there = ~targets.isnan()
    wanted = torch.where(there, targets, 0.0)
    optimiser = torch.optim.Adam(net.parameters(), lr=LEARNING_RATE)
    for epoch in range(EPOCHS):
        optimiser.param_groups[0]["lr"] = LEARNING_RATE * (1.0 - epoch / EPOCHS)
        for rows in torch.randperm(len(seen)).split(BATCH):
            optimiser.zero_grad()
            loss = (((net(seen[rows]) - wanted[rows]) * there[rows]) ** 2).sum() / there[rows].sum()
            loss.backward()
            optimiser.step()
    return net
