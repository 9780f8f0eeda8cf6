"""Packs of machines run on a GPU: what `turns.TurnGroup` asks of whoever runs its machines."""

from __future__ import annotations

import numpy as np
import torch

from indexer_env.coefficients import Pack
from indexer_env.cuda.device import Cuda, rows_of_a_thread
from indexer_env.engine import LARGEST_DEFLECTION

MOST_ITEMS = 65_536
"""Items run together: some two rounds of all threads that a large GPU holds at once."""

_SHARE_OF_MEMORY = 8
"""Parts of the free memory of which one is the samples of a turn: those of the turn before stand beside them, and the
rest is left to the batch's records and to others."""


class OnCuda:
    """Runs packs on one GPU; samples stay there, states come back.

    Parameters
    ----------
    cuda : Cuda
    """

    def __init__(self, cuda: Cuda) -> None:
        self._cuda = cuda

    def empty(self, items: int, samples: int) -> torch.Tensor:
        """Room for one channel of a batch (items, samples)."""
        return torch.empty((items, samples), dtype=torch.float64, device=self._cuda.place)

    def index(self, which: np.ndarray) -> slice | torch.Tensor:
        """How items are indexed: a mask (n,), all of which takes no copy, or numbers (k,)."""
        if which.dtype == bool:
            return slice(None) if which.all() else self._cuda.index_of(np.flatnonzero(which))
        return self._cuda.index_of(which)

    def most_items(self, samples: int, channels: int) -> int:
        """Items to run together."""
        free = self._free_memory() // _SHARE_OF_MEMORY // (8 * max(1, samples) * channels)
        return max(32, min(MOST_ITEMS, free))

    def _free_memory(self) -> int:
        if self._cuda.place.type == "cpu":
            return 2**30
        return torch.cuda.mem_get_info(self._cuda.place)[0]

    def advance(
        self,
        pack: Pack,
        features: np.ndarray,
        n_steps: np.ndarray,
        steps: np.ndarray,
        last_steps: np.ndarray,
        *,
        every: int,
        rows: np.ndarray,
        samples: int,
    ) -> tuple[torch.Tensor, np.ndarray, np.ndarray]:
        """As `engine.advance`, with each item's own features (n,); the samples (n, c, samples) are a tensor of the
        device."""
        put, n = self._cuda.put, len(pack.states)
        states, out = put(pack.states), self._cuda.empty(n, len(rows), samples)
        status, when = self._cuda.zeros(n, dtype=torch.int64), self._cuda.zeros(n)
        counts = (np.argsort(features, kind="stable"), np.full(n, pack.model), features)
        self._cuda.launch(
            "advance", n, *(put(np.asarray(each, np.int64)).view for each in counts), states.view,
            put(pack.coefficients).view, put(pack.pieces).view, put(np.asarray(n_steps, np.int64)).view,
            put(np.asarray(steps, float)).view, put(np.asarray(last_steps, float)).view, every,
            put(rows_of_a_thread(rows)).view, LARGEST_DEFLECTION, out.view, status.view, when.view,
        )  # fmt: skip
        pack.states[:] = states.tensor.cpu().numpy()
        return out.tensor, status.tensor.cpu().numpy(), when.tensor.cpu().numpy()

    def differences(
        self, previous: torch.Tensor, present: torch.Tensor, lengths: np.ndarray, cam_turn: np.ndarray, least: int
    ) -> np.ndarray:
        """Relative rms difference (n,) as `turns.OnCores.differences` gives it, but for the order of its sums."""
        decided = (cam_turn >= least) & (lengths >= cam_turn)
        first, stop = np.where(decided, lengths - cam_turn, 0), np.where(decided, lengths, 0)
        difference = self._cuda.empty(len(lengths))
        put, seen = self._cuda.put, self._cuda.seen
        counts = (put(np.asarray(each, np.int64)).view for each in (first, stop))
        self._cuda.launch("differ", len(lengths), seen(previous).view, seen(present).view, *counts, difference.view)
        return difference.tensor.cpu().numpy()
