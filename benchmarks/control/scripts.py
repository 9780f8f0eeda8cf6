"""Two PPO scripts with nothing changed but the environment's name and the number of steps."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch

from benchmarks.control import single_file_ppo
from benchmarks.control.baselines import ID, Policy, returns

NICENESS = 10
"""Of a training's process."""


STEPS = {"stable-baselines3": 30 * 2048, "CleanRL": 1_000_000}
"""Control periods of a training: 51 minutes of machine time, as the README leaves the number open; CleanRL's own."""

MEASURED = 10
"""Times that a policy is measured during a training."""

Watch = Callable[[int, Policy], None]


def stable_baselines3(steps: int, seed: int, watch: Watch) -> None:
    """The example of stable-baselines3's README."""
    from stable_baselines3 import PPO

    env = gymnasium.make(ID)
    model = PPO("MlpPolicy", env, seed=seed, device="cpu")

    def watched(scope: dict[str, Any], _: dict[str, Any]) -> bool:
        done = scope["self"].num_timesteps
        if done % model.n_steps == 1 and done > 1:  # the first step after an update
            watch(done - 1, policy)
        return True

    def policy(observations: np.ndarray) -> np.ndarray:
        return model.predict(observations, deterministic=True)[0]

    model.learn(total_timesteps=steps, callback=watched)
    watch(model.num_timesteps, policy)


def cleanrl(steps: int, seed: int, watch: Watch) -> None:
    """CleanRL's single file by its documented defaults."""
    single_file_ppo.train(ID, steps, seed, watch)


SCRIPTS = {"stable-baselines3": stable_baselines3, "CleanRL": cleanrl}


def trained(script: str, steps: int, seed: int) -> dict[str, Any]:
    """Train once, in one thread; now and then the mean return over whole episodes without exploration, its standard
    deviation, and the steps and the processor time [s] until then."""
    os.nice(NICENESS)
    torch.set_num_threads(1)
    curve: list[list[float]] = []
    every = 2048 * max(1, steps // 2048 // MEASURED)
    begin, away = time.process_time(), 0.0

    def watch(done: int, policy: Policy) -> None:
        nonlocal away
        if done % every and done + 2048 <= steps:
            return
        now = time.process_time()
        found = returns(policy)
        curve.append([done, float(found.mean()), float(found.std()), now - begin - away])
        away += time.process_time() - now  # to measure is not to train
        print(script, seed, curve[-1], flush=True)

    SCRIPTS[script](steps, seed, watch)
    return {"script": script, "seed": seed, "curve": curve}
