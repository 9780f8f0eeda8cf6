"""A Minari data set holds the episodes that were run, each in a row of its own that can be made again."""

import gymnasium
import minari
import numpy as np
import pytest

from indexer_env import ParameterError, load_machine
from indexer_env.minari_export import record_episodes
from indexer_env.wrappers import DomainRandomisation

STEPS = 40
ABOUT = {"algorithm_name": "a", "author": "b", "author_email": "c", "code_permalink": "d", "description": "e"}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


def made(**arguments: object) -> gymnasium.Env:
    return gymnasium.make(
        "indexer_env/Indexer-v1", max_episode_steps=STEPS, faults={"backlash_deg": {"uniform": [0, 20]}},
        sensor="bench", **arguments,
    )  # fmt: skip


POLICIES = {
    "constant": lambda observation: np.array([0.4]),
    "of what it sees": lambda observation: observation[4:5],
    "random": None,
}


@pytest.mark.parametrize("name", POLICIES)
def test_a_row_is_an_episode_and_can_be_made_again(name):
    record_episodes(DomainRandomisation(made()), POLICIES[name], 3, "indexer/test-v0", seed=5, **ABOUT)
    read = minari.load_dataset("indexer/test-v0")
    assert (read.total_episodes, read.total_steps) == (3, 3 * STEPS)
    again = read.recover_environment()
    seeds = [row["seed"] for row in read.storage.get_episode_metadata(range(3))]
    assert seeds == [5, 6, 7]
    first = []
    for episode, seed in zip(read.iterate_episodes(), seeds, strict=True):
        observations, steps = [again.reset(seed=seed)[0]], []
        for action in episode.actions:
            observation, *step, _ = again.step(action)
            observations.append(observation)
            steps.append(step)
        np.testing.assert_array_equal(episode.observations, observations)
        rewards, terminations, truncations = zip(*steps, strict=True)
        np.testing.assert_array_equal(episode.rewards, rewards)
        np.testing.assert_array_equal(episode.terminations, terminations)
        np.testing.assert_array_equal(episode.truncations, truncations)
        assert truncations == (False,) * (STEPS - 1) + (True,)
        first.append(episode.observations[1])
    assert not np.array_equal(first[0], first[1])


def test_the_same_seed_records_the_same_random_episodes_and_another_does_not():
    rows = [
        next(
            iter(record_episodes(made(), None, 1, f"indexer/test-v{k}", seed=seed, **ABOUT).iterate_episodes())
        ).actions
        for k, seed in enumerate((3, 3, 4))
    ]
    np.testing.assert_array_equal(rows[0], rows[1])
    assert not np.array_equal(rows[0], rows[2])


@pytest.mark.parametrize(
    ("env", "episodes", "said"),
    [
        (lambda: gymnasium.make("CartPole-v1"), 1, "record_episodes.env must be an IndexerEnv or a wrapper of one"),
        (lambda: made().unwrapped, 1, "record_episodes.env must be one with a spec and an end of its episodes, got"),
        (lambda: made(machine=load_machine()), 1, "record_episodes.env must be made of presets and plain values"),
        (made, 0, "record_episodes.episodes must be a whole number >= 1, got 0."),
    ],
)
def test_what_cannot_be_recorded(env, episodes, said, tmp_path):
    with pytest.raises(ParameterError) as caught:
        record_episodes(env(), None, episodes, "indexer/test-v0", **ABOUT)
    assert str(caught.value).startswith(said)
    assert list(tmp_path.iterdir()) == []


def test_a_policy_may_reuse_its_arrays_and_write_into_what_it_sees():
    action, told = np.zeros(1, dtype=np.float32), []

    def policy(observation):
        observation *= 0.0
        action[0] = 0.5 + 0.01 * len(told)
        told.append(float(action[0]))
        return action

    record_episodes(made(), policy, 1, "indexer/reusing-v0", seed=1, **ABOUT)
    (episode,) = minari.load_dataset("indexer/reusing-v0").iterate_episodes()
    assert episode.actions[:, 0].tolist() == told and len(set(told)) == STEPS
    assert episode.observations.any(axis=1).all()


@pytest.mark.parametrize("chosen", [np.ma.array([0.5], mask=[True]), ["0.5"], [True]])
def test_what_is_no_plain_number_is_not_recorded(chosen):
    with pytest.raises(ParameterError, match="policy must be one whose actions are plain arrays of numbers"):
        record_episodes(made(), lambda _: chosen, 1, "indexer/refused-v0", **ABOUT)
