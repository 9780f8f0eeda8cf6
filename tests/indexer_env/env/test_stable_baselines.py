"""stable-baselines3 is given the native batch as it is."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env

from indexer_env import ParameterError
from indexer_env.stable_baselines import StableBaselinesVecEnv
from indexer_env.vector_env import IndexerVectorEnv

ID = "indexer_env/Indexer-v1"
COUNT, STEPS = 3, 8


def native(**arguments: object) -> IndexerVectorEnv:
    return IndexerVectorEnv(COUNT, autoreset_mode="SameStep", max_episode_steps=STEPS, half_width=0.1, **arguments)


def test_it_gives_what_the_native_batch_gives():
    """Observations, rewards, ends and the last observation of each episode, under seeds of its own."""
    adapted, plain = StableBaselinesVecEnv(native(brake_torque=20.0)), native(brake_torque=20.0)
    assert adapted.seed(11) == [11, 12, 13]
    np.testing.assert_array_equal(adapted.reset(), plain.reset(seed=11)[0])
    rng, ended = np.random.default_rng(0), 0
    for step in range(1, 2 * STEPS + 1):
        actions = rng.uniform(-1.0, 1.0, (COUNT, 2)).astype(np.float32)
        observations, rewards, ends, infos = adapted.step(actions)
        expected = plain.step(actions)
        np.testing.assert_array_equal(observations, expected[0])
        np.testing.assert_array_equal(rewards, expected[1])
        assert ends.tolist() == [step % STEPS == 0] * COUNT
        for i in np.flatnonzero(ends):
            ended += 1
            np.testing.assert_array_equal(infos[i]["terminal_observation"], expected[4]["final_obs"][i])
            assert infos[i]["TimeLimit.truncated"] is True
        assert ends.any() or infos == [{}] * COUNT
    assert ended == 2 * COUNT
    adapted.reset()
    np.testing.assert_array_equal(adapted.reset(), _third_start(plain))


def _third_start(plain: IndexerVectorEnv) -> np.ndarray:
    """Without a new seed the generators go on."""
    plain.reset()
    return plain.reset()[0]


def test_an_end_out_of_range_is_no_time_limit(smooth):
    soft = dataclasses.replace(
        smooth, output_joint=dataclasses.replace(smooth.output_joint, stiffness=30.0, damping=0.1)
    )
    env = StableBaselinesVecEnv(IndexerVectorEnv(2, machine=soft, autoreset_mode="SameStep"))
    env.seed(0)
    env.reset()
    seen = []
    for _ in range(200):
        _, rewards, ends, infos = env.step(np.ones((2, 1)))
        seen += [(rewards[i], infos[i]["TimeLimit.truncated"]) for i in np.flatnonzero(ends)]
    assert seen and set(seen) == {(-100.0, False)}


def test_stable_baselines_checks_and_asks():
    env = StableBaselinesVecEnv(native())
    assert (env.num_envs, env.action_space.low, env.action_space.high) == (COUNT, -1.0, 1.0)
    assert env.render_mode is None and env.env_is_wrapped(gymnasium.Wrapper) == [False] * COUNT
    assert env.get_attr("limits", [0, 2]) == [native().limits] * 2
    with pytest.raises(ParameterError, match=r"StableBaselinesVecEnv\.render_mode must be left as it is"):
        env.set_attr("render_mode", "human")
    with pytest.raises(ParameterError, match=r"StableBaselinesVecEnv\.env_method must be called on the vector env"):
        env.env_method("render")
    env.close()


@pytest.mark.parametrize(
    ("env", "said"),
    [
        (lambda: IndexerVectorEnv(2), "in autoreset mode \"SameStep\", got 'NextStep'; give it to make_vec."),
        (lambda: gymnasium.make_vec(ID, num_envs=2, vectorization_mode="sync"), "an IndexerVectorEnv without wrappers"),
    ],
)
def test_what_it_does_not_take(env, said):
    with pytest.raises(ParameterError) as caught:
        StableBaselinesVecEnv(env())
    assert str(caught.value).startswith(f"StableBaselinesVecEnv.env must be {said}")


@pytest.mark.parametrize(
    "actions", [np.zeros((COUNT, 1)), np.zeros(2 * COUNT), np.full((COUNT, 2), np.nan), [["a", "b"]] * COUNT]
)
def test_actions_of_another_shape_or_kind_are_refused(actions):
    adapted = StableBaselinesVecEnv(native(brake_torque=20.0))
    adapted.reset()
    with pytest.raises(ParameterError, match=r"IndexerVectorEnv.*\.action must be "):
        adapted.step(actions)


@pytest.mark.parametrize("name", ["Indexer-v1", "IndexerDiagnosis-v1"])
def test_stable_baselines_first_line_and_its_checker(name):
    """Its helper asks for pictures and expects a TypeError where there are none; warnings are errors here."""
    env = make_vec_env(f"indexer_env/{name}", n_envs=2, seed=0)
    assert env.reset().shape[0] == 2 and env.envs[0].render_mode == "rgb_array"
    env.step([env.action_space.sample()] * 2)
    assert env.envs[0].render().shape == (480, 640, 3)
    check_env(gymnasium.make(f"indexer_env/{name}"), skip_render_check=False)
    env.close()


def test_options_are_those_of_the_next_reset():
    adapted, plain = StableBaselinesVecEnv(native()), native()
    adapted.seed(3)
    adapted.set_options({"start_angle": 3.0})
    np.testing.assert_array_equal(adapted.reset(), plain.reset(seed=3, options={"start_angle": 3.0})[0])
    np.testing.assert_array_equal(adapted.reset(), plain.reset()[0])
    adapted.set_options([{"start_angle": 3.0}, {}, {}])
    with pytest.raises(ParameterError, match="must be the same for all items"):
        adapted.reset()
