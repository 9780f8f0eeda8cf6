"""What networks say -> what is told: an alarm at a stated rate of false ones, names, sizes with intervals, novelty.

Every threshold is a conformal quantile over simulated turns that no network was taught on, so its rate holds for
machines of the posterior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import nn

from classifier.tasks.conformal import conformal_quantile
from twin.data import Turns
from twin.learn import Feed, View, said

NAMED = 0.5
"""Probability above which a fault is named."""

ACCEPTED = 0.99
"""Share of turns like the simulated ones that do not count as novel."""

_LOOKS = 4
"""Times that each turn is looked at with other noise, so that quantiles are steadier."""

_LEAST = 30
"""Fewest turns with a fault for an interval of its size."""


def sigmoid(logits: np.ndarray) -> np.ndarray:
    """1/(1 + e^-x)."""
    return 0.5 * (1.0 + np.tanh(0.5 * logits))


@dataclass(frozen=True, eq=False)
class Judge:
    """Thresholds.

    Attributes
    ----------
    alarm : float
        Logit of any fault above which a turn is called faulty.
    reach : ndarray (faults,)
        Half width of a size's interval over its own spread.
    novelty : ndarray (3,)
        ln of the usual novelty as a quadratic in ln of the turn's strength.
    strange : float
        ln by which a novelty must exceed the usual one.
    """

    alarm: float
    reach: np.ndarray
    novelty: np.ndarray
    strange: float

    def plain(self) -> dict[str, Any]:
        """As YAML knows it."""
        return {
            "alarm": float(self.alarm), "reach": [float(v) for v in self.reach],
            "novelty": [float(v) for v in self.novelty], "strange": float(self.strange),
        }  # fmt: skip

    @classmethod
    def restore(cls, given: Mapping[str, Any]) -> Judge:
        """What gave these values."""
        return cls(given["alarm"], np.array(given["reach"]), np.array(given["novelty"]), given["strange"])

    def strangeness(self, told: Mapping[str, np.ndarray]) -> np.ndarray:
        """Novelty (n,) over its threshold; above 1 a turn is like none of the simulated ones."""
        usual = np.polyval(self.novelty, np.log(told["strength"]))
        return np.exp(np.log(told["novelty"]) - usual - self.strange)


def ensemble(networks: Sequence[nn.Module], x: torch.Tensor, conditions: torch.Tensor) -> dict[str, np.ndarray]:
    """The mean of what several networks say."""
    each = [said(network, x, conditions) for network in networks]
    return {name: np.mean([one[name] for one in each], axis=0) for name in each[0]}


def looked_at(
    networks: Sequence[nn.Module], turns: Turns, view: View, rows: np.ndarray, seed: int, looks: int = _LOOKS
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What networks say of these turns with noise, each looked at several times, and the row of each look."""
    feed, generator = Feed(turns, view), torch.Generator().manual_seed(seed)
    those = torch.from_numpy(np.tile(rows, looks))
    parts = []
    for some in those.split(512):
        x, conditions, _ = feed.noisy(some, generator)
        parts.append(ensemble(networks, x, conditions))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}, those.numpy()


def judge_of(
    networks: Sequence[nn.Module], control: Turns, healthy: Turns, view: View, *, false_alarms: float, coverage: float,
    seed: int,
) -> Judge:  # fmt: skip
    """Thresholds from the control turns and from healthy ones."""
    sound, _ = looked_at(networks, healthy, view, np.arange(len(healthy.x)), seed)
    alarm = conformal_quantile(sound["any"], 1.0 - false_alarms)
    told, rows = looked_at(networks, control, view, np.flatnonzero(control.subset == 1), seed + 1)
    there, size = control.there[rows], control.size[rows]
    seen = told["any"] > alarm
    reach = []
    for fault in range(there.shape[1]):
        mine = there[:, fault] & seen & (told["faults"][:, fault] > 0.0)
        mine = mine if mine.sum() >= _LEAST else there[:, fault]
        error = np.abs(told["size"][mine, fault] - size[mine, fault]) / np.exp(told["spread"][mine, fault])
        reach.append(conformal_quantile(error, coverage))
    strength = np.log(np.concatenate([told["strength"], sound["strength"]]))
    novelty = np.log(np.concatenate([told["novelty"], sound["novelty"]]))
    usual = np.polyfit(strength, novelty, 2)
    strange = conformal_quantile(novelty - np.polyval(usual, strength), ACCEPTED)
    return Judge(alarm, np.array(reach), usual, strange)
