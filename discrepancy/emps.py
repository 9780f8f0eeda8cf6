"""The EMPS drive: a motor and ball screw that move a slide, measured; the second model the workflow is proved on.

    M q̈ + (effects) = g_τ · v        q position [m], v control voltage [V], g_τ drive gain [N/V]

The motion is the input and the force the output, so a window has no unknown start state. Data: Janot, Gautier and
Brunot, Data set and reference models of EMPS (2019), nonlinearbenchmark.org.
"""

from __future__ import annotations

import copy
import functools
import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from discrepancy.model import Hypothesis, Jobs, Model, Parameter

DECIMATION, _CUTOFF = 10, 60.0
"""One of ten samples is kept; the position is low-passed at 60 Hz before it is differentiated twice, far above the
closed loop's band and far below the rate at which differences amplify the encoder's steps."""

MARGIN = 30
"""Samples, after decimation, left out at each end: the filters' transients."""

_WINDOWS = 8
_SMOOTHING = 1e-3
"""m/s; the speed at which 71 % of a dry friction acts, far below the drive's 0.1 m/s."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The measured motion as the effects see it: arrays (n,) of position [m], rate [m/s], acceleration [m/s²], at the
    interval `step` [s], and the share `sign` of a dry friction that acts, in ±1."""

    position: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    step: float

    @property
    def sign(self) -> np.ndarray:
        s = self.rate / _SMOOTHING
        return s / np.sqrt(1.0 + s * s)


Force = Callable[[Motion, float, Mapping[str, float]], np.ndarray]


@dataclass(frozen=True)
class DriveEffect:
    """One effect of the drive: its parameters, where a fit may begin, and the force it adds [N], given the motion, the
    mass [kg] and its parameters."""

    name: str
    parameters: tuple[Parameter, ...]
    starts: tuple[tuple[float, ...], ...]
    force: Force


def _load_acceleration(motion: Motion, inverse_square: float, damping: float = 0.05) -> np.ndarray:
    """Acceleration of a load on a spring, 1/ω² = inverse_square [s²], driven by the motor's."""
    from indexer_env.filters import bracket_sections, filtered

    frequency = 1.0 / (2.0 * math.pi * math.sqrt(inverse_square))
    sections = bracket_sections(frequency, damping, 1.0 / motion.step)
    return filtered(sections, motion.acceleration[None])[0]


def _elastic(motion: Motion, mass: float, p: Mapping[str, float]) -> np.ndarray:
    if p["inverse_square"] <= _STIFFEST:
        return np.zeros_like(motion.rate)
    return 0.5 * mass * (_load_acceleration(motion, p["inverse_square"]) - motion.acceleration)


def _delayed(motion: Motion, mass: float, p: Mapping[str, float]) -> np.ndarray:
    """What a drive whose force comes late must ask for ahead of time, of the inertial force."""
    ahead = np.interp(
        np.arange(len(motion.rate)) + p["delay"] / motion.step, np.arange(len(motion.rate)), motion.acceleration
    )
    return mass * (ahead - motion.acceleration)


def _backlash(motion: Motion, mass: float, p: Mapping[str, float]) -> np.ndarray:
    """Half of the mass is not felt while the play is crossed after a reversal."""
    travelled = np.zeros_like(motion.rate)
    for k in range(1, len(travelled)):
        moved = motion.position[k] - motion.position[k - 1]
        travelled[k] = min(max(travelled[k - 1] + moved, -p["backlash"] / 2.0), p["backlash"] / 2.0)
    # smooth across 5 % of the play, so that a fit sees which way to go
    free = np.clip((p["backlash"] / 2.0 - np.abs(travelled)) / (0.05 * p["backlash"] + 1e-12), 0.0, 1.0)
    return -0.5 * mass * motion.acceleration * free


_STIFFEST = 1.0 / (2.0 * math.pi * 100.0) ** 2
"""s²; a coupling above 100 Hz lies beyond what is left of the motion."""

_UP = (3.0, 10.0, 30.0)


def _parameter(effect: str, name: str, unit: str, start: float, scale: float, low: float, high: float) -> Parameter:
    return Parameter(f"{effect}.{name}", unit, start, scale, low, high)


