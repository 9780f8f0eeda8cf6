"""A turn of the table as the networks see it: what it differs by from the healthy machine, cell by cell of the cam.

    x = (y − ŷ(speed, load) − R(speed, load)) / σ(speed, load)      (stations, cells)

y and ŷ are means over cells of the cam angle, measured and simulated at the twin's mean; R is what healthy records left
after calibration, σ the noise of a cell (`remains`). How far the turn was shifted in its angle at the beginning and at
the end is a nuisance of known size (the pulse's accuracy) and taken out as far as that prior lets it be (ridge).
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env import Machine, OperatingPoint, Run, Sensor, SignalError, simulate, simulate_batch
from indexer_env.units import RPM

_TURN = 2.0 * math.pi

MOST_CELLS = 256
"""Cells of a cam turn: 120 Hz at 1 s a cam turn, five times the machine's modes."""

LEAST_CELLS = 64

_SHORT = 2
"""Samples that a turn may be short of: its length in samples is rounded."""

_LEAD = 11
"""Cam turns simulated before a turn. Three are nine time constants of the reference machine's slowest mode, but where
play lets the cam rattle from turn to turn, its steady motion comes later: at 1300 rpm and 2 N m eight healthy turns of
15 raised an alarm with three, as what is simulated was not steady yet."""

_SAME_SPEED = 1e-6
"""Relative steps of speed in which healthy turns are kept for the next turn at the same point [-]."""

PASSING = ("sensor.mains_hum", "sensor.offset_drift")
"""Effects of the sensor that do not repeat from turn to turn."""


