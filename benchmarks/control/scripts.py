"""Two PPO scripts with nothing changed but the environment's name and the number of steps."""

from __future__ import annotations

import os
import time
from typing import Any

import gymnasium
import torch

from benchmarks.control import single_file_ppo
from benchmarks.control.baselines import ID, Policy, returns

NICENESS = 10
"""Of a training's process."""


def stable_baselines3(steps: int, seed: int) -> Policy:
    """The example of stable-baselines3's README."""
    from stable_baselines3 import PPO

    env = gymnasium.make(ID)
    model = PPO("MlpPolicy", env, seed=seed, device="cpu")
    model.learn(total_timesteps=steps)
    return lambda observations: model.predict(observations, deterministic=True)[0]


def cleanrl(steps: int, seed: int) -> Policy:
    """CleanRL's single file by its documented defaults."""
    return single_file_ppo.train(ID, steps, seed)


SCRIPTS = {"stable-baselines3": stable_baselines3, "CleanRL": cleanrl}


def trained(script: str, steps: int, seed: int) -> dict[str, Any]:
    """Train once, in one thread; mean return over whole episodes without exploration, and processor time [s]."""
    os.nice(NICENESS)
    torch.set_num_threads(1)
    begin = time.process_time()
    policy = SCRIPTS[script](steps, seed)
    seconds = time.process_time() - begin
    found = returns(policy)
    return {
        "script": script, "seed": seed, "steps": steps, "seconds": seconds,
        "mean": float(found.mean()), "spread": float(found.std()),
    }  # fmt: skip