def _effect(
    name: str, rows: list[tuple[str, str, float, float, float, float, tuple[float, ...]]], force: Force
) -> DriveEffect:
    parameters = tuple(_parameter(name, *row[:6]) for row in rows)
    return DriveEffect(name, parameters, tuple(itertools.product(*(row[6] for row in rows))), force)


EFFECTS = {
    effect.name: effect
    for effect in (
        _effect(
            "friction.viscous",
            [("coefficient", "N s/m", 0.0, 50.0, 0.0, 5e3, (50.0, 150.0, 450.0))],
            lambda m, _, p: p["coefficient"] * m.rate,
        ),
        _effect(
            "friction.coulomb",
            [("force", "N", 0.0, 5.0, 0.0, 200.0, _UP)],
            lambda m, _, p: p["force"] * m.sign,
        ),
        _effect(
            "friction.asymmetric",
            [("force", "N", 0.0, 5.0, -100.0, 100.0, (*_UP, -3.0, -10.0))],
            lambda m, _, p: p["force"] * np.maximum(m.sign, 0.0),
        ),
        _effect(
            "friction.stribeck",
            [
                ("force", "N", 0.0, 5.0, 0.0, 200.0, _UP),
                ("speed", "m/s", 0.02, 0.01, 0.002, 0.04, (0.005, 0.015, 0.03)),
            ],
            lambda m, _, p: p["force"] * m.sign / (1.0 + (m.rate / p["speed"]) ** 2),
        ),
        _effect(
            "offset",
            [("force", "N", 0.0, 1.0, -50.0, 50.0, (3.0, -3.0))],
            lambda m, _, p: np.full_like(m.rate, p["force"]),
        ),
        _effect(
            "elastic_coupling",
            [("inverse_square", "s²", _STIFFEST, 1e-5, _STIFFEST, 2.5e-3, (1e-5, 1e-4, 5e-4))],
            _elastic,
        ),
        _effect("delay", [("delay", "s", 0.0, 1e-3, 0.0, 0.05, (1e-3, 5e-3, 2e-2))], _delayed),
        _effect("backlash", [("backlash", "m", 0.0, 1e-4, 0.0, 0.01, (1e-4, 5e-4, 2e-3))], _backlash),
        _effect(
            "cogging",
            [
                ("force", "N", 0.0, 1.0, 0.0, 50.0, (1.0, 4.0)),
                ("pitch", "m", 0.01, 1e-4, 0.002, 0.05, (0.005, 0.01, 0.02)),
                ("phase", "rad", 0.0, 0.5, -10.0, 10.0, (0.0, 1.6, 3.1, 4.7)),
            ],
            lambda m, _, p: p["force"] * np.sin(2.0 * math.pi * m.position / p["pitch"] + p["phase"]),
        ),
    )
}


