"""A record as the equations see it: its motion smoothed and differentiated, its force through the same kernel."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from discrepancy.drives import smoothing
from discrepancy.drives.band import PER_CUTOFF, WIDER, cutoff_of
from discrepancy.drives.channels import Record
from discrepancy.drives.description import LOAD, Drive
from discrepancy.drives.readings import acting
from discrepancy.drives.scales import Scales, scales_of
from indexer_env.errors import SignalError, refuse

_INNER = 16.0
"""Samples per period of the comparison's cut-off at which the equations are evaluated."""

_AT_REST = 3.0
"""Standard deviations of the speed's noise below which the drive counts as standing; never less than a thousandth of
the rms speed."""

_FEWEST = 40
"""Compared samples of a record below which nothing is told: a window of twenty to fit and one to hold out."""

_STANDING = 3
"""Samples below that speed that make a standstill, and not a reversal."""

_SMEARED = 2.0
"""Standard deviations of the motion's kernel by which a standstill may be longer than it seems: that smooths the start
out of it."""

_UNFILTERED = 0.25
"""Highest frequency over the rate at which that is read, below where the noise is taken from else."""

_FALLS = 5.0
"""Density of the force's noise just above the motion's cut-off, over that of the upper half of the band, from which on
it falls with frequency. White noise has 1 there, and the force of most motions hardly adds to it."""

_LEAST_NOISE = 1e-4
"""Least noise over the rms of the force: a record without noise still has digits and a model that is not exact."""


