"""What filters remember of the time before a window: unknown, so taken out of what the window is judged by.

A soft bracket rings from one index into the next one. A filter is linear, so its reading is that of a filter which was
at rest plus a free response F c, c its state at the window's start. With Q an orthonormal basis of F's columns, the
residual that is least in c is

    r - Q Qᵀ r

(variable projection: Golub and Pereyra 1973).
"""

from __future__ import annotations

import numpy as np


def free_responses(cascades: list[np.ndarray], samples: int) -> np.ndarray:
    """Orthonormal basis (samples, k) of what stable cascades of second-order sections (s, 6), one behind the other,
    read of nothing but their own states."""
    import scipy.linalg
    import scipy.signal

    sections = np.concatenate(cascades)
    units = np.eye(2 * len(sections)).reshape(-1, len(sections), 2).transpose(1, 0, 2)
    free, _ = scipy.signal.sosfilt(sections, np.zeros((2 * len(sections), samples)), zi=units)
    return scipy.linalg.orth(free.T)


def forgetful(residuals: np.ndarray, cascades: list[np.ndarray]) -> np.ndarray:
    """Residuals (n, samples) of equally long windows without any free response of the filters they were read by."""
    basis = free_responses(cascades, residuals.shape[1])
    return residuals - residuals @ basis @ basis.T
