"""What a controller of `indexer_env/Indexer-v1` is worth: its throughput, and how tables ring where work is done.

Any policy, a function of observations (n, 7) that returns actions (n, 1), is measured by `score` on machines
whose joints are drawn ±10 % and on several faults. Two controllers stand here that need no learning: `constant`, and
`profile`, a speed that depends on the cam's phase alone, whose numbers `best_profile` finds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

import indexer_env

Policy = Callable[[np.ndarray], np.ndarray]

ID = "indexer_env/Indexer-v1"
RAMP = 5.0
"""Of the inverter's command [share of nominal per s]: a servo drive's, 0.05 in a period, twenty times the environment's
default. What is measured here is what fast control of the speed can do."""

PERIOD = 0.01
"""Control period [s], for the same reason a fifth of the environment's default."""

HALF_WIDTH = 0.1
"""Of the law by which joints are drawn [-]: the paper's ±10 %."""

MACHINES = 32
"""Machines for each seed of a measurement; the machine i of seed s is that of an environment with the seed s + i."""

PERIODS, SKIPPED = 1640, 205
"""Control periods of a measurement (two table turns at nominal speed), and how many at its start do not count: two cam
turns, in which the start dies away."""

COSINE, SINE = 4, 5
"""Places of the cam's phase in an observation."""

HARMONICS = 4
"""Of the cam turn in a profile: 9 numbers."""


@dataclass(frozen=True)
class Score:
    """What a policy did on the machines of some seeds.

    Attributes
    ----------
    throughput : ndarray (s,)
        Indexes per second over nominal [-], mean over a seed's machines.
    vibration : ndarray (s,)
        rms of the table's true acceleration in the dwell [rad/s²], mean over a seed's machines.
    reward : ndarray (s,)
        Mean reward of a step.
    """

    throughput: np.ndarray
    vibration: np.ndarray
    reward: np.ndarray


def score(
    policy: Policy, faults: Mapping[str, Any], seeds: Sequence[int], *, machines: int = MACHINES, periods: int = PERIODS
) -> Score:
    """Measure a policy on `machines` machines with these faults for each of the seeds."""
    env = _fleet(len(seeds) * machines, faults)
    dwell_begin = 2.0 * math.pi * indexer_env.load_machine().motion_share
    observations, _ = env.reset(seed=[seed + i for seed in seeds for i in range(machines)])
    squares, samples, rewards = np.zeros(env.num_envs), np.zeros(env.num_envs), np.zeros(env.num_envs)
    begin = cam = np.zeros(env.num_envs)
    for period in range(periods):
        observations, reward, terminated, _, info = env.step(policy(observations))
        if terminated.any():
            raise ArithmeticError(f"machine {int(np.argmax(terminated))} left the model's range in period {period}")
        angles, accelerations = info["truth"]["cam_angle"], info["truth"]["table_acceleration"]
        cam = angles[:, -1]
        if period < SKIPPED:
            begin = cam
            continue
        dwelling = np.mod(angles, 2.0 * math.pi) >= dwell_begin
        squares += (accelerations**2 * dwelling).sum(axis=1)
        samples += dwelling.sum(axis=1)
        rewards += reward
    env.close()
    counted = periods - SKIPPED
    way = counted * env.unwrapped.task.period * _nominal_cam_rate()
    vibration = np.sqrt(squares / np.maximum(samples, 1.0))
    return Score(*(values.reshape(len(seeds), machines).mean(axis=1) for values in
                   ((cam - begin) / way, vibration, rewards / counted)))  # fmt: skip


def _fleet(count: int, faults: Mapping[str, Any]) -> Any:
    """Machines drawn ±10 %, one long episode each, that show what no bench does."""
    return gymnasium.make_vec(
        ID, num_envs=count, vectorization_mode="vector_entry_point", half_width=HALF_WIDTH, ramp=RAMP,
        period=PERIOD, faults=dict(faults), reveal=True, max_episode_steps=10**9,
    )  # fmt: skip


def _nominal_cam_rate() -> float:
    """rad/s."""
    return indexer_env.load_machine().reduction * indexer_env.load_operating_point().motor_speed


def constant(share: float) -> Policy:
    """Always the same speed [share of nominal]."""
    return lambda observations: np.full((len(observations), 1), 2.0 * share - 1.0)


def profile(numbers: np.ndarray) -> Policy:
    """A speed that depends on the cam's phase α: a0 + Σ (a_k cos kα + b_k sin kα) [share of nominal], k to HARMONICS,
    within [0, 1].

    numbers : a0, a1, b1, a2, b2 … (9,) for all machines, or (n, 9), one row for each.
    """

    def policy(observations: np.ndarray) -> np.ndarray:
        phase = observations[:, COSINE].astype(float) + 1j * observations[:, SINE]
        waves = np.stack([phase**k for k in range(1, HARMONICS + 1)], axis=1)
        terms = np.stack([waves.real, waves.imag], axis=2).reshape(len(phase), 2 * HARMONICS)
        speed = (np.column_stack([np.ones(len(phase)), terms]) * numbers).sum(axis=1)
        return 2.0 * np.clip(speed, 0.0, 1.0)[:, np.newaxis] - 1.0

    return policy


def best_profile(faults: Mapping[str, Any], seed: int, *, machines: int = 8, generations: int = 120) -> np.ndarray:
    """The numbers (9,) of the profile with the highest mean reward on machines with faults drawn with a seed, found by
    SciPy's differential evolution: what one can reach that sees the cam but does not look at the table."""
    from scipy.optimize import differential_evolution

    def losses(candidates: np.ndarray) -> np.ndarray:
        """(9, c) -> (c,); every candidate drives the same machines."""
        count = candidates.shape[1]
        policy = profile(np.repeat(candidates.T, machines, axis=0))
        return -score(policy, faults, [seed] * count, machines=machines, periods=SKIPPED + 205).reward

    bounds = [(0.5, 1.4)] + [(-0.5, 0.5)] * (2 * HARMONICS)
    found = differential_evolution(
        losses, bounds, vectorized=True, updating="deferred", popsize=6, maxiter=generations, seed=seed, polish=False
    )
    return found.x
