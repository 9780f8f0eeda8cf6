"""What the vector environment does with tensors of a GPU in place of arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from indexer_env.control import ControlTask, checked_actions
from indexer_env.cuda.device import Cuda
from indexer_env.cuda.fleet import FleetOnCuda
from indexer_env.fleet import Fleet
from indexer_env.scenario import Scenario
from indexer_env.vector_parts import Arrays


class Tensors(Arrays):
    """Tensors of one GPU.

    Parameters
    ----------
    cuda : Cuda
    """

    def __init__(self, cuda: Cuda) -> None:
        self._cuda = cuda

    def fleet(self, n: int, scenario: Scenario, *, truth: bool) -> Fleet:
        """The machines, on the GPU."""
        return FleetOnCuda(self._cuda, n, scenario.task, scenario.limits, scenario.sensor, truth=truth)

    def shares(self, owner: str, actions: Any, n: int, task: ControlTask) -> Any:
        """Commands (n, k) of actions (n, k), a tensor or what can be an array; raises as `Arrays.shares`."""
        shape = (n, task.actions)
        if isinstance(actions, torch.Tensor):
            given = actions.detach()
            fits = given.is_floating_point() and given.shape == shape
            if not fits or not bool((given.abs() <= 1.0).all()):
                given = torch.from_numpy(checked_actions(owner, given.cpu().numpy(), shape))
        else:
            given = torch.from_numpy(checked_actions(owner, actions, shape))
        return 0.5 * (1.0 + given.to(self._cuda.place, torch.float64)) * self.given(task.highest)

    def given(self, array: np.ndarray) -> torch.Tensor:
        """An array of the host, as a tensor of the GPU; nothing travels where one truth value stands for all."""
        if array.dtype == bool and array.size and (array.all() or not array.any()):
            return torch.full(array.shape, bool(array.flat[0]), device=self._cuda.place)
        return torch.from_numpy(array).to(self._cuda.place)

    def on_host(self, array: torch.Tensor) -> np.ndarray:
        """A copy of a tensor on the host."""
        return array.cpu().numpy()

    def index(self, items: np.ndarray) -> torch.Tensor:
        """Numbers of items (k,), to index tensors."""
        return self._cuda.index_of(items)

    def zeros(self, *shape: int) -> torch.Tensor:
        """Zeros of this shape."""
        return torch.zeros(shape, dtype=torch.float64, device=self._cuda.place)

    def final_infos(self, observations: Any, ended: np.ndarray, infos: dict[str, Any]) -> dict[str, Any]:
        """As `final_infos`, but final_obs is one tensor (n, 7), in which the rows of `_final_obs` count."""
        mask = self.given(ended)
        return {"final_obs": observations.clone(), "_final_obs": mask, "final_info": infos, "_final_info": mask.clone()}
