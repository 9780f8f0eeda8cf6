"""Under what records were taken: what a classifier was trained for, and whether another record is of that kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from classifier.indexing import indexing_of
from indexer_env.errors import SignalError
from indexer_env.units import RPM
from indexer_records.conditions import RecordConditions
from indexer_records.quality import is_dead

TOLERANCE = {"sensor_radius": 0.01, "motor_speed": 0.02}
"""By which share a record's value may lie outside the range of the training records: densities grow with the square of
the radius, 2 % for 1 %; the speed may vary as a turn between two pulses may (`indexer_records.conditions.Pulse`)."""

CLIPPED = 0.005
"""Share of a turn [-] that may be clipped beyond what the training records are: each clipped peak is a step in the
acceleration, whose spectrum reaches over all features."""

CONSTANT = 0.05
"""Share of a turn [-] that may lie in one run of equal samples beyond what it does in the training records, less than
half of one of eight stations."""

STATIONS = 0.05
"""By which share the number of indexes in a turn may lie outside that of the training records: the speed may vary by
2 %, and the number is read to an eighth of an index."""

_FIRST = {1: ("acceleration", "deceleration"), -1: ("deceleration", "acceleration")}
"""What comes first in an index and what second, by sense."""

_WORDS = {
    "sensor_radius": ("the radius of the accelerometer", "m", "sensor_radius", 1.0),
    "motor_speed": ("the speed of the motor shaft", "rpm", "motor_speed_rpm", 1.0 / RPM),
}


@dataclass(frozen=True)
class Conditions:
    """What the training records have in common, as far as each of their rows states it.

    sensor_radius   least and greatest radius of the accelerometer [m]; None: not stated, or not on a radius
    motor_speed     least and greatest speed of the motor shaft [rad/s]; None: not stated
    machines        names of the machines; (): not stated
    clipped_share, constant_share  greatest of the calibration records [-], see `indexer_records.quality`
    stations        least and greatest number of indexes that a calibration record shows, see `classifier.indexing`;
                    None: not all of them show it
    sense           1: acceleration first in each index of all of them, −1: deceleration first, 0: not compared
    unshown_share   share of the calibration records that do not show the indexing [-]
    channel         which channel of a record these three are of: the first that shows it best
    """

    sensor_radius: tuple[float, float] | None = None
    motor_speed: tuple[float, float] | None = None
    machines: tuple[str, ...] = ()
    clipped_share: float = 0.0
    constant_share: float = 0.0
    stations: tuple[float, float] | None = None
    sense: int = 0
    unshown_share: float = 1.0
    channel: int = 0

    @classmethod
    def of_rows(cls, table: pa.Table, records: np.ndarray, subsets: np.ndarray) -> Conditions:
        """Conditions of the rows and records (n, samples) or (n, channels, samples) of a data set with these subsets
        (n,); what is for validation alone widens nothing."""
        calibration = subsets == "calibration"
        known = table.filter(pa.array(subsets != "validation"))
        names = known.column("machine_name")
        shares = {name: table.column(name).to_numpy()[calibration] for name in ("clipped_share", "constant_share")}
        return cls(
            sensor_radius=_range(known, "sensor_radius"),
            motor_speed=_range(known, "motor_speed"),
            machines=() if names.null_count else tuple(sorted(names.unique().to_pylist())),
            **{name: float(values.max(initial=0.0)) for name, values in shares.items()},
            **_indexing(records[calibration]),
        )

    def check(self, record: RecordConditions, name: str) -> None:
        """Refuse a record taken under other conditions, as far as they are known of both.

        Raises SignalError; also for an unknown radius where that of the training records is known, since the
        readings grow with it.
        """
        for field in _WORDS:
            trained, value = getattr(self, field), getattr(record, field)
            if trained is not None and value is not None and not _inside(value, trained, TOLERANCE[field]):
                raise _other(name, field, trained, value)
        if self.sensor_radius is not None and record.sensor_radius is None:
            raise SignalError(
                f"{name}: the radius of the accelerometer must be known as the model was trained at "
                f"{_written('sensor_radius', self.sensor_radius)}, got none; give known.sensor_radius=NUMBER in m."
            )
        if self.machines and record.machine is not None and record.machine not in self.machines:
            raise SignalError(
                f"{name}: the machine must be one that the model was trained on ({', '.join(self.machines)}), "
                f"got {record.machine!r}; train on records of it."
            )

    def not_compared(self, record: RecordConditions) -> tuple[str, ...]:
        """Keys of the conditions that are known of the training records but not of this one."""
        pairs = self._beside(record)
        del pairs["sensor_radius"]  # it must be known
        return tuple(key for key, (trained, value) in pairs.items() if trained is not None and value is None)

    def not_known(self, record: RecordConditions) -> tuple[str, ...]:
        """Keys of the conditions that are known of this record but not of all training records."""
        pairs = self._beside(record)
        return tuple(key for key, (trained, value) in pairs.items() if trained is None and value is not None)

    def _beside(self, record: RecordConditions) -> dict[str, tuple[Any, Any]]:
        """By key, what is known of the training records and of this one."""
        return {
            "motor_speed_rpm": (self.motor_speed, record.motor_speed),
            "machine": (self.machines or None, record.machine),
            "sensor_radius": (self.sensor_radius, record.sensor_radius),
        }

    def sensor_state(self, clipped_share: float, constant_share: float) -> str:
        """What the sensor of a turn with these shares [-] is: "dead", "clipped", or "" where nothing is wrong."""
        clipped = clipped_share > self.clipped_share + CLIPPED
        if is_dead(clipped_share if clipped else 0.0, constant_share, self.constant_share + CONSTANT):
            return "dead"
        return "clipped" if clipped else ""

    def flaw(self, clipped_share: float, constant_share: float) -> str:
        """The same in words; empty where nothing is wrong."""
        state = self.sensor_state(clipped_share, constant_share)
        if state == "dead":
            return f"must vary, got one value over {100 * constant_share:.3g} % of it; check the sensor and its cable"
        if state == "clipped":
            return (
                f"must stay within the sensor's range, got {100 * clipped_share:.3g} % clipped samples; "
                "lower the gain or use a sensor of a larger range"
            )
        return ""

    def indexing_flaw(self, record: np.ndarray) -> str:
        """In what a record (samples,) or (channels, samples) does not show the table's indexing as the training records
        do; empty where it does, and where they show none."""
        if self.stations is None:
            return ""
        found = indexing_of(np.atleast_2d(record)[self.channel])
        if not found.sense:
            return (
                "must show the indexing of the table as all records of the training do, got none; "
                "check that the table runs, the sensor and its cable"
            )
        if not _inside(found.stations, self.stations, STATIONS):
            low, high = (f"{value:.3g}" for value in self.stations)
            return (
                f"must hold {low if low == high else f'{low} to {high}'} indexes of the table within "
                f"{100 * STATIONS:g} % as in the training, got {found.stations:.3g}; check the speed and the turns"
            )
        if self.sense and found.sense != self.sense:
            first, second = _FIRST[self.sense]
            return (
                f"must begin each index with the {first} as in the training, got the {second} first: its sign is "
                "reversed; is the sensor mounted the other way round"
            )
        return ""

    def left_out(self) -> dict[str, str]:
        """What cannot be compared of any record, with the reason, by name."""
        if self.stations is None:
            share = f"{100 * self.unshown_share:.3g} % of the calibration records do not show the table's indexing"
            return {"indexing": f"not compared, {share}", "sign": f"cannot be told, {share}"}
        if not self.sense:
            return {"sign": "not compared, as it is not the same in all calibration records"}
        return {}

    def to_dict(self) -> dict[str, Any]:
        """Plain lists and numbers, from which `from_dict` makes equal conditions."""
        return {
            "sensor_radius": None if self.sensor_radius is None else list(self.sensor_radius),
            "motor_speed": None if self.motor_speed is None else list(self.motor_speed),
            "machines": list(self.machines),
            "clipped_share": self.clipped_share,
            "constant_share": self.constant_share,
            "stations": None if self.stations is None else list(self.stations),
            "sense": self.sense,
            "unshown_share": self.unshown_share,
            "channel": self.channel,
        }

    @classmethod
    def from_dict(cls, body: dict[str, Any]) -> Conditions:
        """Inverse of `to_dict`."""
        values: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in body.items()
        }
        return cls(**values)


def _indexing(records: np.ndarray) -> dict[str, Any]:
    """The fields of `Conditions` that calibration records (n, samples) or (n, channels, samples) show."""
    by_channel = [[indexing_of(one) for one in np.atleast_2d(record)] for record in records]
    unshown_by_channel = np.mean([[not one.sense for one in channels] for channels in by_channel], axis=0)
    channel = int(np.argmin(unshown_by_channel))
    unshown = float(unshown_by_channel[channel])
    if unshown > 0.0:
        return {"unshown_share": unshown, "channel": channel}
    found = [channels[channel] for channels in by_channel]
    senses, stations = {one.sense for one in found}, [one.stations for one in found]
    sense = senses.pop() if len(senses) == 1 else 0
    return {"stations": (min(stations), max(stations)), "sense": sense, "unshown_share": 0.0, "channel": channel}


def _range(table: pa.Table, name: str) -> tuple[float, float] | None:
    column = table.column(name)
    if column.null_count:
        return None
    values = column.to_numpy()
    return float(values.min()), float(values.max())


def _inside(value: float, trained: tuple[float, float], tolerance: float) -> bool:
    return trained[0] * (1 - tolerance) <= value <= trained[1] * (1 + tolerance)


def _written(field: str, values: tuple[float, float]) -> str:
    _, unit, _, factor = _WORDS[field]
    low, high = (f"{factor * value:.6g}" for value in values)
    return f"{low} {unit}" if low == high else f"{low} to {high} {unit}"


def _other(name: str, field: str, trained: tuple[float, float], value: float) -> SignalError:
    words, unit, key, factor = _WORDS[field]
    return SignalError(
        f"{name}: {words} must be {_written(field, trained)} within {100 * TOLERANCE[field]:g} % as in the records the "
        f"model was trained on, got {factor * value:.6g} {unit}; correct known.{key} or train on such records."
    )
