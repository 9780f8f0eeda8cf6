"""A twin as it lies in its folder: load it, ask it of a turn, ask physics."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import yaml
from safetensors.numpy import load_file
from safetensors.torch import load_file as load_weights
from torch import nn

from discrepancy.records.conditions import Conditions
from discrepancy.records.matching import matched
from discrepancy.records.reading import Record
from indexer_env import Machine, OperatingPoint, Sensor, Signal, SignalError, load_machine
from indexer_env.build import from_mapping
from indexer_env.errors import ParameterError
from indexer_env.units import RPM
from indexer_records.quality import quality_columns
from twin import physics
from twin.detection import Seen, worst
from twin.faults import Fault, chosen
from twin.judge import NAMED, Judge, ensemble, sigmoid
from twin.learn import View
from twin.network import NETWORKS
from twin.turns import Cells, Healthy, Remains

FORMAT = "indexer-twin"
VERSION = 1

HEALTHY, FAULTY, UNKNOWN, NOT_COMPARABLE = "healthy", "faulty", "unknown", "not comparable"
"""What is said of a turn."""

_OUTSIDE = 0.02
"""Share of the range by which an operating point may lie outside it [-]; of its middle where it is one point."""

_DEAD, _CLIPPED = 0.02, 0.002
"""Shares of a turn at one value, and at flat tops, above which it is none."""

_LIKENESS, _LEVEL = 0.9, (0.5, 2.0)
"""Likeness to the healthy machine in the first orders of the cam, and level over its own, outside of which a record is
none of this machine: faults of the table leave 0.95 and 0.7 to 1.4."""

_BY_COMPARISON = 0.01
"""rad; standard deviation of a start angle found by comparison."""

_STATED_SLACK = 0.1
"""rad; a stated cam angle that is farther from the record's own is wrong."""


@dataclass(frozen=True)
class FaultSeen:
    """A fault as the networks see it.

    Attributes
    ----------
    name : str
    probability : float
    size, low, high : float
        In the shop's unit, with the interval that holds the stated share.
    unit : str
    share : float
        The size as share of the largest.
    matters : bool
        Whether it is as large as the smallest size that a headline names.
    station : int or None
        Where a single roller is cracked, counted from the stated start angle; None where unknown.
    """

    name: str
    probability: float
    size: float
    low: float
    high: float
    unit: str
    share: float
    matters: bool
    station: int | None = None


@dataclass(frozen=True)
class TurnDiagnosis:
    """What the networks say of a turn, or of several together.

    Attributes
    ----------
    verdict : str
        HEALTHY, FAULTY, UNKNOWN or NOT_COMPARABLE.
    faults : tuple of FaultSeen
        Those that are named, the most probable first.
    probabilities : mapping
        Of each fault of the table.
    severities : mapping
        (size, low, high) of each fault of the table in the shop's unit, were it there.
    alarm : float
        Logit of any fault less the threshold; above 0 the turn is not healthy.
    novelty : float
        Over its threshold; above 1 the turn is like none of the simulated ones.
    reason : str
        One sentence.
    """

    verdict: str
    faults: tuple[FaultSeen, ...]
    probabilities: Mapping[str, float]
    severities: Mapping[str, tuple[float, float, float]]
    alarm: float
    novelty: float
    reason: str


