"""PPO with unchanged settings: its arithmetic, how policies are measured, and what the page holds."""

import json

import gymnasium
import numpy as np
import pytest
import torch

from benchmarks.control import baselines, page, scripts, single_file_ppo
from benchmarks.report import with_table


def test_advantages_are_their_sum():
    """Σ (γλ)^k δ, cut where an episode ends; against the sum written out."""
    rng = np.random.default_rng(0)
    rewards, values = rng.standard_normal(6).tolist(), [torch.tensor(v) for v in rng.standard_normal(7)]
    ended = [False, False, False, True, False, False, False]  # step 3 is the first of an episode
    found = single_file_ppo._advantages(rewards, ended, values)
    gamma, decay = single_file_ppo.GAMMA, single_file_ppo.GAMMA * single_file_ppo.GAE_LAMBDA
    surprise = [
        rewards[t] + gamma * (0.0 if ended[t + 1] else float(values[t + 1])) - float(values[t]) for t in range(6)
    ]
    expected = [sum(decay ** (k - t) * surprise[k] for k in range(t, 3 if t < 3 else 6)) for t in range(6)]
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_the_single_file_learns(monkeypatch):
    """The best action is 0.7 everywhere: a short training, seed 0, goes most of the way there."""

    class Line(gymnasium.Env):
        observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))
        action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            self.steps = 0
            return self.np_random.uniform(-1.0, 1.0, 2).astype(np.float32), {}

        def step(self, action):
            self.steps += 1
            seen = self.np_random.uniform(-1.0, 1.0, 2).astype(np.float32)
            return seen, -float(abs(action[0] - 0.7)), False, self.steps == 20, {}

    gymnasium.register("Line-v0", Line)
    monkeypatch.setattr(single_file_ppo, "STEPS_A_ROLLOUT", 256)
    monkeypatch.setattr(single_file_ppo, "MINIBATCHES", 4)
    seen, points = [], np.random.default_rng(1).uniform(-1.0, 1.0, (50, 2))

    def watch(steps, policy):
        seen.append((steps, np.abs(policy(points) - 0.7).mean()))  # now, as the policy goes on learning

    single_file_ppo.train("Line-v0", 12 * 256 + 5, 0, watch)
    assert [steps for steps, _ in seen] == [256 * k for k in range(1, 13)]
    assert seen[-1][1] < 0.6 * seen[0][1]


def test_a_return_is_the_sum_of_an_episode_s_rewards():
    env = gymnasium.make(baselines.ID)
    env.reset(seed=baselines.SEED)
    total, over = 0.0, False
    while not over:
        _, reward, terminated, truncated, _ = env.step(np.array([0.5], dtype=np.float32))
        total, over = total + reward, terminated or truncated
    found = baselines.returns(baselines.constant(0.75), episodes=2)
    assert found[0] == pytest.approx(total, rel=1e-12) and found[0] != found[1]


def test_every_constant_speed_drives_the_same_episodes(monkeypatch):
    monkeypatch.setattr(baselines, "SHARES", np.array([0.5, 0.88]))
    monkeypatch.setattr(baselines, "EPISODES", 2)
    share, found = baselines.best_constant()
    assert share == 0.88
    np.testing.assert_allclose(found, baselines.returns(baselines.constant(0.88), 2), rtol=1e-9)


def test_a_training_is_measured_as_it_goes(monkeypatch):
    """Both scripts hand the watcher their policy after each rollout; what is kept is every EVERY steps and the end."""
    monkeypatch.setattr(scripts.os, "nice", lambda _: None)
    monkeypatch.setattr(scripts, "returns", lambda policy: np.array([policy(np.zeros((3, 7))).shape[0], 5.0]))

    def fake(steps, seed, watch):
        for done in range(2048, steps + 1, 2048):
            watch(done, lambda observations: observations)

    monkeypatch.setitem(scripts.SCRIPTS, "fake", fake)
    monkeypatch.setattr(scripts, "MEASURED", 2)
    found = scripts.trained("fake", 5 * 2048, 3)
    assert [row[0] for row in found["curve"]] == [4096, 8192, 10240]
    assert found["seed"] == 3 and found["curve"][0][1:3] == [4.0, 1.0]


@pytest.mark.slow
def test_the_readme_s_script_is_watched_after_each_update():
    seen = []
    scripts.stable_baselines3(4096, 0, lambda done, policy: seen.append((done, policy(np.zeros((2, 7))).shape)))
    assert seen == [(2048, (2, 1)), (4096, (2, 1))]


def test_the_spread_of_a_few_seeds_is_that_of_a_sample():
    """Over n it would be 8."""
    assert page._said([10.0, 20.0, 30.0]) == "20 ± 10 (10 … 30)"


def test_the_page_holds_the_table_of_the_results_and_what_is_said_of_it():
    results = json.loads(page.RESULTS.read_text(encoding="utf-8"))
    text = page.PAGE.read_text(encoding="utf-8")
    assert with_table(text, page.table(results)) == text
    best = np.mean(results["constant"]["returns"])
    assert best > np.mean(results["random"]["returns"])
    for script in scripts.SCRIPTS:
        means = [run["curve"][-1][1] for run in results["trainings"] if run["script"] == script]
        assert len(means) >= 3 and min(means) > best
