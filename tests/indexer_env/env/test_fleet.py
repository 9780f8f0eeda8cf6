"""Machines that share a kernel call share nothing else: each gives the bits of a machine on its own."""

import dataclasses
import math

import gymnasium
import numpy as np
import pytest

from indexer_env import EFFECTS, Faults, Machine, MachineEffect, make_effect
from indexer_env.env import IndexerEnv
from indexer_env.vector_env import IndexerVectorEnv

STEPS = 130


@pytest.fixture(scope="module")
def machines(smooth, reference, visible) -> list[Machine]:
    """One machine per effect, with and without edges, of all three models."""
    names = [name for name, cls in EFFECTS.items() if issubclass(cls, MachineEffect)]
    extended = [smooth.with_effects(visible(name)) for name in sorted(names)]
    plain = [
        smooth, reference,
        dataclasses.replace(smooth, model="A"),
        dataclasses.replace(reference, motion_share=0.35),
        smooth.with_effects(make_effect("output.cubic_stiffness", stiffness=1e9)),
        Faults(backlash=math.radians(15), roller_crack=0.3).applied_to(reference),
    ]  # fmt: skip
    return plain + extended


def actions(count: int, steps: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(0.4, 1.0, (steps, count, 1)).astype(np.float32)


def rollout(env: gymnasium.vector.VectorEnv, plan: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    observations, rewards, readings = [env.reset(seed=4)[0]], [], []
    for action in plan:
        observation, reward, _, _, info = env.step(action)
        observations.append(observation)
        rewards.append(reward)
        readings.append(info["acceleration"])
    return np.array(observations), np.array(rewards), np.array(readings)


def test_a_mixed_fleet_is_its_machines_alone(machines):
    """All effects and all models in one fleet: what another machine has acts in none at its null value."""
    plan = actions(len(machines), STEPS)
    together = rollout(IndexerVectorEnv(len(machines), machine=machines), plan)
    # a fleet's limits are those of its first machine
    env = IndexerEnv(machine=machines[0])
    for i, machine in enumerate(machines):
        observation, _ = env.reset(seed=4 + i, options={"machine": machine})
        np.testing.assert_array_equal(observation, together[0][0, i])
        for k in range(STEPS):
            observation, reward, terminated, _, info = env.step(plan[k, i])
            assert not terminated
            np.testing.assert_array_equal(info["acceleration"], together[2][k, i], err_msg=f"{machine.effects}")
            np.testing.assert_array_equal(observation, together[0][k + 1, i])
            assert reward == together[1][k, i]


@pytest.mark.parametrize("count", [1, 5, 33, 100])
def test_items_do_not_depend_on_the_size_of_the_fleet(reference, count):
    """Fewer than a block, one more than a block, several: the first items are the same."""
    plan = actions(100, 60)
    whole = rollout(IndexerVectorEnv(100, machine=reference, faults="table2"), plan)
    part = rollout(IndexerVectorEnv(count, machine=reference, faults="table2"), plan[:, :count])
    for a, b in zip(whole, part, strict=True):
        np.testing.assert_array_equal(a[:, :count], b)
