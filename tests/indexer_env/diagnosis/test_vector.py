"""The native batch of the diagnosis environment is SyncVectorEnv without the loop, bit for bit."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

from indexer_env import ParameterError, SimulationError
from indexer_env.diagnosis_vector_env import IndexerDiagnosisVectorEnv

ID = "indexer_env/IndexerDiagnosis-v1"
SMALL = {"speeds": [1.0, 1.3], "brakes": [0.0, 200.0]}
COUNT = 4


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.value)
@pytest.mark.parametrize("arguments", [{}, {"reveal": True, "max_episode_steps": 2}], ids=str)
def test_native_is_sync(mode, arguments):
    """Turns, names, turns beyond the budget and truncations, side by side; seeded, then going on, then seeded anew."""
    given = {**SMALL, "budget": 0.2, **arguments}
    sync = gymnasium.make_vec(
        ID, num_envs=COUNT, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **given
    )
    native = gymnasium.make_vec(
        ID, num_envs=COUNT, vectorization_mode="vector_entry_point", autoreset_mode=mode, **given
    )
    assert native.metadata["autoreset_mode"] is mode is sync.metadata["autoreset_mode"]
    assert native.action_space == sync.action_space and native.observation_space == sync.observation_space
    assert data_equivalence(sync.reset(seed=5), native.reset(seed=5), exact=True)
    rng, ends = np.random.default_rng(0), 0
    for _ in range(12):
        actions = np.where(rng.random(COUNT) < 0.7, rng.integers(4, size=COUNT), rng.integers(4, 12, size=COUNT))
        expected, got = sync.step(actions), native.step(actions)
        assert data_equivalence(expected, got, exact=True)
        ended = got[2] | got[3]
        ends += int(ended.sum())
        if mode is AutoresetMode.DISABLED and ended.any():
            options = {"reset_mask": ended, "hypothesis": "intact"}
            expected, got = sync.reset(options=dict(options)), native.reset(options=dict(options))
            assert data_equivalence(expected, got, exact=True)
    assert ends >= 5
    again = {"seed": [7, None, 9, 10]}
    assert data_equivalence(sync.reset(**again), native.reset(**again), exact=True)


def test_the_first_reset_may_be_of_some_items_and_tell_the_truth():
    env = IndexerDiagnosisVectorEnv(3, **SMALL, reveal=True)
    mask = np.array([False, True, True])
    _, infos = env.reset(seed=3, options={"reset_mask": mask, "hypothesis": "cracked roller"})
    truth = infos["truth"]
    assert all(values.shape == (3,) for values in truth.values())
    assert truth["roller_crack"][0] == 0.0 and truth["roller_crack"][1:].all()
    np.testing.assert_array_equal(truth["_hypothesis"], mask)


def test_a_copy_goes_on_with_the_same_bits_and_shares_nothing():
    env = IndexerDiagnosisVectorEnv(3, **SMALL)
    env.reset(seed=1)
    env.step(np.array([0, 1, 5]))
    twin = pickle.loads(pickle.dumps(env))
    for actions in (np.array([1, 6, 2]), np.array([4, 2, 3])):
        step, expected = env.step(actions), twin.step(actions)
        assert data_equivalence(step, expected, exact=True)
        for spoilt in (step[0], step[1], step[4]["action_mask"]):
            spoilt[...] = 9


@pytest.mark.parametrize(
    ("actions", "said"),
    [
        (np.array([0, 12, 1]), r"IndexerDiagnosisVectorEnv \(item 1\)\.action must be a whole number >= 0 and <= 11"),
        (np.array([0, 1, -1]), r"IndexerDiagnosisVectorEnv \(item 2\)\.action must be a whole number"),
        (np.array([0.0, 1.0, 2.0]), r"IndexerDiagnosisVectorEnv\.action must be whole numbers of shape \(3,\)"),
        (np.zeros((3, 1), dtype=int), r"IndexerDiagnosisVectorEnv\.action must be whole numbers of shape \(3,\)"),
        (np.ma.array([0, 1, 2], mask=[0, 1, 0]), r"IndexerDiagnosisVectorEnv\.action must be whole numbers"),
    ],
)
def test_actions_that_are_none(actions, said):
    env, twin = IndexerDiagnosisVectorEnv(3, **SMALL), IndexerDiagnosisVectorEnv(3, **SMALL)
    for each in (env, twin):
        each.reset(seed=0)
    with pytest.raises(ParameterError, match=said):
        env.step(actions)
    np.testing.assert_array_equal(env.step(np.array([1, 2, 3]))[0], twin.step(np.array([1, 2, 3]))[0])


def test_a_machine_that_leaves_its_range_is_named(monkeypatch):
    """Item 2 is the only one that measures, and nothing is booked."""
    from indexer_env import diagnosis

    real = diagnosis.advance

    def failing(pack, *arguments, **others):
        out, status, when = real(pack, *arguments, **others)
        status[0] = 2
        return out, status, when

    env = IndexerDiagnosisVectorEnv(3, **SMALL)
    env.reset(seed=0)
    with monkeypatch.context() as patch:
        patch.setattr(diagnosis, "advance", failing)
        with pytest.raises(SimulationError, match=r"reference \(item 2\) left the model's range at a speed of 1 of"):
            env.step(np.array([4, 5, 0]))
    assert not env.step(np.array([0, 0, 0]))[2].any()


def test_steps_out_of_order():
    env = IndexerDiagnosisVectorEnv(2, autoreset_mode="Disabled", **SMALL)
    with pytest.raises(ResetNeeded, match="must follow a reset of all its machines"):
        env.step(np.array([0, 0]))
    env.reset(seed=0)
    env.step(np.array([4, 5]))
    with pytest.raises(ResetNeeded, match=r"Episodes \[0, 1\] have ended"):
        env.step(np.array([0, 0]))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"num_envs": 0}, "IndexerDiagnosisVectorEnv.num_envs must be a whole number >= 1 and <= 4096, got 0."),
        ({"num_envs": 5000}, "IndexerDiagnosisVectorEnv.num_envs must be a whole number >= 1 and <= 4096, got 5000."),
        ({"autoreset": 1}, "IndexerDiagnosisEnv has no parameter 'autoreset'; did you mean 'autoreset_mode'."),
        ({"autoreset_mode": "never"}, "IndexerDiagnosisVectorEnv.autoreset_mode must be one of NextStep, SameStep,"),
        ({"max_episode_steps": 0}, "IndexerDiagnosisVectorEnv.max_episode_steps must be a whole number >= 1, got 0."),
        ({"render_mode": "rgb_array"}, "IndexerDiagnosisVectorEnv.render_mode must be None, got 'rgb_array'"),
        ({"reveal": 1}, "IndexerDiagnosisVectorEnv.reveal must be True or False, got 1."),
    ],
)
def test_an_argument_that_cannot_be(arguments, said):
    with pytest.raises(ParameterError) as caught:
        IndexerDiagnosisVectorEnv(**arguments)
    assert str(caught.value).startswith(said)


def test_options_that_cannot_be():
    env = IndexerDiagnosisVectorEnv(2)
    with pytest.raises(ParameterError, match=r"reset\.options must be a mapping, got 3"):
        env.reset(options=3)
    with pytest.raises(ParameterError, match=r"reset has no option 'faults'; its only one is 'hypothesis'"):
        env.reset(options={"faults": {}})
    with pytest.raises(ParameterError, match=r"reset_mask must be a bool array of shape \(2,\)"):
        env.reset(options={"reset_mask": np.zeros(2, dtype=bool)})
    with pytest.raises(ParameterError, match=r"IndexerDiagnosisVectorEnv\.reset\.seed must be one or 2 whole numbers"):
        env.reset(seed=[1, 2, 3])


def test_gymnasium_s_wrapper_counts_episodes():
    env = gymnasium.make_vec(ID, num_envs=2, vectorization_mode="vector_entry_point", **SMALL)
    env = gymnasium.wrappers.vector.RecordEpisodeStatistics(env)
    env.reset(seed=0)
    env.step(np.array([2, 2]))
    assert env.step(np.array([4, 2]))[4]["episode"]["l"].tolist() == [2, 0]
