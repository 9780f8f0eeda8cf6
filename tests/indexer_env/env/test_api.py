"""The environments keep Gymnasium's rules: checker, seeds, copies, fresh arrays, wrappers."""

import copy
import dataclasses
import os
import pickle
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from hypothesis import given, settings
from hypothesis import strategies as st

import indexer_env  # registers the environments
from indexer_env.env import IndexerEnv
from indexer_env.vector_env import IndexerVectorEnv

ID = "indexer_env/Indexer-v1"
ROOT = Path(indexer_env.__file__).parent.parent
ARGUMENTS = (
    {},
    {"brake_torque": 50.0, "reveal": True},
    {"faults": "growing", "sensor": "bench", "reveal": True},
    {"machine": "smooth", "faults": "table2", "period": 0.001},
)


def action(env: gymnasium.Env, rng: np.random.Generator) -> np.ndarray:
    space = env.action_space
    assert isinstance(space, gymnasium.spaces.Box)
    return rng.uniform(space.low, space.high).astype(np.float32)


def rollout(env: gymnasium.Env, seed: int | None, steps: int = 40) -> list:
    rng = np.random.default_rng(11)
    return [env.reset(seed=seed), *(env.step(action(env, rng)) for _ in range(steps))]


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=str)
def test_gymnasium_s_checker_has_nothing_to_say(arguments):
    """pytest turns each warning of the checker into an error."""
    env = gymnasium.make(ID, **arguments)
    check_env(env.unwrapped)
    env.close()


def test_registration_needs_no_more_than_the_module_s_name():
    program = (
        f"import gymnasium; env = gymnasium.make('indexer_env:{ID}'); env.reset(seed=0); "
        "print(env.step(env.action_space.sample())[2])"
    )
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == "False"


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=str)
def test_a_seed_decides_everything(arguments):
    one, other = IndexerEnv(**arguments), IndexerEnv(**arguments)
    assert data_equivalence(rollout(one, 5), rollout(other, 5), exact=True)
    assert data_equivalence(rollout(one, None), rollout(other, None), exact=True)
    assert not data_equivalence(rollout(one, 5)[:2], rollout(other, 6)[:2], exact=True)