@dataclass(frozen=True, eq=False)
class Twin:
    """A loaded twin.

    Attributes
    ----------
    folder : Path
    about : mapping
        All of twin.yaml.
    machine, sensor : Machine, Sensor
        Healthy, at the posterior's mean.
    view : View
    networks : tuple of Module
    judge : Judge
    healthy : Healthy
    """

    folder: Path
    about: Mapping[str, Any]
    machine: Machine
    sensor: Sensor
    view: View
    networks: tuple[nn.Module, ...]
    judge: Judge
    healthy: Healthy

    @classmethod
    def load(cls, folder: str | Path) -> Twin:
        """The twin of a folder.

        Raises
        ------
        ParameterError
            No folder of a finished twin, or one of another version.
        """
        folder = Path(folder)
        about = about_of(folder)
        machine, sensor = machine_and_sensor(folder)
        cells = Cells(**about["cells"])
        remains = Remains.restore(load_file(folder / "remains.safetensors"))
        names = [fault for fault in about["settings"]["faults"]]
        networks = networks_of(folder, about["networks"], len(names), cells.count)
        view = view_of(about, remains)
        return cls(folder, about, machine, sensor, view, networks, Judge.restore(about["judge"]),
                   Healthy(machine, sensor, cells, about["load_factor"]))  # fmt: skip

    @functools.cached_property
    def faults(self) -> tuple[Fault, ...]:
        """The fault table."""
        return chosen(list(self.about["settings"]["faults"]))

    @functools.cached_property
    def seen(self) -> tuple[Seen, ...]:
        """Smallest sizes that are seen."""
        return tuple(Seen(**row) for row in self.about["detection"])

    @functools.cached_property
    def matters(self) -> Mapping[str, float]:
        """Smallest size of each fault that a headline names, as share of the largest."""
        given = self.about["settings"]["matters"]
        sizes = {}
        for fault in self.faults:
            smallest = worst(self.seen, fault.name)
            sizes[fault.name] = 1.0 if smallest is None else smallest
            if fault.name in given:
                sizes[fault.name] = share_of(fault, float(given[fault.name]), self.machine)
        return sizes

    def diagnose_turn(self, signal: Signal, conditions: Conditions) -> TurnDiagnosis:
        """What the networks say of a record of one turn of the table or more; milliseconds, no physics.

        Parameters
        ----------
        signal : Signal
            Table acceleration in the twin's unit at its sampling rate.
        conditions : Conditions
            Motor speed and load, the cam angle of the first sample where it is known.
        """
        try:
            x, point, stations_known = self.looked(signal, conditions)
        except SignalError as error:
            return TurnDiagnosis(NOT_COMPARABLE, (), {}, {}, 0.0, 0.0, str(error))
        return self.judged(x, point, stations_known)

    def looked(self, signal: Signal, conditions: Conditions) -> tuple[np.ndarray, OperatingPoint, bool]:
        """Turns x (k, stations, cells) of a record as the networks take them, the operating point, and whether stations
        are known; raises SignalError where the record cannot be compared with the twin."""
        cells = self.healthy.cells
        name = signal.source or "the record"
        if signal.unit != self.sensor.unit:
            raise SignalError(f"{name} must be in {self.sensor.unit} as the twin's sensor reads, got {signal.unit}.")
        if abs(signal.sample_rate / cells.rate - 1.0) > 1e-3:
            rate = signal.sample_rate
            raise SignalError(f"{name} must be sampled at the twin's {cells.rate:g} Hz, got {rate:g} Hz; resample it.")
        quality = quality_columns(signal.values[None])[0]
        if quality["constant_share"] > _DEAD:
            raise SignalError(f"{name} must vary throughout, got one value on end; check the sensor and its cable.")
        if quality["clipped_share"] > _CLIPPED:
            share = quality["clipped_share"]
            raise SignalError(f"{name} must stay inside the sensor's range, got {share:.1%} of it at flat tops.")
        self._check_point(name, conditions)
        point = OperatingPoint(conditions.motor_speed, conditions.load_torque)
        reference = self.healthy.turn(point)
        cam_rate = self.machine.reduction * conditions.motor_speed
        start, known = self._start(name, signal, conditions, reference, cam_rate)
        turns = cells.turns(signal.values, cam_rate, start)
        if not len(turns):
            got = signal.duration / self.machine.turn_duration(point)
            raise SignalError(f"{name} must hold a whole turn of the table, got {got:.2f}; record for longer.")
        x = np.array([self.view.measured(turn - reference, reference, point) for turn in turns])
        return x, point, known

    def _check_point(self, name: str, conditions: Conditions) -> None:
        for what, value, (middle, half), unit, factor in (
            ("motor speed", conditions.motor_speed, self.view.speeds, "rpm", RPM),
            ("load", conditions.load_torque, self.view.loads, "N m", 1.0),
        ):
            slack = _OUTSIDE * max(abs(middle), half)
            if abs(value - middle) > self._half(what, half) + slack:
                low, high = ((middle + sign * self._half(what, half)) / factor for sign in (-1.0, 1.0))
                raise SignalError(
                    f"{name}: the {what} must lie within the twin's {low:.4g} to {high:.4g} {unit}, got "
                    f"{value / factor:.4g}; make a twin for this range."
                )

    def _half(self, what: str, half: float) -> float:
        """Half width of the range that the twin was made for; a unit of 1 stands for a range that is one point."""
        low, high = self.about["range"]["motor_speed_rpm" if what == "motor speed" else "load_torque"]
        return half if high > low else 0.0

    def _start(
        self, name: str, signal: Signal, conditions: Conditions, reference: np.ndarray, cam_rate: float
    ) -> tuple[float, bool]:
        """Cam angle of the first sample [rad], and whether its station is known."""
        mean = reference.mean(axis=0)
        found = np.fft.rfft(mean)[1:7] * 2.0 / len(mean)
        width = np.pi / len(mean)
        found = found * np.exp(-1j * np.arange(1, 7) * width)
        match = matched(signal.values, signal.sample_rate, cam_rate, found)
        if match.likeness < _LIKENESS or not _LEVEL[0] <= match.level <= _LEVEL[1]:
            raise SignalError(
                f"{name} must look like the twin's machine, likeness {_LIKENESS:g} and level {_LEVEL[0]:g} to "
                f"{_LEVEL[1]:g} in the first orders of the cam, got {match.likeness:.2f} and {match.level:.2g}; check "
                "whose record it is, its unit, its speed and its sensor."
            )
        if conditions.start_angle is None:
            return match.start_angle, False
        off = abs((conditions.start_angle - match.start_angle + np.pi) % (2.0 * np.pi) - np.pi)
        if off > _STATED_SLACK:
            raise SignalError(
                f"{name}: the cam angle at the first sample must agree with the record within {_STATED_SLACK:g} rad, "
                f"got {off:.2f} rad off; correct start_angle, or leave it out."
            )
        return conditions.start_angle, True

    def judged(self, x: np.ndarray, point: OperatingPoint, stations_known: bool) -> TurnDiagnosis:
        """The verdict on turns x (k, stations, cells) of one operating point, together."""
        seen = torch.from_numpy(x.astype(np.float32))
        conditions = torch.from_numpy(self.view.conditions([point] * len(x)))
        told = {name: value.mean(axis=0) for name, value in ensemble(self.networks, seen, conditions).items()}
        strange = float(self.judge.strangeness({n: told[n][None] for n in ("strength", "novelty")})[0])
        alarm = float(told["any"]) - self.judge.alarm
        chance = sigmoid(told["faults"])
        sizes, probabilities = {}, {}
        seen_faults = []
        for k, fault in enumerate(self.faults):
            probabilities[fault.name] = float(chance[k])
            share = float(told["size"][k])
            reach = float(self.judge.reach[k] * np.exp(told["spread"][k]))
            ends = [share, share - reach, share + reach]
            if not fault.signed:
                ends = [max(0.0, value) for value in ends]
            shop = [fault.told(value, self.machine) for value in ends]
            sizes[fault.name] = (shop[0], min(shop[1:]), max(shop[1:]))
            if chance[k] >= NAMED or (chance[k] == chance.max() and not (chance >= NAMED).any()):
                single = fault.name == "crack_single" and "station" in told and stations_known
                station = int(np.argmax(told["station"])) if single else None
                seen_faults.append(FaultSeen(
                    fault.name, float(chance[k]), *sizes[fault.name], fault.unit, ends[0],
                    abs(ends[0]) >= self.matters[fault.name], station,
                ))  # fmt: skip
        seen_faults.sort(key=lambda one: -one.probability)
        if strange > 1.0:
            reason = (
                f"the turn is unlike the healthy machine and all faults of the table, {strange:.1f} times the limit"
            )
            return TurnDiagnosis(
                UNKNOWN, tuple(seen_faults) if alarm > 0.0 else (), probabilities, sizes, alarm, strange, reason
            )
        if alarm <= 0.0:
            reason = "the turn is as the healthy machine's"
            return TurnDiagnosis(HEALTHY, (), probabilities, sizes, alarm, strange, reason)
        words = {fault.name: fault.words for fault in self.faults}
        reason = "the turn shows " + " and ".join(words[one.name] for one in seen_faults)
        return TurnDiagnosis(FAULTY, tuple(seen_faults), probabilities, sizes, alarm, strange, reason)

    def explain(self, turns: Sequence[tuple[Signal, Conditions]]) -> physics.Physics:
        """What physics says of records together: faults as hypotheses from the twin's machine; seconds.

        Raises
        ------
        SignalError
            Records that are not comparable, or too few cam turns in all.
        """
        records = []
        for number, (signal, told) in enumerate(turns):
            name = signal.source or f"turn {number + 1}"
            reference = self.healthy.turn(OperatingPoint(told.motor_speed, told.load_torque))
            start, known = self._start(name, signal, told, reference, self.machine.reduction * told.motor_speed)
            spread = told.start_uncertainty if known else _BY_COMPARISON
            noise = self.about["sample_noise"] if told.noise is None else told.noise
            load = self.healthy.load_factor * told.load_torque
            told = dataclasses.replace(told, start_angle=start, start_uncertainty=spread, noise=noise, load_torque=load)
            records.append(Record(name, signal, told))
        given = physics.checked(records, self.machine, self.sensor)
        return physics.explained(
            given, self.machine, self.sensor, self.about["calibration"]["findings"], self.about["calibration"]["spread"],
            self.faults,
        )  # fmt: skip


