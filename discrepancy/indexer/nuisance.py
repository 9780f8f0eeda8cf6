"""What belongs to a window's reading, is unknown and tells nothing: hum's phase, and what filters remember of the time
before. Both are taken out of the residual by which the window is judged.

A soft bracket rings from one index into the next one. A filter is linear, so its reading is that of a filter which was
at rest plus a free response F c, c its state at the window's start. With Q an orthonormal basis of F's k columns, n
samples long, the residual that is least in c is

    √(n/(n - k)) (r - Q Qᵀ r)

(variable projection: Golub and Pereyra 1973), so lengthened that white noise keeps its mean square: no filter may gain
by what it forgets.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np


def free_responses(cascades: Sequence[np.ndarray], samples: int) -> np.ndarray:
    """Orthonormal basis (k, samples) of what stable cascades of second-order sections (s, 6), one behind the other,
    read of nothing but their own states."""
    return _free_responses(np.concatenate(cascades).tobytes(), samples)


@functools.lru_cache(maxsize=128)
def _free_responses(cascade: bytes, samples: int) -> np.ndarray:
    """The same of one cascade's numbers: a search of start states asks for one filter's again and again."""
    import scipy.linalg
    import scipy.signal

    sections = np.frombuffer(cascade).reshape(-1, 6).copy()
    units = np.eye(2 * len(sections)).reshape(-1, len(sections), 2).transpose(1, 0, 2)
    free, _ = scipy.signal.sosfilt(sections, np.zeros((2 * len(sections), samples)), zi=units)
    basis = scipy.linalg.orth(free.T).T
    basis.flags.writeable = False
    return basis


def without_nuisance(
    residuals: np.ndarray, filters: Sequence[np.ndarray], hum_amplitude: float, cycles: float, third: float = 0.0
) -> np.ndarray:
    """Residuals (rows, n) of equally long windows without what is unknown and tells nothing.

    Parameters
    ----------
    residuals : ndarray (rows, n)
        Reading without hum, its filters at rest before, less the measured one.
    filters : sequence of ndarray (s, 6)
        Cascades of second-order sections that the reading went through.
    hum_amplitude : float
        Of hum that the other reading lacks [its unit]; it is added in each window with the phase that fits best. The
        mains frequency wanders, so that no phase holds for a whole record.
    cycles : float
        Of hum per sample.
    third : float
        Its third harmonic over the fundamental, whose phase it follows (`Sensor.hum_third`).
    """
    n = residuals.shape[1]
    cascade = np.concatenate(filters).tobytes() if filters else b""
    basis = _free_responses(cascade, n) if filters else np.zeros((0, n))
    left = residuals - (residuals @ basis.T) @ basis
    if hum_amplitude != 0.0:
        waves, inverse = _hum(cascade, n, cycles)
        fitting = left @ inverse
        size = np.maximum(np.linalg.norm(fitting, axis=1, keepdims=True), 1e-300)
        left = left - hum_amplitude * (fitting / size) @ waves
        if third != 0.0:
            phase = 3.0 * np.arctan2(-fitting[:, :1], -fitting[:, 1:])
            harmonic = np.sin(3.0 * (2.0 * math.pi * cycles * np.arange(n)) + phase)
            left = left + hum_amplitude * third * (harmonic - harmonic @ basis.T @ basis)
    left *= math.sqrt(n / (n - len(basis)))
    return left


@functools.lru_cache(maxsize=128)
def _hum(cascade: bytes, samples: int, cycles: float) -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine (2, samples) of hum without what filters' states explain, and their pseudo-inverse: of one mains
    frequency they are asked for again and again."""
    angle = 2.0 * math.pi * cycles * np.arange(samples)
    waves = np.stack([np.cos(angle), np.sin(angle)])
    if cascade:
        basis = _free_responses(cascade, samples)
        waves = waves - waves @ basis.T @ basis
    inverse = np.linalg.pinv(waves)
    waves.flags.writeable = inverse.flags.writeable = False
    return waves, inverse