def test_an_unseeded_environment_is_not_seeded_by_itself():
    assert not np.array_equal(IndexerEnv().reset()[0], IndexerEnv().reset()[0])


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=str)
@pytest.mark.parametrize("again", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"])
def test_a_copy_in_mid_episode_goes_on_with_the_same_bits(arguments, again):
    env = IndexerEnv(**arguments)
    rollout(env, 2, 35)
    twin, rng, rng_twin = again(env), np.random.default_rng(1), np.random.default_rng(1)
    for _ in range(30):
        assert data_equivalence(env.step(action(env, rng)), twin.step(action(twin, rng_twin)), exact=True)
    assert data_equivalence(env.reset(), twin.reset(), exact=True)


def test_a_copy_of_a_vector_environment_too():
    env = IndexerVectorEnv(5, faults="growing", sensor="bench", max_episode_steps=25)
    env.reset(seed=3)
    actions = np.random.default_rng(1).random((60, 5, 1)).astype(np.float32)
    for k in range(20):
        env.step(actions[k])
    twin = pickle.loads(pickle.dumps(env))
    for k in range(20, 60):
        assert data_equivalence(env.step(actions[k]), twin.step(actions[k]), exact=True)


@pytest.mark.parametrize("arguments", ARGUMENTS[:3], ids=str)
def test_what_is_returned_is_the_caller_s(arguments):
    """Neither does a later step write into it, nor does writing into it change a later step."""
    env, untouched = IndexerEnv(**arguments), IndexerEnv(**arguments)
    kept = rollout(env, 8, 12)
    seen = copy.deepcopy(kept)
    rollout(env, 9, 12)
    assert data_equivalence(kept, seen, exact=True)

    def spoil(value):
        if isinstance(value, np.ndarray):
            value[...] = 99.0
        elif isinstance(value, dict | tuple | list):
            for inner in value.values() if isinstance(value, dict) else value:
                spoil(inner)

    rng, rng_other = np.random.default_rng(1), np.random.default_rng(1)
    spoil(env.reset(seed=4))
    untouched.reset(seed=4)
    for _ in range(12):
        step = env.step(action(env, rng))
        assert data_equivalence(step, untouched.step(action(untouched, rng_other)), exact=True)
        spoil(step)


def test_two_environments_share_nothing():
    alone = rollout(IndexerEnv(faults="table2"), 5)
    env, other = IndexerEnv(faults="table2"), IndexerEnv(machine="smooth", faults="growing")
    rng = np.random.default_rng(11)
    beside = [env.reset(seed=5)]
    other.reset(seed=1)
    for _ in range(40):
        other.step(np.full(1, -0.2))
        beside.append(env.step(action(env, rng)))
    assert data_equivalence(alone, beside, exact=True)


def test_types_are_gymnasium_s():
    env = IndexerEnv(reveal=True)
    observation, info = env.reset(seed=0)
    assert observation.dtype == np.float32 and observation in env.observation_space
    assert info["acceleration"].shape == (50,) and info["truth"]["torques"].shape == (3, 50)
    observation, reward, terminated, truncated, info = env.step(np.ones(1))
    assert type(reward) is float and type(terminated) is bool and type(truncated) is bool
    assert set(IndexerEnv().reset()[1]) == {"acceleration"}


@settings(max_examples=40)
@given(
    commands=st.lists(st.sampled_from([-1.0, -0.8, 0.0, 0.8, 1.0]), min_size=1, max_size=60),
    brake=st.sampled_from([-1.0, 1.0]),
    play=st.sampled_from([0.0, 20.0, 90.0]),
    crack=st.sampled_from([0.0, 0.9]),
    loose=st.sampled_from([0.0, 1.0]),
    seed=st.integers(0, 10),
)
def test_whatever_is_commanded_stays_in_space_and_bounds(commands, brake, play, crack, loose, seed):
    env = IndexerEnv(
        faults={"backlash_deg": play, "roller_crack": crack, "screw_looseness": loose},
        brake_torque=500.0, ramp=100.0, vibration_weight=10.0,
    )  # fmt: skip
    low, high = env.reward_range
    observation, _ = env.reset(seed=seed)
    for command in commands:
        assert env.observation_space.contains(observation)
        observation, reward, terminated, _, info = env.step(np.array([command, brake], dtype=np.float32))
        assert low <= reward <= high and np.isfinite(info["acceleration"]).all()
        if terminated:
            assert reward == -100.0
            break
    assert env.observation_space.contains(observation)


def test_leaving_the_model_s_range_ends_the_episode(smooth):
    """A table on a joint as soft as rubber: 0.5 rad are soon reached; the last sound observation stays."""
    soft = dataclasses.replace(
        smooth, output_joint=dataclasses.replace(smooth.output_joint, stiffness=30.0, damping=0.1)
    )
    env = gymnasium.make(ID, machine=soft)
    observation, _ = env.reset(seed=0, options={"start_angle": 0.0})
    for _ in range(200):
        before = observation
        observation, reward, terminated, truncated, _ = env.step(np.ones(1, dtype=np.float32))
        assert env.observation_space.contains(observation)
        if terminated:
            break
    assert terminated and not truncated and reward == -100.0
    np.testing.assert_array_equal(observation, before)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.ones(1, dtype=np.float32))
    assert env.reset(seed=0)[0] in env.observation_space


def test_two_turns_are_the_limit_of_time():
    env = gymnasium.make(ID)
    env.reset(seed=0)
    ends = [env.step(np.ones(1, dtype=np.float32))[3] for _ in range(328)]
    assert ends == [False] * 327 + [True]


def test_gymnasium_s_wrappers_work():
    env = gymnasium.wrappers.RecordEpisodeStatistics(gymnasium.make(ID, max_episode_steps=20))
    env = gymnasium.wrappers.FrameStackObservation(env, 4)
    observation, _ = env.reset(seed=0)
    assert observation.shape == (4, 7)
    for _ in range(20):
        *_, truncated, info = env.step(np.ones(1, dtype=np.float32))
    assert truncated and info["episode"]["l"] == 20
    vector = gymnasium.make_vec(ID, num_envs=3, vectorization_mode="vector_entry_point", max_episode_steps=20)
    vector = gymnasium.wrappers.vector.RecordEpisodeStatistics(vector)
    vector.reset(seed=0)
    for _ in range(20):
        *_, info = vector.step(np.ones((3, 1), dtype=np.float32))
    assert info["episode"]["l"].tolist() == [20, 20, 20]


@pytest.mark.parametrize("name", ["Indexer", "IndexerDiagnosis"])
@pytest.mark.filterwarnings("ignore:.*is out of date")
def test_the_version_that_went_names_the_one_that_came(name):
    with pytest.raises(gymnasium.error.DeprecatedEnv, match=f"use `indexer_env/{name}-v1` instead"):
        gymnasium.make(f"indexer_env/{name}-v0")
