"""Windows to simulate, each from a start state at a point in the space of parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Jobs:
    """Windows to simulate: job i takes window `window[i]` with global parameters `points[point[i]]`, from `states[i]`.

    Attributes
    ----------
    points : ndarray (p, g)
        Scaled global parameters: the model's own, then the hypothesis's.
    point, window : ndarray (n,) of int
    states : ndarray (n, l)
        Scaled local parameters: the unknown state in which a window starts.
    apart : bool
        Whether each point takes the steps that it needs by itself; else all of one kind take the same ones, so that
        small differences between them are smooth.
    """

    points: np.ndarray
    point: np.ndarray
    window: np.ndarray
    states: np.ndarray
    apart: bool = False

    @classmethod
    def at(cls, z: np.ndarray, windows: np.ndarray, states: np.ndarray) -> Jobs:
        """Windows (n,) from start states (n, l), all with the same globals (g,)."""
        return cls(z[None], np.zeros(len(windows), dtype=np.int64), windows, states)

    def each(self, states: np.ndarray) -> Jobs:
        """All jobs (n,) once from each of the states (c, n, l)."""
        c, n, k = states.shape
        return Jobs(self.points, np.tile(self.point, c), np.tile(self.window, c), states.reshape(c * n, k), self.apart)
