"""All policies on the same cases, over seeds; and what each setting tells about each name."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.stats

from benchmarks.diagnosis.belief import Belief
from benchmarks.diagnosis.learned import LearnedPolicy
from benchmarks.diagnosis.measured import Measured, measured
from benchmarks.diagnosis.play import Outcome, play_in, play_measured
from benchmarks.diagnosis.policies import FixedTurns, GreedyInformation, Policy, RandomPolicy
from indexer_env.diagnosis_env import IndexerDiagnosisEnv
from indexer_env.diagnosis_task import Setting

TEACHING_SEED, PRACTICE_SEED = 1000, 2000
"""Of the cases that the belief learns from and of those that policies learn from; the seeds of the evaluation stand
apart."""

LEARNING_SEEDS = (0, 1, 2)
"""Of the learned policies."""

WORTHS = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Reward per bit at which the greedy policy is shown."""

WORTH = 0.2
"""The one that plays in the environment itself."""


@dataclass(frozen=True)
class Size:
    """How much is simulated: cases that the belief learns from, cases that policies learn from, cases of each seed,
    seeds, episodes of each in the environment."""

    teaching: int = 2000
    practice: int = 3000
    cases: int = 500
    seeds: int = 5
    episodes: int = 100


QUICK = Size(teaching=600, practice=600, cases=100, seeds=2, episodes=5)


@dataclass(frozen=True)
class Row:
    """One policy: mean over seeds and half width of the 95 % interval of that mean (Student's t over seeds).

    Attributes
    ----------
    kind, label : str
        Which line of the picture it belongs to; what it is.
    accuracy, cost, turns, returns : tuple of two floats
        Share of right names [-], cost of the measurements [reward], measurements, sum of rewards; of an episode.
    """

    kind: str
    label: str
    accuracy: tuple[float, float]
    cost: tuple[float, float]
    turns: tuple[float, float]
    returns: tuple[float, float]


def label(setting: Setting) -> str:
    """A setting in words."""
    return f"{setting.speed:g} of nominal speed, {setting.brake:g} N m"


def evaluate(env: IndexerDiagnosisEnv, size: Size, say: Callable[[str], None]) -> tuple[list[Row], np.ndarray]:
    """Rows of all policies, and the share of right names (settings, names) after one turn at each setting."""
    say(f"measuring {size.teaching} cases to learn from")
    teaching = measured(env, size.teaching, TEACHING_SEED)
    belief = Belief(teaching)
    say(f"measuring {size.practice} cases to learn from them what to do")
    practice = measured(env, size.practice, PRACTICE_SEED)
    cases = []
    for seed in range(size.seeds):
        say(f"measuring {size.cases} cases of seed {seed}")
        cases.append(measured(env, size.cases, seed))
    rows = []
    for kind, policy, budget in _policies(env, belief, teaching, practice):
        say(policy.label)
        plays = [play_measured(policy, each, env.costs, budget, seed) for seed, each in enumerate(cases)]
        rows.append(_row(env, kind, policy.label, plays))
    policy = GreedyInformation(belief, env.costs, WORTH)
    say(f"{policy.label}, in the environment")
    plays = [play_in(env, policy, size.episodes, seed) for seed in range(size.seeds)]
    rows.append(_row(env, "in the environment", f"{policy.label}, in the environment itself", plays))
    return rows, told(belief, cases)


def _policies(
    env: IndexerDiagnosisEnv, belief: Belief, teaching: Measured, practice: Measured
) -> list[tuple[str, Policy, float]]:
    """Kind, policy and budget; a budget without end for what shows the ceiling."""
    task = env.task
    budget, every = env.task.budget, tuple(range(len(env.settings)))
    turns = [FixedTurns(label(env.settings[s]), belief, (s,)) for s in every]
    pair = max(
        (FixedTurns("", belief, settings) for settings in itertools.combinations(every, 2)),
        key=lambda policy: _mean_return(env, policy, teaching),
    )
    pair.label = "; ".join(label(env.settings[s]) for s in pair.settings)
    return [
        ("random", RandomPolicy(len(env.names)), budget),
        *(("one fixed turn", policy, budget) for policy in turns),
        ("best two fixed turns", pair, budget),
        *(("greedy information", GreedyInformation(belief, env.costs, worth), budget) for worth in WORTHS),
        *(
            ("learned", LearnedPolicy(belief, practice, env.costs, budget, task.right, task.wrong, seed), budget)
            for seed in LEARNING_SEEDS
        ),
        ("all turns", FixedTurns("every setting once, whatever it costs", belief, every), float("inf")),
    ]


def _mean_return(env: IndexerDiagnosisEnv, policy: Policy, cases: Measured) -> float:
    outcome = play_measured(policy, cases, env.costs, env.task.budget, 0)
    return float(outcome.returns(env.task.right, env.task.wrong).mean())


def told(belief: Belief, cases: list[Measured]) -> np.ndarray:
    """Share of right names (settings, names) after one turn at each setting."""
    names = np.concatenate([each.names for each in cases])
    z = belief.projected(np.concatenate([each.levels for each in cases]))
    shares = np.zeros((z.shape[1], belief.count))
    for setting in range(z.shape[1]):
        likeliest = belief.names(np.exp(belief.log_weights((setting,), z))).argmax(axis=1)
        shares[setting] = [np.mean(likeliest[names == name] == name) for name in range(belief.count)]
    return shares


def _row(env: IndexerDiagnosisEnv, kind: str, name: str, plays: list[Outcome]) -> Row:
    task = env.task
    return Row(
        kind, name,
        _interval([play.right.mean() for play in plays]),
        _interval([play.cost.mean() for play in plays]),
        _interval([play.turns.mean() for play in plays]),
        _interval([play.returns(task.right, task.wrong).mean() for play in plays]),
    )  # fmt: skip


def _interval(values: list[float]) -> tuple[float, float]:
    """Mean and half width of its 95 % interval."""
    spread = float(np.std(values, ddof=1)) / len(values) ** 0.5
    return float(np.mean(values)), float(scipy.stats.t.ppf(0.975, len(values) - 1)) * spread
