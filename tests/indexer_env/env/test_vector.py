"""The native batch is SyncVectorEnv without the loop: the same seeds, autoresets and infos, bit for bit."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from indexer_env import OperatingPoint, start
from indexer_env.env import IndexerEnv
from indexer_env.modes import largest_steps
from indexer_env.vector_env import IndexerVectorEnv
from indexer_env.wrappers import DomainRandomisation

ID = "indexer_env/Indexer-v1"
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
        actions = rng.uniform(-1.0, native.action_space.high).astype(np.float32)
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


def test_an_item_with_its_own_operating_point_is_scaled_as_the_first():
    slow, nominal = OperatingPoint(motor_speed=80.0), OperatingPoint()
    fleet, single = IndexerVectorEnv(2, operating_point=[slow, nominal]), IndexerEnv(operating_point=slow)
    fleet.reset(seed=5)
    single.reset(seed=6, options={"operating_point": nominal})
    for _ in range(20):
        observations, rewards, *_ = fleet.step(np.ones((2, 1)))
        observation, reward, *_ = single.step(np.ones(1))
        np.testing.assert_array_equal(observations[1], observation)
        assert rewards[1] == reward


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
@pytest.mark.parametrize("half_width", [0.0, 0.1])
def test_machines_drawn_for_each_episode_are_those_of_the_wrapper(mode, half_width):
    """Seeded at first, then three episodes on without a seed, then with new seeds for some and for a given machine."""
    arguments = {"faults": {"backlash_deg": {"uniform": [0, 20]}}, "max_episode_steps": 12}

    def single() -> gymnasium.Env:
        return DomainRandomisation(gymnasium.make(ID, **arguments), half_width)

    sync = SyncVectorEnv([single] * 3, autoreset_mode=mode)
    native = IndexerVectorEnv(3, half_width=half_width, autoreset_mode=mode, **arguments)
    assert data_equivalence(sync.reset(seed=5), native.reset(seed=5), exact=True)
    rng = np.random.default_rng(0)
    for _ in range(40):
        actions = rng.uniform(-1.0, native.action_space.high).astype(np.float32)
        expected, got = sync.step(actions), native.step(actions)
        assert data_equivalence(expected, got, exact=True)
        if mode is AutoresetMode.DISABLED and (got[2] | got[3]).any():
            options = {"reset_mask": got[2] | got[3]}
            assert data_equivalence(sync.reset(options=options), native.reset(options=options), exact=True)
    given = {"seed": [7, None, 9], "options": {"machine": "smooth"}}
    assert data_equivalence(sync.reset(**given), native.reset(**given), exact=True)


def test_every_episode_draws_a_machine():
    """At the same start angle two machines accelerate apart from the first motion on, and with them two episodes."""
    env = IndexerVectorEnv(2, half_width=0.1, start_angle=0.0, max_episode_steps=30)
    env.reset(seed=0)
    records = [np.stack([env.step(np.ones((2, 1)))[4]["acceleration"] for _ in range(31)][:30]) for _ in range(2)]
    assert not np.array_equal(records[0][:, 0], records[0][:, 1])
    assert not np.array_equal(records[0][:, 0], records[1][:, 0])


def test_a_reset_checks_the_steps_of_all_its_machines_together(monkeypatch):
    sizes = []

    def counted(items):
        sizes.append(len(items))
        return largest_steps(items)

    monkeypatch.setattr(start, "largest_steps", counted)
    env = IndexerVectorEnv(1500, half_width=0.1)
    sizes.clear()
    env.reset(seed=1234)
    env.reset(options={"reset_mask": np.arange(1500) < 2})
    assert sizes == [1500, 2]
