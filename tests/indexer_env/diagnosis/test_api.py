"""The diagnosis environment keeps Gymnasium's rules: checker, seeds, copies, fresh arrays, wrappers, vectors."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

import indexer_env  # noqa: F401 (registers the environments)
from indexer_env.diagnosis import BANDS
from indexer_env.diagnosis_env import IndexerDiagnosisEnv

ID = "indexer_env/IndexerDiagnosis-v1"
SMALL = {"speeds": [1.0, 1.3], "brakes": [0.0, 200.0]}
"""A grid of fast turns, which take little time to simulate."""

ARGUMENTS = ({}, {"reveal": True, **SMALL}, {"sensor": "ideal", "machine": "smooth", **SMALL, "budget": 0.2})
FAST = 6
"""Place of a turn at the highest speed, without brake, on the default grid; settings end at 8."""


def rollout(env: gymnasium.Env, seed: int | None, steps: int = 7) -> list:
    """Actions from a generator of its own; an episode that ends is followed by the next."""
    rng = np.random.default_rng(3)
    seen: list = [env.reset(seed=seed)]
    for _ in range(steps):
        seen.append(env.step(np.int64(rng.integers(env.action_space.n))))  # type: ignore[attr-defined]
        if seen[-1][2]:
            seen.append(env.reset())
    return seen


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=str)
def test_gymnasium_s_checker_has_nothing_to_say(arguments):
    """pytest turns each warning of the checker into an error."""
    env = gymnasium.make(ID, **arguments)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("arguments", ARGUMENTS, ids=str)
def test_a_seed_decides_everything(arguments):
    one, other = IndexerDiagnosisEnv(**arguments), IndexerDiagnosisEnv(**arguments)
    first = rollout(one, 5)
    assert data_equivalence(first, rollout(other, 5), exact=True)
    assert data_equivalence(rollout(one, None, 3), rollout(other, None, 3), exact=True)
    for env in (one, other):
        env.reset(seed=5 if env is one else 6)
    assert not np.array_equal(one.step(0)[0], other.step(0)[0])


def test_an_unseeded_environment_is_not_seeded_by_itself():
    readings = []
    for _ in range(2):
        env = IndexerDiagnosisEnv()
        env.reset()
        readings.append(env.step(FAST)[0])
    assert not np.array_equal(*readings)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"])
def test_a_copy_in_mid_episode_goes_on_with_the_same_bits(again):
    env = IndexerDiagnosisEnv(reveal=True, **SMALL)
    env.reset(seed=2)
    env.step(1)
    twin = again(env)
    for action in (2, 3, 1, 4):
        assert data_equivalence(env.step(action), twin.step(action), exact=True)
    assert data_equivalence(rollout(env, None), rollout(twin, None), exact=True)


def test_what_is_returned_is_the_caller_s():
    env, untouched = IndexerDiagnosisEnv(**SMALL), IndexerDiagnosisEnv(**SMALL)
    for each in (env, untouched):
        each.reset(seed=4)
    for action in (0, 3, 1, 5):
        step, expected = env.step(action), untouched.step(action)
        assert data_equivalence(step, expected, exact=True)
        step[0][:] = 99.0
        step[4]["action_mask"][:] = 0


def test_two_environments_share_nothing():
    alone = rollout(IndexerDiagnosisEnv(**SMALL), 5, 5)
    env, other = IndexerDiagnosisEnv(**SMALL), IndexerDiagnosisEnv(sensor="ideal", speeds=[1.3], brakes=[0.0])
    rng = np.random.default_rng(3)
    beside = [env.reset(seed=5)]
    for _ in range(5):
        other.reset()
        other.step(0)
        beside.append(env.step(rng.integers(env.action_space.n)))
        if beside[-1][2]:
            beside.append(env.reset())
    assert data_equivalence(alone, beside, exact=True)


def test_types_are_gymnasium_s():
    env = IndexerDiagnosisEnv(reveal=True)
    observation, info = env.reset(seed=0)
    assert observation.dtype == np.float32 and observation in env.observation_space
    assert set(info) == {"action_mask", "truth"} and info["action_mask"].all()
    observation, reward, terminated, truncated, info = env.step(FAST)
    assert observation.dtype == np.float32 and observation in env.observation_space
    assert type(reward) is float and type(terminated) is bool and type(truncated) is bool
    assert info["record"].values.shape == (round(8200 / 1.3),) and info["record"].unit == "m/s^2"
    *_, last = env.step(8)
    assert "record" not in last
    assert "truth" not in IndexerDiagnosisEnv().reset()[1]


def test_wrappers_and_masked_samples_work():
    env = gymnasium.wrappers.RecordEpisodeStatistics(gymnasium.wrappers.TimeLimit(gymnasium.make(ID, **SMALL), 2))
    env = gymnasium.wrappers.FrameStackObservation(env, 3)
    observation, info = env.reset(seed=0)
    assert observation.shape == (3, BANDS + 4 + 1)
    assert env.action_space.sample(mask=info["action_mask"]) in env.action_space
    env.step(1)
    *_, terminated, truncated, info = env.step(0)
    assert truncated and not terminated and info["episode"]["l"] == 2


@pytest.mark.parametrize("mode", list(gymnasium.vector.AutoresetMode), ids=lambda mode: mode.value)
def test_a_vector_is_its_single_environments(mode):
    """Records of different lengths side by side in the infos; ends and resets in each autoreset mode."""
    vector = gymnasium.make_vec(
        ID, num_envs=3, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, reveal=True, **SMALL
    )
    singles = [IndexerDiagnosisEnv(reveal=True, **SMALL) for _ in range(3)]
    observations, _ = vector.reset(seed=7)
    np.testing.assert_array_equal(observations, [env.reset(seed=7 + i)[0] for i, env in enumerate(singles)])
    actions = np.array([0, 2, 5])
    observations, rewards, terminations, _, infos = vector.step(actions)
    for i, env in enumerate(singles):
        observation, reward, terminated, _, info = env.step(actions[i])
        assert (rewards[i], terminations[i]) == (reward, terminated)
        if not terminated:
            np.testing.assert_array_equal(observations[i], observation)
            assert infos["record"][i] == info["record"]
    assert terminations.tolist() == [False, False, True]
    if mode is gymnasium.vector.AutoresetMode.DISABLED:
        vector.reset(options={"reset_mask": terminations})
    fresh = singles[2].reset()[0]
    begun = vector.step(np.array([1, 1, 1]))[0][2] if mode is gymnasium.vector.AutoresetMode.NEXT_STEP else None
    if begun is None:
        np.testing.assert_array_equal(vector.step(np.array([1, 1, 1]))[0][2], singles[2].step(1)[0])
    else:
        np.testing.assert_array_equal(begun, fresh)


def test_a_picture_shows_every_turn_and_the_budget():
    env = gymnasium.make(ID, render_mode="rgb_array", **SMALL)
    env.reset(seed=0)
    pictures = [env.render()]
    for action in (1, 2):
        env.step(action)
        pictures.append(env.render())
    assert all(picture.shape == (480, 640, 3) and picture.dtype == np.uint8 for picture in pictures)
    assert not np.array_equal(pictures[0], pictures[1]) and not np.array_equal(pictures[1], pictures[2])
    env.step(4)
    np.testing.assert_array_equal(env.render(), pictures[2])
    env.reset(seed=1)
    np.testing.assert_array_equal(env.render(), pictures[0])


def test_a_picture_needs_its_mode_and_a_reset():
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"IndexerDiagnosisEnv\.render must follow a reset"):
        IndexerDiagnosisEnv(render_mode="rgb_array").render()
    env = IndexerDiagnosisEnv()
    env.reset()
    with pytest.warns(UserWarning, match="without a render mode"):
        assert env.render() is None
