"""What a simulation returns: the motion of one machine, or of a batch."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from indexer_env.checks import check_choice
from indexer_env.errors import refuse

CHANNELS = {
    "cam_angle": "rad", "cam_rate": "rad/s", "table_angle": "rad", "table_rate": "rad/s",
    "housing_angle": "rad", "housing_rate": "rad/s", "motor_angle": "rad", "motor_rate": "rad/s",
    "cam_acceleration": "rad/s²", "table_acceleration": "rad/s²", "housing_acceleration": "rad/s²",
    "motor_acceleration": "rad/s²",
    "deflection_1": "rad", "deflection_2": "rad", "deflection_3": "rad",
    "deflection_rate_1": "rad/s", "deflection_rate_2": "rad/s", "deflection_rate_3": "rad/s",
    "torque_1": "N m", "torque_2": "N m", "torque_3": "N m",
    "region_1": "-", "region_2": "-", "region_3": "-",
}  # fmt: skip
"""Quantities that can be recorded, with their units. Regions are +1 and -1 in contact, 0 inside the play."""


def check_channels(owner: str, channels: tuple[str, ...]) -> None:
    """Refuse what is not a tuple of at least one channel that exists."""
    if not isinstance(channels, tuple) or not channels:
        raise refuse(owner, "channels", "a tuple of at least one channel", channels)
    for channel in channels:
        check_choice(owner, "channels", channel, CHANNELS)


def _recorded(channels: dict[str, np.ndarray], name: str) -> np.ndarray:
    """A channel; refuses one that was not recorded."""
    if name not in channels:
        raise refuse("Run", "channels", f"a tuple that holds {name} where it is asked for", tuple(channels))
    return channels[name]


@dataclass(frozen=True)
class WarmupReport:
    """How the transient was left behind.

    Attributes
    ----------
    turns : int
        Whole table turns run before the record.
    settled : bool
        Whether the recorded turn's last cam turn agrees with that of the turn before to the tolerance.
    difference : float
        Relative rms difference of φ̈ between the two [-]; NaN where no two turns were run.
    """

    turns: int
    settled: bool
    difference: float


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Motion of one machine, sampled evenly.

    Attributes
    ----------
    sample_rate : float
        [Hz].
    channels : dict of str to ndarray (n,)
        Recorded quantities in the units of `CHANNELS`.
    warmup : WarmupReport or None
        How the transient was left behind; None where no record was compared.
    """

    sample_rate: float
    channels: dict[str, np.ndarray]
    warmup: WarmupReport | None = None

    @property
    def time(self) -> np.ndarray:
        """Time from the record's start [s], (n,)."""
        return np.arange(len(next(iter(self.channels.values())))) / self.sample_rate

    @property
    def table_acceleration(self) -> np.ndarray:
        """φ̈ [rad/s²], (n,)."""
        return _recorded(self.channels, "table_acceleration")


@dataclass(frozen=True, eq=False)
class Batch:
    """Motion of a batch of machines.

    Attributes
    ----------
    sample_rate : float
        [Hz].
    channels : dict of str to ndarray (n_items, n_samples)
        Recorded quantities in the units of `CHANNELS`; rows of rejected items are NaN. Of a GPU they are torch tensors.
    warmup_turns : ndarray (n_items,) of int
    settled : ndarray (n_items,) of bool
    warmup_difference : ndarray (n_items,)
        As in `WarmupReport`.
    rejected : dict of int to str
        Items that could not be run, each with its reason in one sentence.
    """

    sample_rate: float
    channels: dict[str, np.ndarray]
    warmup_turns: np.ndarray
    settled: np.ndarray
    warmup_difference: np.ndarray
    rejected: dict[int, str] = field(default_factory=dict)

    @property
    def table_acceleration(self) -> np.ndarray:
        """φ̈ [rad/s²], (n_items, n_samples)."""
        return _recorded(self.channels, "table_acceleration")

    def __len__(self) -> int:
        return len(self.settled)
