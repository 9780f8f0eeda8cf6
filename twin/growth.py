"""How wide a fit may miss a turn with faults: what the posterior leaves open grows with them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from indexer_env import OperatingPoint
from twin.synthesis import Synthesis
from twin.work import BAD, Work

_USUAL = 0.9
"""Share of turns that tell it: in play some come out otherwise altogether, which their own chance covers."""

_STRONG = 10.0
"""Square of a strength below which a turn says little of what grows with it."""

_TOGETHER = 32
"""Turns simulated at once, which bounds the memory."""


def growth_of(
    of: Synthesis, x: np.ndarray, points: Sequence[OperatingPoint], size: np.ndarray, station: np.ndarray
) -> np.ndarray:
    """C_faulty (k, k) from turns x (n, stations, cells) without noise, of machines of the posterior: what their known
    sizes leave when the twin's machine is simulated with them. Faults with a phase are left out of it."""
    phased = [place for place, fault in enumerate(of.faults) if fault.others and not fault.effect.endswith("_single")]
    m = of.seen(x)
    strength = (m**2).mean(axis=1)
    mine = np.flatnonzero((strength > _STRONG) & (size[:, phased] == 0.0).all(axis=1))
    rows = []
    for first in range(0, len(mine), _TOGETHER):
        part = mine[first : first + _TOGETHER]
        work = Work(of, m[part], [points[k] for k in part], size[part] != 0.0, station[part])
        t = np.concatenate([size[part], np.zeros((len(part), len(work.phased) + of.nuisance.count))], axis=1)
        found = work.at(t, np.arange(len(part)))
        rows.append(found.off[found.q < BAD] / np.sqrt(strength[part][found.q < BAD])[:, None])
    off = np.concatenate(rows) if rows else np.zeros((0, m.shape[1]))
    size_of = (off**2).sum(axis=1)
    off = off[size_of <= np.quantile(size_of, _USUAL)] if len(off) else off
    return off.T @ off / max(1, len(off))
