"""The example that trains on a device runs on the CPU, learns what can be learned at once, and reproduces."""

import sys

import pytest
import torch

from examples import train_ppo_device
from examples.train_ppo_device import DISCOUNT, TRACE, Fleet, Policy, roll_out, train


def test_the_same_seed_gives_the_same_policy_and_another_another():
    (first, rewards), (again, _), (other, _) = (train("cpu", 4, 8, 2, seed) for seed in (3, 3, 4))
    same = [torch.equal(*pair) for pair in zip(first.parameters(), again.parameters(), strict=True)]
    assert all(same) and len(rewards) == 2
    assert not all(torch.equal(*pair) for pair in zip(first.parameters(), other.parameters(), strict=True))


class Sliding:
    """Stands in for a fleet: the reward is 1 less the action's distance from 0.7; episodes end after three periods."""

    def __init__(self, truncated: bool = True) -> None:
        self.observations, self.actions, self.period, self.truncated = torch.zeros(64, 7), 1, 0, truncated

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, ...]:
        self.period += 1
        ended = torch.full((64,), self.period % 3 == 0)
        none = torch.zeros(64, dtype=torch.bool)
        rewards = 1.0 - (actions[:, 0] - 0.7).abs()
        return rewards, *((none, ended) if self.truncated else (ended, none)), self.observations + 1.0


def test_an_episode_that_was_cut_short_counts_what_was_to_come_and_one_that_ended_does_not():
    torch.manual_seed(0)
    policy = Policy(7, 1)
    with torch.no_grad():
        now, then = policy.worth(torch.zeros(7)), policy.worth(torch.ones(7))
    for truncated in (True, False):
        rollout, _ = roll_out(Sliding(truncated), policy, 3)  # type: ignore[arg-type]
        rewards = 1.0 - (rollout.actions[:, :, 0] - 0.7).abs()
        last = rewards[2] + (DISCOUNT * then if truncated else 0.0) - now
        before = rewards[1] + DISCOUNT * then - now + DISCOUNT * TRACE * last
        torch.testing.assert_close(rollout.advantages[2], last)
        torch.testing.assert_close(rollout.advantages[1], before)
        torch.testing.assert_close(rollout.returns, rollout.advantages + now)


def test_it_learns(monkeypatch):
    monkeypatch.setattr(train_ppo_device, "Fleet", lambda device, fleet, seed: Sliding())
    _, rewards = train("cpu", 64, 24, 25)
    assert rewards[0] < 0.5 and rewards[-1] > 0.75


def test_the_last_observation_is_that_of_the_episode_that_ended():
    fleet = Fleet("cpu", 2, seed=1)
    fleet._env._most_steps = 2
    fleet.step(torch.zeros(2, 1))
    _, _, truncated, last = fleet.step(torch.zeros(2, 1))
    assert truncated.all() and not torch.equal(last, fleet.observations)


def test_a_device_that_is_not_here_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["train", "--device", "gpu"])
    with pytest.raises(SystemExit) as ended:
        train_ppo_device.main()
    assert ended.value.code == 2 and "IndexerVectorEnv.device must be cpu, cuda or cuda:N" in capsys.readouterr().err
