"""Trains PPO on `indexer_env/Indexer-v1` with machines, policy and updates on one device, in torch alone.

    python -m examples.train_ppo_device [--device cuda] [--fleet 16384] [--rollout 64] [--updates 100] [--seed 0]

prints the mean reward of each rollout and the control periods per second. On a GPU (extra ``[cuda]``) observations,
rewards and actions never visit the host. The algorithm is PPO with clipped ratios and generalised advantages (Schulman
et al., Proximal Policy Optimization Algorithms, 2017), on machines drawn ±10 % with up to 15° of play in the reducer.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import nn

import indexer_env

ID = "indexer_env/Indexer-v1"
FAULTS = {"backlash_deg": {"uniform": [0.0, 15.0]}}
DISCOUNT, TRACE, CLIP = 0.99, 0.95, 0.2
EPOCHS, PARTS, RATE, MOST_GRADIENT = 4, 8, 1e-3, 0.5
"""Passes over a rollout, parts of a pass, learning rate, bound of the gradient's norm."""


class Policy(nn.Module):
    """Mean and spread of a normal action, and the value of an observation."""

    def __init__(self, seen: int, actions: int) -> None:
        super().__init__()

        def net(outputs: int) -> nn.Sequential:
            return nn.Sequential(nn.Linear(seen, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs))

        self.mean, self.value = net(actions), net(1)
        self.log_spread = nn.Parameter(torch.full((actions,), -1.5))

    def actions(self, observations: torch.Tensor) -> torch.distributions.Normal:
        """The actions' distribution, before they are cut to their box."""
        return torch.distributions.Normal(self.mean(observations), self.log_spread.exp())

    def worth(self, observations: torch.Tensor) -> torch.Tensor:
        """Discounted rewards expected from here (…,)."""
        return self.value(observations).squeeze(-1)


@dataclass
class Rollout:
    """What a fleet did, each (periods, fleet, …)."""

    observations: torch.Tensor
    actions: torch.Tensor
    log_chances: torch.Tensor
    advantages: torch.Tensor
    returns: torch.Tensor

    def parts(self, generator: torch.Generator) -> Iterator[list[torch.Tensor]]:
        """PARTS random parts of all periods of all machines."""
        flat = [values.flatten(0, 1) for values in vars(self).values()]
        order = torch.randperm(len(flat[0]), generator=generator, device=generator.device)
        for part in order.chunk(PARTS):
            yield [values[part] for values in flat]


class Fleet:
    """The environment with torch tensors on either device."""

    def __init__(self, device: str, size: int, seed: int) -> None:
        self._env: Any = gymnasium.make_vec(
            ID, num_envs=size, vectorization_mode="vector_entry_point", autoreset_mode="SameStep", device=device,
            half_width=0.1, faults=FAULTS,
        )  # fmt: skip
        self._tensors = device != "cpu"
        self.observations = torch.as_tensor(self._env.reset(seed=seed)[0])
        self.actions = self._env.single_action_space.shape[0]

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
        """One control period: rewards, terminated, truncated (fleet,), and what was seen where episodes ended."""
        given = actions.clamp(-1.0, 1.0)
        observations, *outcome, infos = self._env.step(given if self._tensors else given.numpy())
        rewards, terminated, truncated = (torch.as_tensor(values) for values in outcome)
        self.observations = torch.as_tensor(observations)
        last = self.observations.clone()
        if self._tensors and "final_obs" in infos:
            last = infos["final_obs"]
        elif "final_obs" in infos:
            ended = np.flatnonzero(infos["_final_obs"])
            last[ended] = torch.from_numpy(np.stack(infos["final_obs"][ended]))
        return rewards.float(), terminated, truncated, last


@torch.no_grad()
def roll_out(fleet: Fleet, policy: Policy, periods: int) -> tuple[Rollout, float]:
    """What the policy does for so many periods, and the mean reward of a period."""
    steps: list[tuple[torch.Tensor, ...]] = []
    for _ in range(periods):
        seen = fleet.observations
        chosen = policy.actions(seen)
        actions = chosen.sample()
        rewards, terminated, truncated, last = fleet.step(actions)
        # an episode that was cut short would have gone on: its last observation stands for what was to come
        future = policy.worth(last) * ~terminated
        steps.append((seen, actions, chosen.log_prob(actions).sum(-1), policy.worth(seen), rewards, future,
                      terminated | truncated))  # fmt: skip
    seen, actions, log_chances, worth, rewards, future, ended = (torch.stack(each) for each in zip(*steps, strict=True))
    advantages, trace = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
    for k in reversed(range(periods)):
        trace = rewards[k] + DISCOUNT * future[k] - worth[k] + DISCOUNT * TRACE * trace * ~ended[k]
        advantages[k] = trace
    return Rollout(seen, actions, log_chances, advantages, advantages + worth), float(rewards.mean())


def update(policy: Policy, optimiser: torch.optim.Optimizer, rollout: Rollout, generator: torch.Generator) -> None:
    """EPOCHS passes of PPO's clipped loss over a rollout."""
    for _ in range(EPOCHS):
        for seen, actions, log_chances, advantages, returns in rollout.parts(generator):
            ratio = (policy.actions(seen).log_prob(actions).sum(-1) - log_chances).exp()
            scaled = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
            gain = torch.minimum(ratio * scaled, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * scaled)
            loss = 0.5 * (policy.worth(seen) - returns).square().mean() - gain.mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(policy.parameters(), MOST_GRADIENT)
            optimiser.step()


def train(device: str, fleet: int, rollout: int, updates: int, seed: int = 0) -> tuple[Policy, list[float]]:
    """A trained policy, and the mean reward of a period in each rollout."""
    torch.manual_seed(seed)
    machines = Fleet(device, fleet, seed)
    place = machines.observations.device
    policy = Policy(machines.observations.shape[1], machines.actions).to(place)
    optimiser = torch.optim.Adam(policy.parameters(), lr=RATE)
    generator = torch.Generator(device=place).manual_seed(seed)
    rewards = []
    for number in range(updates):
        begin = time.perf_counter()
        done, reward = roll_out(machines, policy, rollout)
        rolled = time.perf_counter() - begin
        update(policy, optimiser, done, generator)
        rewards.append(reward)
        print(f"{number + 1}: mean reward {reward:.3f}, {fleet * rollout / rolled:.3g} periods/s", flush=True)
    return policy, rewards


def main() -> None:
    """The command of the module's docstring."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--device", default="cuda", help="cpu, cuda or cuda:N")
    for name, value in (("fleet", 16384), ("rollout", 64), ("updates", 100), ("seed", 0)):
        parser.add_argument(f"--{name}", type=int, default=value)
    arguments = parser.parse_args()
    try:
        train(arguments.device, arguments.fleet, arguments.rollout, arguments.updates, arguments.seed)
    except indexer_env.ParameterError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
