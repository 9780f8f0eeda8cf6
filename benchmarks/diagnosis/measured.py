"""Cases measured once at every setting: what policies are taught on, and what they are judged on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from indexer_env.diagnosis import draw_case, measure
from indexer_env.diagnosis_env import IndexerDiagnosisEnv

CHUNK = 256
"""Cases measured at once: bounds the memory of their records, 0.1 GB at the slowest setting."""


@dataclass(frozen=True, eq=False)
class Measured:
    """Cases, each with one measurement at each setting.

    Attributes
    ----------
    names : ndarray (n,) of int
        The right name of each case.
    levels : ndarray (n, settings, BANDS)
        What the environment would show of each measurement.
    """

    names: np.ndarray
    levels: np.ndarray

    def __len__(self) -> int:
        return len(self.names)


def measured(env: IndexerDiagnosisEnv, count: int, seed: int) -> Measured:
    """`count` cases drawn as the environment draws its episodes; case i comes from SeedSequence(seed, (i,)) alone."""
    names, levels = [], []
    for first in range(0, count, CHUNK):
        rngs = [
            np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(i,)))
            for i in range(first, min(first + CHUNK, count))
        ]
        cases = [draw_case(env.task, env.machine, rng) for rng in rngs]
        shown = [
            [found.levels for found in measure(cases, [s] * len(cases), env.operating_point, env.sensor, rngs)]
            for s in env.settings
        ]
        names += [case.name for case in cases]
        levels.append(np.stack(shown, axis=1))
    return Measured(np.array(names), np.concatenate(levels))