class EmpsModel(Model):
    """The drive with its mass and the effects it is already known to have.

    Parameters
    ----------
    motion : Motion
    force : ndarray (n,)
        Measured force g_τ·v [N] at the same instants.
    noise : float
        Standard deviation of what does not repeat in the force [N].
    known : tuple of str
        Effects of `EFFECTS` that belong to the base model.
    """

    def __init__(self, motion: Motion, force: np.ndarray, noise: float, known: tuple[str, ...] = ()) -> None:
        self.motion, self.force, self.noise, self.known = motion, force, noise, known
        self._measured = thinned(force)
        mass = Parameter("mass", "kg", 100.0, 0.2, 50.0, 200.0, known=True, logarithmic=True)
        self.parameters = (mass, *(p for name in known for p in EFFECTS[name].parameters))
        edges = np.linspace(0, len(self._measured), _WINDOWS + 1).astype(int)
        self._first, self.counts = edges[:-1], np.diff(edges)
        self.groups = np.zeros(_WINDOWS, dtype=np.int64)

    def extended(self, hypothesis: Hypothesis) -> EmpsModel:
        return EmpsModel(self.motion, self.force, self.noise, (*self.known, hypothesis.name))

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        missing = [effect for effect in EFFECTS.values() if effect.name not in self.known]
        return {e.name: (Hypothesis(e.name, e.parameters, {}, e.starts),) for e in missing}

    def predicted(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        """Force [N] at a global point, thinned as the measured one is."""
        parameters = self.parameters + hypothesis.parameters
        values = {p.name: p.value(z) for p, z in zip(parameters, point, strict=True)}
        total = values["mass"] * self.motion.acceleration
        names = self.known if hypothesis.name == "none" else (*self.known, hypothesis.name)
        for name in names:
            own = {key.removeprefix(f"{name}."): v for key, v in values.items() if key.startswith(f"{name}.")}
            total = total + EFFECTS[name].force(self.motion, values["mass"], own)
        return thinned(total)

    def relative_error(self, hypothesis: Hypothesis, point: np.ndarray) -> float:
        """‖predicted - measured‖/‖measured‖ of the force."""
        left = self.predicted(hypothesis, point) - self._measured
        return float(np.linalg.norm(left) / np.linalg.norm(self._measured))

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        out = np.zeros((len(jobs.point), int(self.counts.max())))
        for p, point in enumerate(jobs.points):
            residual = (self.predicted(hypothesis, point) - self._measured) / self.noise
            for job in np.flatnonzero(jobs.point == p):
                window = jobs.window[job]
                first, count = self._first[window], self.counts[window]
                out[job, :count] = residual[first : first + count]
        return out

    def recording(self, readings: np.ndarray) -> EmpsModel:
        other = copy.copy(self)
        rows = [row[:count] for row, count in zip(readings, self.counts, strict=True)]
        other._measured = np.concatenate(rows) * self.noise
        return other

    def features(self) -> np.ndarray:
        """Powers of position, rate and acceleration up to the third."""
        columns = []
        for x in (self.motion.position, self.motion.rate, self.motion.acceleration):
            scaled = x / np.abs(x).max()
            columns += [thinned(scaled**power) for power in (1, 2, 3)]
        columns.append(np.ones_like(columns[0]))
        table = np.zeros((_WINDOWS, int(self.counts.max()), len(columns)))
        for w, (first, count) in enumerate(zip(self._first, self.counts, strict=True)):
            table[w, :count] = np.stack(columns, axis=1)[first : first + count]
        return table

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 0

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.zeros((0, 0))


def thinned(row: np.ndarray) -> np.ndarray:
    """A row (n,) at a tenth of its rate, without phase shift, its ends left out."""
    import scipy.signal

    return scipy.signal.sosfiltfilt(_antialias(), row)[::DECIMATION][MARGIN:-MARGIN]


@functools.cache
def _antialias() -> np.ndarray:
    """The filter of `scipy.signal.decimate`, designed once."""
    import scipy.signal

    return np.asarray(scipy.signal.cheby1(8, 0.05, 0.8 / DECIMATION, output="sos"))


def load_emps(path: Path) -> tuple[EmpsModel, EmpsModel]:
    """The measured drive, inertia only: its first cycle to fit, its second one to hold out.

    The reference motion repeats; what differs between the cycles' forces is the noise.
    """
    import scipy.io
    import scipy.signal

    data = scipy.io.loadmat(path)
    for name in ("t", "qm", "qg", "vir", "gtau"):
        if not np.isfinite(data[name]).all():
            raise ValueError(f"its {name} is not finite throughout")
    step = float(data["t"][1, 0] - data["t"][0, 0])
    force = float(data["gtau"][0, 0]) * data["vir"].ravel()
    low = scipy.signal.butter(4, _CUTOFF, fs=1.0 / step, output="sos")
    position = scipy.signal.sosfiltfilt(low, data["qm"].ravel())
    rate = np.gradient(position, step)
    rows = [position, rate, np.gradient(rate, step)]
    noise = _unrepeated(thinned(data["qg"].ravel()), thinned(force))
    half = len(force) // 2
    spans = slice(0, half), slice(half, None)
    return tuple(EmpsModel(Motion(*(row[span] for row in rows), step), force[span], noise) for span in spans)  # type: ignore[return-value]


def _unrepeated(reference: np.ndarray, force: np.ndarray) -> float:
    """Standard deviation [N] of what differs between repeats of the same reference motion."""
    least = len(reference) // 4
    shifts = range(least, len(reference) - least)
    best = min(shifts, key=lambda k: float(np.abs(reference[k:] - reference[:-k]).mean()))
    return float(np.std(force[best:] - force[:-best])) / math.sqrt(2.0)
