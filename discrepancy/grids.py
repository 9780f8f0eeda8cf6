"""Grids of start states side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np


def by_size(grids: Sequence[np.ndarray], most: int) -> Iterator[tuple[list[int], np.ndarray]]:
    """Numbers (p,) of grids of one size c, and these side by side (c, p, 2): no more than `most` rows of them at once,
    but for a single one. Those of no rows stand together."""
    sizes: dict[int, list[int]] = {}
    for number, grid in enumerate(grids):
        sizes.setdefault(len(grid), []).append(number)
    for size, numbers in sizes.items():
        step = max(1, most // size) if size else len(numbers)
        for part in (numbers[first : first + step] for first in range(0, len(numbers), step)):
            yield part, np.stack([grids[number] for number in part], axis=1)
