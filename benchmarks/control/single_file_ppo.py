"""PPO for continuous actions as CleanRL documents its single file `ppo_continuous_action.py`, in plain torch.

Wrappers, network and every hyper-parameter are the documented defaults (https://docs.cleanrl.dev, S. Huang et al., JMLR
23 (2022) 274); only the number of steps is chosen. One environment, since `num_envs` is 1 there.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

STEPS_A_ROLLOUT, MINIBATCHES, EPOCHS = 2048, 32, 10
GAMMA, GAE_LAMBDA, LEARNING_RATE = 0.99, 0.95, 3e-4
CLIP, VALUE_WEIGHT, LARGEST_GRADIENT = 0.2, 0.5, 0.5
LARGEST_INPUT = 10.0
"""Bound of normalised observations and rewards."""

Policy = Callable[[np.ndarray], np.ndarray]


class Agent(nn.Module):
    """Two hidden layers of 64 for the actor's mean, two for the critic; one standard deviation for all states."""

    def __init__(self, observed: int, actions: int) -> None:
        super().__init__()
        self.actor, self.critic = _network(observed, actions, 0.01), _network(observed, 1, 1.0)
        self.log_std = nn.Parameter(torch.zeros(1, actions))

    def distribution(self, observations: torch.Tensor) -> Normal:
        """Of the actions (n, k) at observations (n, o)."""
        mean = self.actor(observations)
        return Normal(mean, self.log_std.expand_as(mean).exp())


def _network(inputs: int, outputs: int, last_gain: float) -> nn.Sequential:
    return nn.Sequential(
        _layer(inputs, 64, math.sqrt(2.0)), nn.Tanh(), _layer(64, 64, math.sqrt(2.0)), nn.Tanh(),
        _layer(64, outputs, last_gain),
    )  # fmt: skip


def _layer(inputs: int, outputs: int, gain: float) -> nn.Linear:
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


def wrapped(name: str) -> gymnasium.Env:
    """The environment under the default wrappers."""
    env = gymnasium.wrappers.FlattenObservation(gymnasium.make(name))
    env = gymnasium.wrappers.ClipAction(gymnasium.wrappers.RecordEpisodeStatistics(env))
    env = gymnasium.wrappers.NormalizeObservation(env)
    env = gymnasium.wrappers.TransformObservation(env, _clipped, env.observation_space)
    env = gymnasium.wrappers.NormalizeReward(env, gamma=GAMMA)
    return gymnasium.wrappers.TransformReward(env, _clipped)


def _clipped(value: np.ndarray) -> np.ndarray:
    return np.clip(value, -LARGEST_INPUT, LARGEST_INPUT)


def train(name: str, steps: int, seed: int, watch: Callable[[int, Policy], None]) -> None:
    """Train for so many steps, rounded down to whole rollouts; `watch` is called after each with the steps so far and
    the actor's mean as a function of raw observations."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    env = wrapped(name)
    agent = Agent(*(math.prod(space.shape or ()) for space in (env.observation_space, env.action_space)))
    optimiser = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)
    rollouts = steps // STEPS_A_ROLLOUT
    observation, ended = env.reset(seed=seed)[0], False
    for rollout in range(rollouts):
        optimiser.param_groups[0]["lr"] = LEARNING_RATE * (1.0 - rollout / rollouts)
        batch, observation, ended = _rollout(env, agent, observation, ended)
        _update(agent, optimiser, batch, rng)
        watch((rollout + 1) * STEPS_A_ROLLOUT, _policy(agent, env))


def _rollout(
    env: gymnasium.Env, agent: Agent, observation: np.ndarray, ended: bool
) -> tuple[tuple[torch.Tensor, ...], np.ndarray, bool]:
    """Observations, actions, log probabilities, advantages, returns and values of a rollout, and where it stopped."""
    rows: list[tuple] = []
    for _ in range(STEPS_A_ROLLOUT):
        seen = torch.as_tensor(observation, dtype=torch.float32)
        with torch.no_grad():
            chosen = agent.distribution(seen[None])
            action = chosen.sample()
            kept = (seen, action[0], chosen.log_prob(action).sum(), agent.critic(seen)[0])
        observation, reward, terminated, truncated, _ = env.step(action[0].numpy())
        rows.append((*kept, float(reward), ended))
        ended = terminated or truncated
        if ended:
            observation = env.reset()[0]
    observations, actions, log_probabilities, values = (torch.stack(each) for each in list(zip(*rows, strict=True))[:4])
    with torch.no_grad():
        last = agent.critic(torch.as_tensor(observation, dtype=torch.float32))[0]
    advantages = _advantages([row[4] for row in rows], [*(row[5] for row in rows), ended], [*values, last])
    batch = (observations, actions, log_probabilities, advantages, advantages + values, values)
    return batch, observation, ended


def _advantages(rewards: list[float], ended: list[bool], values: list[torch.Tensor]) -> torch.Tensor:
    """Generalised advantage estimates (n,); `ended` (n + 1,) says whether a step is the first of an episode."""
    advantages, carried = torch.zeros(len(rewards)), torch.zeros(())
    for step in reversed(range(len(rewards))):
        going = 0.0 if ended[step + 1] else 1.0
        surprise = rewards[step] + GAMMA * going * values[step + 1] - values[step]
        carried = surprise + GAMMA * GAE_LAMBDA * going * carried
        advantages[step] = carried
    return advantages


def _update(
    agent: Agent, optimiser: torch.optim.Optimizer, batch: tuple[torch.Tensor, ...], rng: np.random.Generator
) -> None:
    """The epochs over minibatches that follow a rollout."""
    for _ in range(EPOCHS):
        for rows in np.array_split(rng.permutation(STEPS_A_ROLLOUT), MINIBATCHES):
            optimiser.zero_grad()
            _loss(agent, *(each[rows] for each in batch)).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), LARGEST_GRADIENT)
            optimiser.step()


def _loss(
    agent: Agent,
    observations: torch.Tensor,
    actions: torch.Tensor,
    log_probabilities: torch.Tensor,
    advantages: torch.Tensor,
    returns: torch.Tensor,
    values: torch.Tensor,
) -> torch.Tensor:
    """Clipped surrogate of the policy and clipped squared error of the values; no bonus for entropy."""
    ratio = (agent.distribution(observations).log_prob(actions).sum(1) - log_probabilities).exp()
    normalised = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    policy = -torch.min(normalised * ratio, normalised * ratio.clamp(1.0 - CLIP, 1.0 + CLIP)).mean()
    now = agent.critic(observations)[:, 0]
    near = values + (now - values).clamp(-CLIP, CLIP)
    value = 0.5 * torch.max((now - returns) ** 2, (near - returns) ** 2).mean()
    return policy + VALUE_WEIGHT * value


def _policy(agent: Agent, env: gymnasium.Env) -> Policy:
    """The mean action in the environment's box at observations (n, o), normalised as at the training's end."""
    statistics = env.get_wrapper_attr("obs_rms")
    low, high = env.unwrapped.action_space.low, env.unwrapped.action_space.high  # type: ignore[attr-defined]

    def act(observations: np.ndarray) -> np.ndarray:
        normalised = _clipped((observations - statistics.mean) / np.sqrt(statistics.var + 1e-8))
        with torch.no_grad():
            mean = agent.actor(torch.as_tensor(normalised, dtype=torch.float32))
        return np.clip(mean.numpy(), low, high)

    return act