@dataclass(frozen=True, eq=False)
class Track:
    """One record at the inner rate.

    Attributes
    ----------
    name : str
    step : float
        [s]
    t, q, v, a : ndarray (n,)
        Time since the record's first sample [s], motion.
    u : ndarray (n,), named tuple of such, or None
        Inputs.
    force : ndarray (n,)
        Measured, through the motion's kernel [F].
    cutoff, wide : float
        Of the comparison and of the motion [Hz].
    every : int
        One of so many samples is kept for the comparison.
    noise : float
        Standard deviation of the force's noise in the comparison [F]; of what the motion's noise adds, `motion_noise`.
    motion_noise : tuple of float
        Standard deviations of q, v and a in the comparison.
    input_noise : mapping of str to float
        The same of the inputs by their names, the load's position, speed and acceleration among them.
    still : float
        Speed below which it stands.
    stated : bool
        Whether the force's noise was stated.
    middle, stroke : float
        Middle and half of the stroke of all records.
    """

    name: str
    step: float
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    u: Any
    force: np.ndarray
    cutoff: float
    wide: float
    every: int
    noise: float
    motion_noise: tuple[float, float, float]
    input_noise: Mapping[str, float]
    still: float
    stated: bool = False
    middle: float = 0.0
    stroke: float = 1.0

    @property
    def deflection(self) -> np.ndarray | None:
        """How far the load is behind (n,), where it is measured."""
        return self.q - self.u.q_load if self._loaded else None

    @property
    def deflection_rate(self) -> np.ndarray | None:
        """Its rate (n,)."""
        return self.v - self.u.v_load if self._loaded else None

    @property
    def _loaded(self) -> bool:
        return LOAD[1] in getattr(self.u, "_fields", ())

    @functools.cached_property
    def falling_noise(self) -> float:
        """Standard deviation of the force's noise in the comparison [F] where it falls with frequency, as behind a
        filter; 0 where it is as white as was read off the top of its spectrum or stated."""
        rate, both = 1.0 / self.step, 1.0 / math.hypot(1.0 / self.wide, 1.0 / self.cutoff)
        if self.stated or 2.0 * self.wide > _UNFILTERED * rate:
            return 0.0
        low = self.wide
        found = smoothing.quiet_density(self.force, rate, low)
        # what the motion's kernel has left of it there
        middle = math.sqrt(2.0) * low
        found *= math.exp((2.0 * math.pi * middle * smoothing.deviation(self.wide)) ** 2)
        if smoothing.passed_noise(found, both) < math.sqrt(_FALLS) * self.noise:
            return 0.0
        return smoothing.falling_noise(found, middle, both, float(self.t[-1] - self.t[0]))

    def inputs_with(self, name: str, row: np.ndarray) -> Any:
        """The inputs, one of them another row (n,)."""
        return row if isinstance(self.u, np.ndarray) else self.u._replace(**{name: row})

    def input(self, name: str) -> np.ndarray:
        """One of the inputs (n,)."""
        return self.u if isinstance(self.u, np.ndarray) else getattr(self.u, name)

    @functools.cached_property
    def rest(self) -> np.ndarray:
        """Where it stands (n,), or may: a standstill's end is known to what the motion's kernel reaches."""
        from scipy.ndimage import binary_dilation, binary_opening

        slow = np.abs(self.v) < self.still
        reach = math.ceil(_SMEARED * smoothing.deviation(WIDER * self.cutoff) / self.step)
        return slow | binary_dilation(binary_opening(slow, np.ones(_STANDING)), iterations=reach)

    @functools.cached_property
    def direction(self) -> np.ndarray:
        """±1 (n,), 0 at rest."""
        return np.where(self.rest, 0.0, np.sign(self.v))

    def thinned(self, row: np.ndarray) -> np.ndarray:
        """A row (n,), or rows (k, n), through the comparison's kernel, at its rate."""
        weights = self._weights
        windows = np.lib.stride_tricks.sliding_window_view(row, len(weights), axis=-1)
        return windows[..., :: self.every, :] @ weights

    @functools.cached_property
    def _weights(self) -> np.ndarray:
        return smoothing.kernel(self.cutoff, 1.0 / self.step)

    @functools.cached_property
    def measured(self) -> np.ndarray:
        """The force as it is compared (m,)."""
        return self.thinned(self.force)

    def passes(self, rate: np.ndarray | float) -> np.ndarray | float:
        """What the motion's kernel, through which the force was measured, leaves of a wave of this rate [rad/s]."""
        return np.exp(-0.5 * (rate * smoothing.deviation(self.wide)) ** 2)

    @property
    def colour(self) -> float:
        """Coefficient ρ of the first-order autoregression whose correlations have the sum of squares, ρ²/(1 - ρ²), of
        those of white noise behind both kernels, exp(-τ²/(4 s²)): the levels of cells then spread alike."""
        s = math.hypot(smoothing.deviation(self.cutoff), smoothing.deviation(self.wide))
        lags = self.step * self.every * np.arange(1, len(self.measured))
        squares = float(np.exp(-(lags**2) / (2.0 * s**2)).sum())
        return math.sqrt(squares / (1.0 + squares))

    @functools.cached_property
    def at(self) -> np.ndarray:
        """Samples (m,) that the compared ones are centred on."""
        return len(self._weights) // 2 + self.every * np.arange(len(self.measured))


def tracks_of(drive: Drive, records: Sequence[Record]) -> tuple[list[Track], Scales]:
    """All records at one cut-off, and the drive's scales.

    Raises
    ------
    SignalError
        Units that differ between records, a motion that never moves, a record too short for the low-pass.
    """
    units = {(r.units.get("force", ""), _position_unit(r)) for r in records}
    if len(units) > 1:
        raise SignalError(f"All records must have the same units, got {' and '.join(map(str, sorted(units)))}.")
    force_unit, position_unit = units.pop()
    cutoff = drive.cutoff or cutoff_of(records)
    highest = smoothing.WIDEST * min(r.rate for r in records)
    if cutoff > highest:
        rule = f"at most {smoothing.WIDEST:g} of the sampling rate, {highest:.4g} Hz"
        raise refuse(drive.path.name, "cutoff", rule, cutoff, "leave it out to have it chosen")
    tracks = [_track(drive, record, cutoff) for record in records]
    fitted = [t for t, r in zip(tracks, records, strict=True) if not r.held_out]
    scales = scales_of(fitted, force_unit, position_unit)
    return [dataclasses.replace(t, middle=scales.middle, stroke=scales.Q) for t in tracks], scales


def _position_unit(record: Record) -> str:
    """Unit of position, by that of the channel that the motion is measured by."""
    if "q" in record.units:
        return record.units["q"]
    unit = record.units["v"]
    if not unit.endswith("/s"):
        raise SignalError(f"{record.name}: the speed must be in UNIT/s, got {unit!r}; state it in channels.")
    return unit.removesuffix("/s")


