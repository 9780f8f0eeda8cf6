"""Episodes as a Minari data set, the standard of offline learning. Imported by itself: it needs the extra [minari]."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import gymnasium
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer

from indexer_env.checks import check_integer
from indexer_env.env import IndexerEnv
from indexer_env.errors import refuse

REQUIREMENTS = ["indexer-diagnosis"]
"""What a data set needs to make its environment again, as pip takes it."""


def record_episodes(
    env: gymnasium.Env,
    policy: Callable[[np.ndarray], np.ndarray] | None,
    episodes: int,
    dataset_id: str,
    *,
    seed: int = 0,
    **about: Any,
) -> minari.MinariDataset:
    """Run a policy and keep its episodes, each a row of its own with its own seed, in Minari's folder of data sets.

    Episode k starts with ``env.reset(seed=seed + k)``, and its row says so: ``reset(seed=row.seed)`` and the row's
    actions give the row's observations again, bit for bit.

    Parameters
    ----------
    env : gymnasium.Env
        An IndexerEnv under the wrappers that `gymnasium.make` puts around it, and any more. The data set keeps how it
        is made, so presets and plain values serve as its arguments, but no objects.
    policy : callable or None
        Observation to action; None draws actions from the action space, seeded with `seed`.
    episodes : int
        >= 1.
    dataset_id : str
        As Minari names it, "indexer/random-v0"; one that exists is refused by Minari.
    seed : int
        Of the first episode, >= 0.
    **about
        What Minari notes of a data set and warns of where it is missing: algorithm_name, author, author_email,
        code_permalink, description.

    Returns
    -------
    MinariDataset

    Raises
    ------
    ParameterError
        An environment that is none of ours or never ends an episode, numbers out of range.
    """
    if not isinstance(env.unwrapped, IndexerEnv):
        raise refuse("record_episodes", "env", "an IndexerEnv or a wrapper of one", env)
    if env.spec is None or env.spec.max_episode_steps is None:
        remedy = 'make it with gymnasium.make("indexer_env/Indexer-v1")'
        raise refuse("record_episodes", "env", "one with a spec and an end of its episodes", env, remedy)
    try:
        json.dumps([env.spec.kwargs, [wrapper.kwargs for wrapper in env.spec.additional_wrappers]])
    except TypeError as error:
        rule = "made of presets and plain values, which a data set can keep"
        raise refuse("record_episodes", "env", rule, env.spec.kwargs, str(error)) from None
    check_integer("record_episodes", "episodes", episodes, low=1)
    check_integer("record_episodes", "seed", seed, low=0)
    if policy is None:
        env.action_space.seed(seed)
    rows = [_episode(env, policy, k, seed + k) for k in range(episodes)]
    return minari.create_dataset_from_buffers(
        dataset_id, rows, env=env, eval_env=env.spec, requirements=REQUIREMENTS, **about
    )


def _episode(
    env: gymnasium.Env, policy: Callable[[np.ndarray], np.ndarray] | None, number: int, seed: int
) -> EpisodeBuffer:
    """One episode from its reset to its end."""
    observation, _ = env.reset(seed=seed)
    observations, actions, steps = [observation], [], []
    while not steps or not (steps[-1][1] or steps[-1][2]):
        chosen = env.action_space.sample() if policy is None else policy(observation.copy())
        kind = np.asarray(chosen).dtype.kind
        if isinstance(chosen, np.ma.MaskedArray) or kind not in "fiu":
            raise refuse("record_episodes", "policy", "one whose actions are plain arrays of numbers", chosen)
        # A copy of its own, as policies reuse their arrays: what the row holds is what the machine was told.
        action = np.array(chosen, dtype=env.action_space.dtype)
        observation, *step, _ = env.step(action)
        observations.append(observation)
        actions.append(action)
        steps.append(step)
    rewards, terminations, truncations = (list(column) for column in zip(*steps, strict=True))
    return EpisodeBuffer(
        number, seed, None, observations=observations, actions=actions, rewards=rewards, terminations=terminations,
        truncations=truncations,
    )  # fmt: skip
