"""Filters over windows that repeat each other: what a window leaves in a filter is what the next one begins with.

A soft bracket rings from one index into the next one. With x the state of a section, A its transition per sample and B
its entrance, T the cam turn in samples, not a whole number, e what the window leaves after n = ⌊T⌋ samples in a section
that was at rest, and u_n the sample that follows,

    x_start = A^T x_start + A^(T-n) e + (T - n) B u_n
"""

from __future__ import annotations

import numpy as np


def repeating(sections: np.ndarray, rows: np.ndarray, period: float) -> np.ndarray:
    """Rows (rows, n) filtered causally by stable second-order sections (s, 6), as if each row repeated for ever.

    `period` is the time from one repetition to the next one [samples], > 0. What the rows hold beyond it plays no part
    in how they begin; a row that ends before is taken to stay at 0.
    """
    import scipy.signal

    n = min(int(period), rows.shape[1])
    part = period - n if n < rows.shape[1] else 0.0
    for section in sections:
        b, a = section[:3], section[4:]
        transition, entrance = np.array([[-a[0], 1.0], [-a[1], 0.0]]), b[1:] - a * b[0]
        _, left = scipy.signal.sosfilt(section[None], rows[:, :n], zi=np.zeros((1, len(rows), 2)))
        left = _power(transition, period - n) @ left[0].T
        if part:
            left += part * np.outer(entrance, rows[:, n])
        start = np.linalg.solve(np.eye(2) - _power(transition, period), left).T
        rows, _ = scipy.signal.sosfilt(section[None], rows, zi=start[None])
    return rows


def _power(matrix: np.ndarray, exponent: float) -> np.ndarray:
    """A power, not a whole one, of a matrix (2, 2) with distinct eigenvalues."""
    values, vectors = np.linalg.eig(matrix)
    return ((vectors * values.astype(complex) ** exponent) @ np.linalg.inv(vectors)).real