def _track(drive: Drive, record: Record, cutoff: float) -> Track:
    rate, rows = record.rate, record.rows
    wide = min(WIDER * cutoff, smoothing.WIDEST * rate)
    edge = smoothing.margin(wide, rate)
    inner = max(1, int(rate / (_INNER * cutoff)))
    part = slice(edge, -edge, inner)
    step = inner / rate
    every = max(1, int(1.0 / (step * PER_CUTOFF * cutoff)))
    seen = len(range(edge, len(rows["force"]) - edge, inner)) - 2 * smoothing.margin(cutoff, 1.0 / step)
    compared = max(0, math.ceil(seen / every))
    if compared < _FEWEST:
        raise SignalError(
            f"{record.name} must leave at least {_FEWEST} samples to compare below {cutoff:.3g} Hz, got {compared} of "
            f"{len(rows['force'])}; set a higher cutoff or record longer."
        )

    def through(role: str, order: int = 0) -> np.ndarray:
        row = acting(rows[role]) if role in drive.held else rows[role]
        return smoothing.smoothed(row, wide, rate, order)[part]

    total = 1.0 / math.sqrt(1.0 / wide**2 + 1.0 / cutoff**2)  # of both kernels one after the other
    q, v, a, noise, speed_noise = _motion(rows, rate, wide, part, total)
    sources = {role: (role, 0) for role in rows if role not in ("q", "v", "a", "force")}
    if LOAD[0] in rows:
        sources |= {name: (LOAD[0], order) for order, name in enumerate(LOAD)}
    inputs = {name: through(*source) for name, source in sources.items()}
    input_noise = {
        name: smoothing.passed_noise(smoothing.density(rows[role], rate, wide), total, order)
        for name, (role, order) in sources.items()
    }
    density = smoothing.density(rows["force"], rate, wide)
    force = through("force")
    stated = record.noise if record.noise is not None else drive.noise
    assert not isinstance(stated, Mapping), "which the forward form alone has"
    # white noise of σ a sample has the density 2 σ²/rate
    own = smoothing.passed_noise(density if stated is None else 2.0 * stated**2 / rate, total)
    own = max(own, _LEAST_NOISE * float(np.sqrt(np.mean(force**2))))
    still = max(_AT_REST * speed_noise, 1e-3 * float(np.sqrt(np.mean(v**2))))
    t = (edge + inner * np.arange(len(force))) / rate
    u = _inputs(inputs)
    known = stated is not None
    return Track(record.name, step, t, q, v, a, u, force, cutoff, wide, every, own, noise, input_noise, still, known)


def _motion(
    rows: Mapping[str, np.ndarray], rate: float, wide: float, part: slice, total: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float, float], float]:
    """q, v and a, each as measured where it is, else differentiated from the one before (q: added up from v); their
    noise in the comparison; and that of v as the equations see it."""
    made, noise, of_speed = {}, {}, 0.0
    for order, role in enumerate(("q", "v", "a")):
        source = next((r for r in ("a", "v", "q")[2 - order :] if r in rows), None)
        if source is None:
            summed = np.concatenate([[0.0], np.cumsum(0.5 * (rows["v"][1:] + rows["v"][:-1]))]) / rate
            made[role], noise[role] = smoothing.smoothed(summed, wide, rate)[part], 0.0
            continue
        times = order - "qva".index(source)
        made[role] = smoothing.smoothed(rows[source], wide, rate, times)[part]
        found = smoothing.density(rows[source], rate, wide)
        noise[role] = smoothing.passed_noise(found, total, times)
        of_speed = smoothing.passed_noise(found, wide, times) if role == "v" else of_speed
    return made["q"], made["v"], made["a"], (noise["q"], noise["v"], noise["a"]), of_speed


def _inputs(rows: Mapping[str, np.ndarray]) -> Any:
    if not rows:
        return None
    if len(rows) == 1:
        return next(iter(rows.values()))
    return namedtuple("u", list(rows))(*rows.values())  # type: ignore[misc]
