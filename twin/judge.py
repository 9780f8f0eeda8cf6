"""What networks say -> what is told: an alarm at a stated rate of false ones, and intervals of sizes.

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
from twin.weigh import reaches

NAMED = 0.5
"""Probability above which a fault is named."""

_LOOKS = 4
"""Times that each turn is looked at with other noise, so that quantiles are steadier."""


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
    reach : ndarray (faults, 2)
        Half width of a size's interval over its own spread: named alone, and beside others.
    """

    alarm: float
    reach: np.ndarray

    def plain(self) -> dict[str, Any]:
        """As YAML knows it."""
        return {"alarm": float(self.alarm), "reach": self.reach.tolist()}

    @classmethod
    def restore(cls, given: Mapping[str, Any]) -> Judge:
        """What gave these values."""
        return cls(given["alarm"], np.array(given["reach"]))


def ensemble(networks: Sequence[nn.Module], x: torch.Tensor, conditions: torch.Tensor) -> dict[str, np.ndarray]:
    """The mean of what several networks say."""
    each = [said(network, x, conditions) for network in networks]
    return {name: np.mean([one[name] for one in each], axis=0) for name in each[0]}


def looked_at(
    networks: Sequence[nn.Module], turns: Turns, view: View, rows: np.ndarray, seed: int, looks: int = _LOOKS
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What networks say of these turns with noise, each looked at several times, and the row of each look."""
    feed, generator = Feed(turns.part(rows), view), torch.Generator().manual_seed(seed)
    parts = []
    for some in torch.arange(len(rows)).repeat(looks).split(512):
        x, conditions = feed.noisy(some, generator)
        parts.append(ensemble(networks, x, conditions))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}, np.tile(rows, looks)


def judge_of(
    networks: Sequence[nn.Module], control: Turns, healthy: Turns, view: View, *, false_alarms: float, coverage: float,
    seed: int,
) -> Judge:  # fmt: skip
    """Thresholds from the control turns and from healthy ones."""
    sound, rows = looked_at(networks, healthy, view, np.arange(len(healthy.x)), seed)
    alarm = conformal_quantile(sound["any"], 1.0 - false_alarms, rows)
    told, rows = looked_at(networks, control, view, np.flatnonzero(control.subset == 1), seed + 1)
    there, size = control.there[rows], control.size[rows]
    seen = told["any"] > alarm
    error = np.abs(told["size"] - size) / np.exp(told["spread"])
    named = (told["faults"] > 0.0) & seen[:, None]
    return Judge(float(alarm), reaches(error, named & there, named, coverage, rows)[0])
