"""References that a drive is asked to follow, each for a stroke of 1 (from -½ to ½) and a duration of 1."""

from __future__ import annotations

import numpy as np

KINDS = ("point_to_point", "sines", "sweep", "steps")


def reference(kind: str, samples: int, turns: float, rng: np.random.Generator) -> np.ndarray:
    """A reference (n,): `turns` strokes there and back over the record, smooth up to its acceleration.

    point_to_point: trapezoids of speed with pauses; sines: three of them with random phases; sweep: one whose frequency
    rises threefold; steps: to random places.
    """
    t = np.arange(samples) / samples
    if kind == "sines":
        row = np.zeros(samples)
        for a, f in ((1.0, 0.5), (0.5, 1.13), (0.15, 2.9)):
            row += a * np.sin(2.0 * np.pi * turns * f * t + rng.uniform(0.0, 2.0 * np.pi))
    elif kind == "sweep":
        row = np.sin(2.0 * np.pi * turns * (0.5 * t + 0.5 * t**2))
    else:
        count = max(2, round(2.0 * turns))
        places = np.tile([-1.0, 1.0], count)[:count] if kind == "point_to_point" else rng.uniform(-1.0, 1.0, count)
        row = np.repeat(np.concatenate([[0.0], places]), -(-samples // (count + 1)))[:samples]
        # a ramp, then twice smoothed: speed, acceleration and jerk stay bounded
        for share in (0.45, 0.12, 0.06):
            width = max(2, round(share * samples / (count + 1)))
            row = np.convolve(np.pad(row, (width, width), mode="edge"), np.ones(width) / width, mode="same")[
                width:-width
            ]
    low, high = float(row.min()), float(row.max())
    return (row - low) / (high - low) - 0.5
