"""Motions that could be asked of a drive next: the same path at another pace, a smaller stroke, with a standstill."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from discrepancy.drives.description import LOAD
from discrepancy.drives.track import Track

PACES = (0.25, 0.5, 1.0, 2.0)
"""Of the measured pace: speed grows with it, acceleration with its square."""

STROKES = (0.3,)
"""Of the measured stroke, at the measured pace."""

_STANDING = 0.3
"""Length of the standstill that is added, of the record's."""


def imagined(track: Track) -> Iterator[tuple[str, Track]]:
    """Motions in words, each as a track whose force is zero; its noise is that of this track, as if stated."""
    track = dataclasses.replace(track, noise=track.falling_noise or track.noise, stated=True)
    for pace in PACES:
        words = "the same motion again" if pace == 1.0 else f"the same path at {pace:g} times the speed"
        yield words, _changed(track, track.q, pace * track.v, pace**2 * track.a, track.step / pace)
    for share in STROKES:
        q = track.middle + share * (track.q - track.middle)
        yield f"the same motion with {share:.0%} of the stroke", _changed(track, q, share * track.v, share * track.a)
    still = max(1, round(_STANDING * len(track.q)))
    held = [np.concatenate([row, np.full(still, end)]) for row, end in
            ((track.q, track.q[-1]), (track.v, 0.0), (track.a, 0.0))]  # fmt: skip
    inputs = track.u
    if inputs is not None:
        longer = [np.concatenate([row, np.full(still, row[-1])]) for row in _rows(inputs)]
        inputs = longer[0] if isinstance(inputs, np.ndarray) else type(inputs)(*longer)
    if track.deflection is not None:
        for name in LOAD[1:]:
            getattr(inputs, name)[-still:] = 0.0
    words = "the same motion with a standstill under control after it"
    yield words, _changed(track, held[0], held[1], held[2], u=inputs)


def _rows(inputs: np.ndarray | tuple) -> list[np.ndarray]:
    return [inputs] if isinstance(inputs, np.ndarray) else list(inputs)


def _behind(track: Track, q: np.ndarray, v: np.ndarray, a: np.ndarray, pace: float) -> Any:
    """The inputs with the load's motion behind a new one of the drive, where it is measured: its joint gives way as the
    acceleration says."""
    if track.deflection is None:
        return track.u
    size = float(np.std(a)) / float(np.std(track.a))
    old = zip((q, v, a), (track.q, track.v, track.a), (getattr(track.u, name) for name in LOAD), strict=True)
    new = [row - size * pace**k * (mine - load) for k, (row, mine, load) in enumerate(old)]
    return track.u._replace(**dict(zip(LOAD, new, strict=True)))


def _changed(
    track: Track, q: np.ndarray, v: np.ndarray, a: np.ndarray, step: float | None = None, u: Any = None
) -> Track:
    """The kernels keep their lengths in samples, so that a faster motion is seen and compared in a wider band. The
    variance of white noise grows with the band b, that of its k-th derivative with b^(2k + 1)."""
    step = step or track.step
    pace = track.step / step
    u = _behind(track, q, v, a, pace) if u is None else u
    orders: dict[str, int] = {name: order for order, name in enumerate(LOAD)}
    return dataclasses.replace(
        track, q=q, v=v, a=a, u=u, step=step, cutoff=pace * track.cutoff, wide=pace * track.wide,
        t=track.t[0] + step * np.arange(len(q)), force=np.zeros_like(q), noise=pace**0.5 * track.noise,
        motion_noise=tuple(pace ** (k + 0.5) * noise for k, noise in enumerate(track.motion_noise)),
        input_noise={n: pace ** (orders.get(n, 0) + 0.5) * noise for n, noise in track.input_noise.items()},
    )  # fmt: skip
