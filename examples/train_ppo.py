"""Trains PPO on `indexer_env/Indexer-v1` and measures it beside controllers that need no learning.

    python -m examples.train_ppo [FOLDER] [--seeds 0 1 2] [--steps 4000000]

writes learning.json, learning.png and one policy_SEED.safetensors for each training seed, into
docs/reference/environments where no folder is named, and prints the table of learning.md there. Needs the
extra ``[rl]``.

Trained on machines drawn ±10 % with up to 15° of play in the reducer; measured on other machines, drawn with other
seeds, and on faults that are not among those trained on. The same seed gives the same policy, bit for bit, on the same
machine and versions.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import gymnasium
import torch
from safetensors.torch import load_file, save_file
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy

from examples import learning_report
from examples.dwell_vibration import HALF_WIDTH, ID, PERIOD, PERIODS, RAMP, Policy, best_profile
from indexer_env.stable_baselines import StableBaselinesVecEnv

TRAINING_FAULTS = {"backlash_deg": {"uniform": [0.0, 15.0]}}
FLEET, ROLLOUT = 128, 128
"""Machines that are trained on side by side, and periods of each between two updates."""

STEPS = 4_000_000
"""Control periods in all: 11 hours of machine time."""

SEEDS = (0, 1, 2)
SEEDS_APART = 100_000
"""Distance of the seeds of machines for two training seeds, which have none in common, nor one with a measurement."""


def train(seed: int, steps: int = STEPS, *, fleet: int = FLEET, rollout: int = ROLLOUT) -> ActorCriticPolicy:
    """A policy trained for at least so many steps, in whole rollouts of the fleet."""
    torch.set_num_threads(1)  # sums in another order give other bits
    env = StableBaselinesVecEnv(
        gymnasium.make_vec(
            ID, num_envs=fleet, vectorization_mode="vector_entry_point", autoreset_mode="SameStep",
            half_width=HALF_WIDTH, ramp=RAMP, period=PERIOD,
            faults=TRAINING_FAULTS, max_episode_steps=PERIODS,
        )
    )  # fmt: skip
    model = PPO(
        "MlpPolicy", env, seed=seed, device="cpu", n_steps=rollout, batch_size=min(2048, fleet * rollout), n_epochs=10,
        gamma=0.99, learning_rate=lambda left: 1e-3 * left, policy_kwargs={"log_std_init": -1.5},
    )  # fmt: skip
    env.seed(SEEDS_APART * (1 + seed))
    model.learn(steps)
    return model.policy


def acting(policy: ActorCriticPolicy) -> Policy:
    """The policy without its exploration."""
    return lambda observations: policy.predict(observations, deterministic=True)[0]


def save(policy: ActorCriticPolicy, path: Path) -> None:
    """Write the weights, and nothing that could run."""
    save_file(policy.state_dict(), path)


def load(path: Path) -> ActorCriticPolicy:
    """The policy that `save` wrote."""
    env = StableBaselinesVecEnv(
        gymnasium.make_vec(ID, num_envs=1, vectorization_mode="vector_entry_point", autoreset_mode="SameStep")
    )
    policy = ActorCriticPolicy(env.observation_space, env.action_space, lambda _: 0.0)
    policy.load_state_dict(load_file(path))
    return policy


def main() -> None:
    """The command of the module's docstring."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, default=learning_report.FOLDER)
    parser.add_argument("--seeds", nargs="+", type=int, default=SEEDS, help="one training for each")
    parser.add_argument("--steps", type=int, default=STEPS, help="control periods of a training")
    arguments = parser.parse_args()
    if arguments.steps < 1:
        parser.error(f"--steps must be at least 1, got {arguments.steps}; {STEPS} are what the page reports.")
    arguments.folder.mkdir(parents=True, exist_ok=True)
    policies, seconds = {}, []
    for seed in arguments.seeds:
        begin, cpu_begin = time.perf_counter(), time.process_time()
        policy = train(seed, arguments.steps)
        seconds.append((time.perf_counter() - begin, time.process_time() - cpu_begin))
        save(policy, arguments.folder / f"policy_{seed}.safetensors")
        print(f"seed {seed}: trained in {seconds[-1][0]:.0f} s ({seconds[-1][1]:.0f} s of processor time)", flush=True)
        policies[seed] = acting(policy)
    numbers = best_profile(TRAINING_FAULTS, SEEDS_APART)
    results = learning_report.measure(policies, numbers)
    results["training"] = {"steps": arguments.steps, "seconds": seconds, "torch": torch.__version__}
    learning_report.write(results, arguments.folder)
    print(learning_report.table(results))


if __name__ == "__main__":
    main()