def about_of(folder: Path) -> dict[str, Any]:
    """twin.yaml of a folder."""
    path = folder / "twin.yaml"
    if not path.is_file():
        raise ParameterError(f"twin must be the folder of a finished twin, got {folder}, which holds no twin.yaml.")
    about = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise ParameterError(f"{path} must be the head of a twin, got another file; name the folder that twin wrote.")
    if about.get("version") != VERSION:
        got = about.get("version")
        raise ParameterError(f"{path} must be of version {VERSION}, got {got}; make the twin anew with this software.")
    return about


def machine_and_sensor(folder: Path) -> tuple[Machine, Sensor]:
    """The healthy machine and its sensor."""
    machine = load_machine(folder / "machine.yaml")
    sensor = yaml.safe_load((folder / "sensor.yaml").read_text(encoding="utf-8"))
    return machine, from_mapping(Sensor, sensor, "sensor")


def networks_of(folder: Path, names: Sequence[str], faults: int, cells: int) -> tuple[nn.Module, ...]:
    """The networks of these names, "cnn_0" for the first of kind cnn."""
    found = []
    for name in names:
        network = NETWORKS[name.partition("_")[0]](faults, cells)
        network.load_state_dict(load_weights(folder / f"{name}.safetensors"))
        found.append(network.eval())
    return tuple(found)


def view_of(about: Mapping[str, Any], remains: Remains) -> View:
    """What turns go through, from the range and the shift in twin.yaml."""

    def middle(key: str, factor: float) -> tuple[float, float]:
        low, high = (factor * float(value) for value in about["range"][key])
        return 0.5 * (low + high), 0.5 * (high - low) or 1.0

    return View(remains, float(about["shift"]), middle("motor_speed_rpm", RPM), middle("load_torque", 1.0))


def share_of(fault: Fault, told: float, machine: Machine) -> float:
    """Size t of a value in the shop's unit, by bisection: what the shop reads is monotonic in t."""
    low, high = 0.0, 1.0
    rising = fault.told(1.0, machine) > fault.told(0.5, machine)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = fault.told(middle, machine) < told if rising else fault.told(middle, machine) > told
        low, high = (middle, high) if below else (low, middle)
    return high
