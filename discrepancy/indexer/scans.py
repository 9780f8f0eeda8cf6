"""Forms that have to be looked for: lines of a fixed frequency, resonances, bursts that ring."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from scipy.signal import cont2discrete, lfilter

from discrepancy.indexer.causes import forms_of, spread
from discrepancy.indexer.model import IndexerModel
from discrepancy.indexer.setting import Setting, residual_at, setting_of
from discrepancy.origin import MARGIN, Form, Origin, Residue, likeliest, origin_of
from discrepancy.place import Point
from indexer_env.effects.joint import BaseLooseness
from indexer_env.machine import Machine

_LOW, _HIGH = 5.0, 60.0
"""Hz between which lines are looked for: below, a line is no line over a record; above, a table hardly moves."""

_FINE = 0.25
"""Step of the frequencies, in widths 1/T of a record."""

_COARSE = 4.0
"""Hz between frequencies at which it is computed how much of a line a joint passes on."""

_TAKEN = 2
"""Lines of each joint that are looked at."""

_RESONANCES = np.geomspace(4.0, 90.0, 32)
_DAMPINGS = (0.03, 0.1)
"""Resonances [Hz] and damping ratios."""

_BURSTS = np.geomspace(8.0, 90.0, 24)
_MOST = 12
"""Bursts that are looked at, in all records."""

_OWN = 0.1
"""ln of a frequency over the table's own up to which the two are one: frequencies are looked at that far apart."""

_LAW, _KEPT = 0.7, 0.5
"""Share of a free function's evidence that an effect must have, or else share of its own evidence that must be left
beside that function, which also takes up what else there is: of 110 right names in 160 messy cases 108 have 0.84 of the
first or more, one 0.76, and one 2 of the second. Of 19 effects that stood in for something else 11 have 0.06 to 0.62 of
the first."""

_BUMPS, _OF_A_BUMP, _ELSEWHERE = ("cam.profile_error", "load.process"), 0.9, 1.05
"""Effects that are a bump over the cam's phase, which what follows that phase is likely to look like, and the same
share for them, and where the function is at another joint: true ones on a machine without play, on which two joints
look alike, have 1.055 to 1.12; of five that stood in for something else four have 1.03 at most."""

_TURN = 2.0 * math.pi


def origin_at(model: IndexerModel, place: Point) -> Origin | None:
    """Where what a fitted place leaves comes from; None where no cause is more likely than none."""
    setting = setting_of(model, place)
    residue = Residue(setting.laid)
    forms, free = forms_of(setting, residue)
    return origin_of(residue, forms, Scan(setting, residue), free)


def elsewhere_at(model: IndexerModel, place: Point, without: Point, effect: str) -> str:
    """In words, the most likely cause of what a place without an effect leaves; "" where none is likely, or what the
    place with the effect changes, taken for one more cause, has `_LAW` of its evidence, as a true law has fewer numbers
    to pay for than a free function, or keeps `_KEPT` of its own evidence beside it, as the cause is then another one. A
    bump needs more, `_OF_A_BUMP`, or `_ELSEWHERE`."""
    setting = setting_of(model, without)
    residue = Residue(setting.laid)
    found = likeliest(residue, forms_of(setting, residue)[0])
    if found is None:
        return ""
    change = residue.clean((setting.laid.residual - residual_at(model, place, setting.laid.inside))[..., None])
    (law, _), (free, scale) = (residue.evidence(columns) for columns in (change, found.columns))
    if effect in _BUMPS:
        least = _OF_A_BUMP if (found.joint, found.kind) == ("output", "phase") else _ELSEWHERE
        return "" if law >= least * free else found.name
    beside = residue.without(found.columns, scale)
    left = beside.evidence(change)[0]
    return "" if law >= _LAW * free or left >= max(_KEPT * law, MARGIN) else found.name


