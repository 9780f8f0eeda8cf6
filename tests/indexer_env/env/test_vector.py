"""The native batch is SyncVectorEnv without the loop: the same seeds, autoresets and infos, bit for bit."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, VectorEnv

from indexer_env import OperatingPoint
from indexer_env.vector_env import IndexerVectorEnv

ID = "indexer_env/Indexer-v0"
CASES = (
    {},
    {"faults": "growing", "sensor": "bench", "reveal": True},
    {"faults": "table2", "brake_torque": 30.0, "machine": "smooth"},
)


def pair(mode: AutoresetMode, count: int, **arguments: object) -> tuple[VectorEnv, VectorEnv]:
    sync = gymnasium.make_vec(
        ID, num_envs=count, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **arguments
    )
    native = gymnasium.make_vec(
        ID, num_envs=count, vectorization_mode="vector_entry_point", autoreset_mode=mode, **arguments
    )
    return sync, native


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
@pytest.mark.parametrize("arguments", CASES, ids=str)
def test_native_is_sync(mode, arguments):
    count = 5
    sync, native = pair(mode, count, max_episode_steps=23, **arguments)
    assert native.metadata["autoreset_mode"] is mode is sync.metadata["autoreset_mode"]
    assert native.action_space == sync.action_space and native.observation_space == sync.observation_space
    assert data_equivalence(sync.reset(seed=5), native.reset(seed=5), exact=True)
    rng, ends = np.random.default_rng(0), 0
    for _ in range(60):
        actions = rng.uniform(0.0, native.action_space.high).astype(np.float32)
        expected, got = sync.step(actions), native.step(actions)
        assert data_equivalence(expected, got, exact=True)
        ended = got[2] | got[3]
        ends += int(ended.sum())
        if mode is AutoresetMode.DISABLED and ended.any():
            expected, got = (env.reset(options={"reset_mask": ended}) for env in (sync, native))
            assert data_equivalence(expected, got, exact=True)
    assert ends == 2 * count


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
def test_machines_that_end_apart(mode, smooth):
    """Terminations come at different times, where truncations come together."""
    soft = dataclasses.replace(
        smooth, output_joint=dataclasses.replace(smooth.output_joint, stiffness=30.0, damping=0.1)
    )
    sync, native = pair(mode, 6, machine=soft)
    assert data_equivalence(sync.reset(seed=1), native.reset(seed=1), exact=True)
    together = apart = 0
    for _ in range(150):
        actions = np.ones((6, 1), dtype=np.float32)
        expected, got = sync.step(actions), native.step(actions)
        assert data_equivalence(expected, got, exact=True)
        ended = got[2] | got[3]
        together, apart = together + int(ended.all()), apart + int(ended.any() and not ended.all())
        if mode is AutoresetMode.DISABLED and ended.any():
            expected, got = (env.reset(options={"reset_mask": ended}) for env in (sync, native))
            assert data_equivalence(expected, got, exact=True)
    assert apart > 3


def test_seeds_of_items():
    env = IndexerVectorEnv(3)
    one, _ = env.reset(seed=7)
    np.testing.assert_array_equal(one, env.reset(seed=[7, 8, 9])[0])
    assert env.np_random_seed == (7, 8, 9)
    other = env.reset(seed=8)[0]
    np.testing.assert_array_equal(other[:2], one[1:])
    assert not np.array_equal(env.reset()[0], other)
    kept = env.reset(seed=[1, None, 2])[0]
    assert not np.array_equal(kept[1], other[1])


def test_returned_arrays_are_fresh():
    env = IndexerVectorEnv(3, max_episode_steps=4, autoreset_mode="SameStep")
    kept = [env.reset(seed=0), *(env.step(np.full((3, 1), 0.5)) for _ in range(6))]
    for first in range(len(kept)):
        for second in range(first):
            assert not np.shares_memory(kept[first][0], kept[second][0])
            assert not np.shares_memory(kept[first][-1]["acceleration"], kept[second][-1]["acceleration"])


def test_each_its_own_machine_and_operating_point(smooth, reference):
    slow = OperatingPoint(motor_speed=100.0)
    env = IndexerVectorEnv(2, machine=[smooth, "reference"], operating_point=[OperatingPoint(), slow])
    env.reset(seed=0, options={"start_angle": 1.5})
    observation = env.step(np.ones((2, 1)))[0]
    np.testing.assert_allclose(observation[:, 6], 1.0 / 1.5, rtol=1e-6)  # each as a share of its own nominal speed
    assert observation[0, 3] > 1.4 * observation[1, 3] > 0.1
