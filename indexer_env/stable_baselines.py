"""The native vector environment as stable-baselines3 takes it. Imported by itself, as it needs the extra [rl]."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from indexer_env.errors import refuse
from indexer_env.vector_env import IndexerVectorEnv


class StableBaselinesVecEnv(VecEnv):
    """An `IndexerVectorEnv`, all machines in one kernel call, under the interface of stable-baselines3's algorithms.

    Infos hold what stable-baselines3 itself reads: "terminal_observation" and "TimeLimit.truncated" where an episode
    has ended.

    Parameters
    ----------
    env : IndexerVectorEnv
        As `gymnasium.make_vec(..., vectorization_mode="vector_entry_point", autoreset_mode="SameStep")` gives it.

    Raises
    ------
    ParameterError
        Another environment or autoreset mode: stable-baselines3 expects the first observation of the next episode in
        the step that ends one.
    """

    def __init__(self, env: gymnasium.vector.VectorEnv) -> None:
        native = env.unwrapped
        if env is not native or not isinstance(native, IndexerVectorEnv):
            raise refuse("StableBaselinesVecEnv", "env", "an IndexerVectorEnv without wrappers", env)
        if native.autoreset_mode is not AutoresetMode.SAME_STEP:
            rule = 'in autoreset mode "SameStep"'
            raise refuse("StableBaselinesVecEnv", "env", rule, native.autoreset_mode.value, "give it to make_vec")
        self._env = native
        super().__init__(native.num_envs, native.single_observation_space, native.single_action_space)

    def reset(self) -> np.ndarray:
        """Start all episodes; item i has the seed s + i after `seed(s)`."""
        first, *others = self._options
        if any(other != first for other in others):
            raise refuse("StableBaselinesVecEnv", "set_options", "the same for all items", self._options)
        observations, _ = self._env.reset(seed=self._seeds, options=first)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions (n, k) until `step_wait`, which checks them."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Run one control period: observations (n, 7), rewards (n,), ends (n,) bool and infos."""
        observations, rewards, terminated, truncated, batched = self._env.step(self._actions)
        ends = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(ends).tolist():
            infos[i]["terminal_observation"] = batched["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return observations, rewards, ends, infos

    def close(self) -> None:
        """Close the environment."""
        self._env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The environment's attribute, once for each of the items asked for."""
        value = getattr(self._env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refused: the items are one batch, whose numbers are fixed when it is made."""
        raise refuse("StableBaselinesVecEnv", attr_name, "left as it is", value, "give it to make_vec")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Refused: there is no environment of one item whose method could be called."""
        raise refuse("StableBaselinesVecEnv", "env_method", "called on the vector environment itself", method_name)

    def env_is_wrapped(self, wrapper_class: type[gymnasium.Wrapper], indices: VecEnvIndices = None) -> list[bool]:
        """False for each of the items asked for."""
        return [False for _ in self._get_indices(indices)]