class Scan:
    """The scans of one setting; called with what is left, they give forms.

    Parameters
    ----------
    setting : Setting
    residue : Residue
        Of that setting.
    """

    def __init__(self, setting: Setting, residue: Residue) -> None:
        self.setting, self.laid = setting, setting.laid
        self._records = np.unique(self.laid.groups)
        self._spans = [float(np.ptp(self.laid.time[self.laid.groups == g])) for g in self._records]
        self._passed = {joint: self._energies(joint, residue) for joint in ("table", "cam", "sensor")}
        self._resonances = self._resonant(residue)

    def __call__(self, residue: Residue) -> list[Form]:
        """Lines and bursts that stand in what is left, and all resonances."""
        before = residue.before()
        found = [form for joint in self._passed for form in self._lines(joint, before, residue)]
        return [*found, *self._resonances, *self._bursts(before, residue)]

    # ---- lines
    def _waves(self, frequencies: np.ndarray, joint: str) -> np.ndarray:
        """What lines add to the readings (w, n, 2 k): cosines, then sines."""
        angle = _TURN * self.laid.time[..., None] * frequencies
        waves = np.concatenate([np.cos(angle), np.sin(angle)], axis=2)
        if joint == "sensor":
            return waves
        if joint == "cam":
            # a drive's torque comes from its current, which grows with its speed
            waves = waves * self.setting.rate[..., None] ** 2
        return self.setting.readings(waves, joint)

    def _energies(self, joint: str, residue: Residue) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies (k,) and the energy (records, k) of a line of size 1."""
        frequencies = np.arange(_LOW, _HIGH + _COARSE, _COARSE)
        columns = residue.clean(self._waves(frequencies, joint))[: self.laid.inside.size]
        power = (columns.reshape(*self.laid.inside.shape, -1) ** 2).sum(axis=1)
        power = 0.5 * (power[:, : len(frequencies)] + power[:, len(frequencies) :])
        return frequencies, np.stack([power[self.laid.groups == g].sum(axis=0) for g in self._records])

    def _lines(self, joint: str, before: np.ndarray, residue: Residue) -> list[Form]:
        pulled = before if joint == "sensor" else self.setting.pulled(before, joint)
        if joint == "cam":
            pulled = pulled * self.setting.rate**2
        high = min(_HIGH, 0.4 / float(self.laid.step.max()))
        frequencies = np.arange(_LOW, high, _FINE / max(self._spans))
        won = np.zeros(len(frequencies))
        coarse, energies = self._passed[joint]
        for g, energy in zip(self._records, energies, strict=True):
            mine = self.laid.groups == g
            inside = self.laid.inside[mine]
            power = _spectrum(pulled[mine][inside], self.laid.time[mine][inside], frequencies)
            won += power / np.interp(frequencies, coarse, np.maximum(energy, 1e-300))
        taken = []
        for _ in range(_TAKEN):
            taken.append(float(frequencies[int(won.argmax())]))
            won[np.abs(frequencies - taken[-1]) < 2.0 / max(self._spans)] = 0.0
        waves = self._waves(np.array(taken), joint)
        by_record = (self.laid.groups[:, None] == self._records).astype(float)
        where, name = {
            "table": ("output", "a torque on the table"), "cam": ("input", "a torque on the cam shaft"),
            "sensor": ("sensor", "a line of the sensor"),
        }[joint]  # fmt: skip
        forms, price = [], math.log(len(frequencies))
        for k, frequency in enumerate(taken):
            columns = residue.clean(spread(waves[..., k::_TAKEN], by_record))
            forms.append(Form(where, "frequency", f"{name} at {frequency:.3g} Hz", columns, price))
        return forms

    # ---- resonances
    def _resonant(self, residue: Residue) -> list[Form]:
        """Something that swings at a frequency of its own: on the table, beside the sensor, and under the machine."""
        acceleration = self.setting.motion["table_acc"]
        angle = self.setting.motion["table"]
        price = math.log(len(_RESONANCES) * len(_DAMPINGS))
        high = 0.4 / float(self.laid.step.max())
        pairs = [(f, d) for f in _RESONANCES if f < high for d in _DAMPINGS]
        swung = [[self._swinging(acceleration, *pair, numerator) for numerator in (0, 1, 2)] for pair in pairs]
        torques = np.concatenate([np.stack(each[1:], axis=2) for each in swung], axis=2)
        on_table = self.setting.readings(torques, "table")
        forms = []
        for k, ((f, _), each) in enumerate(zip(pairs, swung, strict=True)):
            beside = self.setting.read(np.stack(each[1:], axis=2))
            tilting = self.setting.read(np.stack([each[0] * np.cos(angle), each[0] * np.sin(angle)], 2))
            forms += [
                Form("output", "frequency", f"something that swings at {f:.2g} Hz on the table",
                     residue.clean(on_table[:, :, 2 * k : 2 * k + 2]), price),
                Form("sensor", "frequency", f"a resonance of the sensor's mounting or cable at {f:.2g} Hz",
                     residue.clean(beside), price),
                Form("base", "station", f"a base that rocks at {f:.2g} Hz and tilts the sensor",
                     residue.clean(tilting), price),
            ]  # fmt: skip
        return forms

    def _swinging(self, row: np.ndarray, frequency: float, damping: float, derivative: int) -> np.ndarray:
        """s^d ω^(2-d)/(s² + 2ζω s + ω²) of a row (w, n), each record at rest before it."""
        out = np.zeros_like(row)
        for g in self._records:
            mine = self.laid.groups == g
            filtered_by = _resonator(frequency, damping, derivative, float(self.laid.step[mine][0]))
            part, inside = np.zeros(self.laid.inside[mine].shape), self.laid.inside[mine]
            part[inside] = lfilter(*filtered_by, row[mine][inside])
            out[mine] = part
        return out

    # ---- bursts
    def _bursts(self, before: np.ndarray, residue: Residue) -> list[Form]:
        """Blows: what rings at one frequency after some moments, and falls asleep. As the table rings by itself it is
        the table that was hit."""
        best: tuple[float, list[tuple[int, int]], float, float] = (0.0, [], 0.0, 0.0)
        moments = math.log(float(self.laid.inside.sum()))
        high = 0.4 / float(self.laid.step.max())
        for f in _BURSTS[high > _BURSTS]:
            for damping in _DAMPINGS:
                won, at = self._rung(before, residue, f, damping, moments)
                if won > best[0]:
                    best = (won, at, float(f), damping)
        won, at, f, damping = best
        if not at:
            return []
        price = len(at) * moments + math.log(len(_BURSTS) * len(_DAMPINGS))
        columns = np.zeros((*self.laid.inside.shape, 2 * len(at)))
        for k, (record, moment) in enumerate(at):
            mine = self.laid.groups == self._records[record]
            inside, step = self.laid.inside[mine], float(self.laid.step[mine][0])
            later = np.arange(int(inside.sum())) - moment
            angle = _TURN * f * step * np.maximum(later, 0)
            fading = np.where(later >= 0, np.exp(-damping * angle), 0.0)
            part = np.zeros((*inside.shape, 2))
            part[inside] = np.stack([fading * np.cos(angle), fading * np.sin(angle)], axis=1)
            columns[mine, :, 2 * k : 2 * k + 2] = part
        own = _own_frequency(self.setting.machine)
        where, hit = ("output", "table") if abs(math.log(f / own)) < _OWN else ("base", "base")
        return [Form(where, "time", f"blows to the {hit}, which rings at {f:.2g} Hz", residue.clean(columns), price)]

    def _rung(
        self, before: np.ndarray, residue: Residue, frequency: float, damping: float, moments: float
    ) -> tuple[float, list[tuple[int, int]]]:
        """What bursts of one frequency win, and their record and sample."""
        found: list[tuple[float, int, int]] = []
        for record, g in enumerate(self._records):
            mine = self.laid.groups == g
            inside, step = self.laid.inside[mine], float(self.laid.step[mine][0])
            series = before[mine][inside]
            pole = np.exp((1j - damping) * _TURN * frequency * step)
            pulled = lfilter([1.0], [1.0, -pole], series[::-1])[::-1]
            # energy of a whitened burst, half of which the cosine has and half the sine
            ringing = pole ** np.arange(math.ceil(5.0 / (damping * _TURN * frequency * step)))
            ringing = np.append(ringing, 0.0) - residue.colour * np.append(0.0, ringing)
            energy = 0.5 * float((np.abs(ringing) ** 2).sum())
            won = 0.5 * np.abs(pulled) ** 2 / energy / max(residue.variance, 1e-300)
            apart = max(1, round(1.0 / (damping * _TURN * frequency * step)))
            for _ in range(_MOST):
                best = int(won.argmax())
                if won[best] < moments + 2.0:
                    break
                found.append((float(won[best]) - moments, record, best))
                won[max(0, best - apart) : best + apart] = 0.0
        found = sorted(found, reverse=True)[:_MOST]
        return sum(won for won, _, _ in found), [(record, moment) for _, record, moment in found]


def _own_frequency(machine: Machine) -> float:
    """That of the table on the output joint, and on a loose base in series [Hz]."""
    loose = [effect.compliance for effect in machine.effects if isinstance(effect, BaseLooseness)]
    return 1.0 / (_TURN * math.sqrt(machine.table_inertia * (1.0 / machine.output_joint.stiffness + sum(loose))))


@functools.lru_cache(maxsize=1024)
def _resonator(frequency: float, damping: float, derivative: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of the filter of `Scan._swinging` for samples of this step [s], linear in between."""
    omega = _TURN * frequency
    numerator = [omega ** (2 - derivative), *[0.0] * derivative]
    found: Any = cont2discrete((numerator, [1.0, 2.0 * damping * omega, omega**2]), step, "foh")
    return np.ravel(found[0]), found[1]


def _spectrum(row: np.ndarray, time: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """|Σ row e^{-iωt}|² (k,) of moments that are nearly even."""
    step = float(np.median(np.diff(time))) / 4.0
    count = round(float(time[-1] - time[0]) / step) + 1
    size = 1 << (4 * count - 1).bit_length()
    even = np.zeros(count)
    np.add.at(even, np.rint((time - time[0]) / step).astype(int), row)
    power = np.abs(np.fft.rfft(even, size)) ** 2
    return np.interp(frequencies, np.fft.rfftfreq(size, step), power)