@dataclass(frozen=True)
class Cells:
    """The division of a turn.

    Attributes
    ----------
    stations, count : int
        Cam turns of a table turn, cells of a cam turn.
    rate : float
        Sampling rate of the records [Hz], but for what their clocks are off.
    """

    stations: int
    count: int
    rate: float

    @classmethod
    def of(cls, machine: Machine, rate: float, fastest: float) -> Cells:
        """As many cells as the records fill at the fastest motor speed [rad/s]."""
        samples = rate * machine.turn_duration(OperatingPoint(fastest)) / machine.stations
        count = 2 ** min(int(math.log2(MOST_CELLS)), int(math.log2(max(1.0, samples / 2.0))))
        if count < LEAST_CELLS:
            raise SignalError(
                f"The records must hold {2 * LEAST_CELLS} samples or more a cam turn, got {samples:.0f} at "
                f"{fastest / RPM:.4g} rpm; record with a higher rate."
            )
        return cls(machine.stations, count, rate)

    def turns(self, values: np.ndarray, cam_rate: float, start: float, rate: float | None = None) -> np.ndarray:
        """Whole turns (k, stations, cells) of a record (n,) whose cam turns at `cam_rate` [rad/s] from `start` [rad]
        and which was sampled at `rate` [Hz], None: that of the cells; cells count from cam angle 0 at station 0, a turn
        is read in a circle."""
        whole, width, step = self.stations * self.count, _TURN / self.count, cam_rate / (rate or self.rate)
        angle = start + step * np.arange(len(values))
        if angle[-1] + _SHORT * step - start >= whole * width:
            # a turn that ends within a cell is completed by what the turn before began with
            more = angle[-1] + step * np.arange(1, math.ceil(width / step) + _SHORT + 1)
            values = np.concatenate([values, np.interp(more - whole * width, angle, values)])
            angle = np.concatenate([angle, more])
        first = math.ceil(start / width - 1e-9)
        number = int((angle[-1] / width - first + 1e-9) // whole)
        edges = (first + np.arange(number * whole + 1)) * width
        summed = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1])) * step])
        cells = np.diff(np.interp(edges, angle, summed)) / width
        return np.roll(cells.reshape(number, whole), first % whole, axis=1).reshape(number, self.stations, self.count)

    def along(self, turn: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """A turn (stations, cells) at cam angles (n,) [rad]: straight between the middles of cells, in a circle."""
        whole = self.stations * self.count
        return np.interp(angle * self.count / _TURN - 0.5, np.arange(whole), turn.ravel(), period=whole)


@dataclass(frozen=True, eq=False)
class Healthy:
    """The healthy machine's turns at any operating point, read by its `quiet` sensor; loads are `load_factor` times
    what is stated."""

    machine: Machine
    sensor: Sensor
    cells: Cells
    load_factor: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensor", quiet(self.sensor))
        object.__setattr__(self, "at", functools.lru_cache(maxsize=256)(self._at))

    def turn(self, point: OperatingPoint) -> np.ndarray:
        """ŷ (stations, cells) in the sensor's unit."""
        digits = -round(math.log10(_SAME_SPEED))
        exponent = math.floor(math.log10(point.motor_speed))
        return self.at(round(point.motor_speed, digits - exponent), float(point.load_torque))  # type: ignore[attr-defined]

    def _at(self, speed: float, load: float) -> np.ndarray:
        point, run = lead_in(self.machine, self.cells, speed, self.load_factor * load)
        record = self.sensor.read(simulate(self.machine, point, run).table_acceleration, self.cells.rate).values
        return behind_lead_in(self.machine, self.cells, record, speed)

    def turns(self, points: Sequence[OperatingPoint]) -> np.ndarray:
        """ŷ (n, stations, cells) of many points at once."""
        factor = self.load_factor
        leads = [lead_in(self.machine, self.cells, p.motor_speed, factor * p.load_torque) for p in points]
        longest = max((run for _, run in leads), key=lambda run: run.samples or 0)
        batch = simulate_batch([self.machine] * len(points), [point for point, _ in leads], longest)
        if batch.rejected:
            raise SignalError(
                f"The twin's machine must run at every operating point, but {min(batch.rejected.values())}"
            )
        records = self.sensor.read_batch(batch.channels["table_acceleration"], self.cells.rate)
        return np.array([
            behind_lead_in(self.machine, self.cells, record, p.motor_speed)
            for record, p in zip(records, points, strict=True)
        ])  # fmt: skip


def quiet(sensor: Sensor) -> Sensor:
    """A sensor without what does not repeat from turn to turn: noise, hum, drift, and the steps and ends of its range.
    Of these a twin learns from the records themselves."""
    return dataclasses.replace(
        sensor, noise_snr_db=None, noise_density=0.0, full_scale=None, bits=None, hum_amplitude=0.0, offset_drift=0.0
    )


def lead_in(machine: Machine, cells: Cells, speed: float, load: float) -> tuple[OperatingPoint, Run]:
    """What is simulated for a turn: from some cam turns before it, in which machine and filters forget their start."""
    duration = machine.turn_duration(OperatingPoint(speed)) * (cells.stations + _LEAD) / cells.stations
    samples = math.ceil(duration * cells.rate) + _SHORT
    return OperatingPoint(speed, load, -_LEAD * _TURN), Run(cells.rate, samples, warmup_turns=0)


def behind_lead_in(machine: Machine, cells: Cells, record: np.ndarray, speed: float) -> np.ndarray:
    """The turn (stations, cells) behind the cam turns that lead in."""
    cam_rate, start = machine.reduction * speed, -_LEAD * _TURN
    first = math.floor(-start / cam_rate * cells.rate)
    return cells.turns(record[first:], cam_rate, start + cam_rate * first / cells.rate)[0]


def in_phase(reference: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """The reference (stations, cells) with what its stations differ by begun at that one where it is nearest to a turn.

    Where the cam rattles in its play the steady motion may take several cam turns for one period (a subharmonic), and
    nothing tells at which station that period begins."""
    common = reference.mean(axis=0)
    own = reference - common
    return common + np.roll(own, likeliest_station(own[None], turn - common), axis=0)


def likeliest_station(turns: np.ndarray, template: np.ndarray) -> int:
    """Stations by which turns (k, stations, cells) of unknown stations must be rolled on to leave least of a template
    (stations, cells)."""
    mean = turns.mean(axis=0)
    left = [float(((np.roll(mean, by, axis=0) - template) ** 2).sum()) for by in range(len(mean))]
    return int(np.argmin(left))


def shift_shapes(turn: np.ndarray, shift: float) -> np.ndarray:
    """What one standard deviation of a shift [rad] adds to turns (..., stations, cells): of the whole turn, and growing
    from station 0 on. In a record that begins at another station it grows from there: the same but for a step, which
    is left. Linear in the turns. Shape (..., 2, stations, cells)."""
    before, own = turn.shape[:-2], turn.shape[-2:]
    flat = turn.reshape(*before, -1)
    width = _TURN / own[1]
    slope = (np.roll(flat, -1, axis=-1) - np.roll(flat, 1, axis=-1)) / (2.0 * width)
    along = np.linspace(-0.5, 0.5, flat.shape[-1])
    shapes = np.stack([slope * shift, slope * along * math.sqrt(2.0) * shift], axis=-2)
    return shapes.reshape(*before, 2, *own)


def without_shift(left: np.ndarray, shapes: np.ndarray, noise: float) -> np.ndarray:
    """A turn (stations, cells) with the shift taken out that its prior and the noise of a cell make most likely."""
    D = (shapes / max(noise, 1e-12)).reshape(2, -1)
    share = np.linalg.solve(D @ D.T + np.eye(2), D @ (left.ravel() / max(noise, 1e-12)))
    return left - np.tensordot(share, shapes, 1)
