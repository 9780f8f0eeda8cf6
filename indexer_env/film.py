"""What `IndexerEnv` shows: the last seconds of an episode, kept as scenes need them (indexer_env.render)."""

from __future__ import annotations

from collections import deque

import numpy as np

from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.render import Scene, scene_from

_HISTORY = ("time", "motor_angle", "table_acceleration")


class Film:
    """The channels of an episode's last periods, as many as the strip chart shows.

    Parameters
    ----------
    window : float
        Length of the strip chart [s].
    period : float
        Control period [s].
    """

    def __init__(self, window: float, period: float) -> None:
        self._window = window
        self._periods: deque[dict[str, np.ndarray]] = deque(maxlen=int(window / period) + 2)

    def start(self, channels: dict[str, np.ndarray]) -> None:
        """Begin an episode with its first period's channels (m,), all of which hold the start."""
        self._periods.clear()
        self._periods.append({name: values[-1:] for name, values in channels.items()})

    def add(self, channels: dict[str, np.ndarray]) -> None:
        """Append a period's channels (m,)."""
        self._periods.append(channels)

    def scene(self, machine: Machine, operating_point: OperatingPoint) -> Scene:
        """The present scene of a machine with its faults; the nominal speed is the operating point's."""
        history = {name: np.concatenate([period[name] for period in self._periods]) for name in _HISTORY}
        now = {name: float(values[-1]) for name, values in self._periods[-1].items()}
        return scene_from(
            machine, now, time=now["time"], operating_point=operating_point, history=history, window=self._window
        )
