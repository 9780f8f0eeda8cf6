"""The twin of one's own machine as the one who diagnoses, and limits from what it can see.

A fault is there with the probability that the networks give, and has then the size that they give. A fault that is
named is told with this size and its interval. Of the others the mean is told, probability times size, and an interval
from nothing on: the lower quantile of a law with so much of its weight at nothing.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.signal import resample

from discrepancy.records.conditions import Conditions
from indexer_env.errors import ParameterError, SignalError, refuse
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.signal import Signal
from indexer_env.simulate import simulate
from indexer_env.units import RPM
from indexer_records.conditions import RecordConditions
from indexer_records.quality import is_dead
from indexer_records.stream import StreamedTurn
from monitor.alarms import Limits, limits_of_key
from monitor.analysis.finding import Finding, Size
from monitor.intake.cutter import SPEED_TOLERANCE, Mode
from twin.diagnosis import FAULTY, HEALTHY, NOT_COMPARABLE, UNKNOWN, TurnDiagnosis
from twin.faults import Fault, share_of
from twin.gate import CLIPPED, DEAD
from twin.twin import Twin

DANGER = 0.6
"""Share of a fault's largest size that is danger: the largest one is that of a machine that nobody would call sound."""

SHARE_UNIT = "% of the largest"
"""Unit of a fault whose number in the shop does not grow from nothing, as a resonance that falls."""

_UNLIKELY = 0.05
"""Probability below which the upper end of a fault's 90 % interval is nothing."""

_SAME_SPEED = 1e-4
"""Relative difference of speed that moves the acceleration by less than its noise."""

_HEALTHY, _UNLIKE = "as the healthy machine", "unlike the healthy machine and all faults of the table"
_NAMELESS = "not as the healthy machine, and no fault of the table is likely"

_UNEXPLAINED = 2.0
"""Change that an alarm without a likely fault is at least: twice as far from the usual as a turn can be by chance."""


class TwinDiagnoser:
    """Diagnoses by a twin's networks.

    Parameters
    ----------
    twin : Twin
    load_torque : float, optional
        Under which the machines run [N m]; None: that of the healthy records, where it is one.
    motor_speeds : sequence of float, optional
        At which they run [rad/s]; None: those of the healthy records.

    Raises
    ------
    ParameterError
        A load that must be stated, a speed or load outside the twin's range.
    """

    def __init__(
        self, twin: Twin, load_torque: float | None = None, motor_speeds: Sequence[float] | None = None
    ) -> None:
        self.twin = twin
        self.load_torque = _load(self.twin, load_torque)
        speeds = _speeds(self.twin, motor_speeds)
        self.modes = tuple(_mode(self.twin, speed) for speed in speeds)
        self._scales = {fault.name: scale_of(fault, self.twin) for fault in self.twin.faults}
        self.quantities = tuple(self._scales)
        self.units: Mapping[str, str] = {name: unit for name, (_, unit) in self._scales.items()}
        origin = hashlib.sha256(json.dumps(twin.about, sort_keys=True, default=str).encode()).hexdigest()
        self.origins: Mapping[str, str] = {mode.name: origin for mode in self.modes}
        for mode in self.modes:
            self._check(mode)

    @property
    def caution(self) -> str | None:
        """Why the twin says that it is not to be trusted; None where it says that it is."""
        check = self.twin.about["check"]
        return None if check["trusted"] else f"the twin: {check['reason']}"

    def _check(self, mode: Mode) -> None:
        """That the twin knows a mode; also compiles the simulator, for which the first turn would have to wait."""
        healthy, rate = self.twin.healthy, mode.rate
        assert mode.motor_speed is not None
        point = OperatingPoint(mode.motor_speed, healthy.load_factor * self.load_torque)
        moved = simulate(healthy.machine, point, Run(rate, round(mode.duration * rate), warmup_turns=1))
        read = healthy.sensor.read(moved.table_acceleration, rate)
        signal = Signal(read.values, rate, unit=read.unit, source="a healthy turn")
        seen = self.twin.diagnose_turn(signal, Conditions(mode.motor_speed, self.load_torque))
        if seen.verdict == NOT_COMPARABLE:
            raise ParameterError(
                f"monitor: motor_speeds_rpm and load_torque must be of an operating point that the twin knows, got "
                f"{mode.name} and {self.load_torque:g} N m: {seen.reason.removeprefix('a healthy turn: ')}"
            )

    def flaw(self, mode: Mode, turn: StreamedTurn) -> tuple[str, str] | None:
        """The state that keeps a turn from being diagnosed, and a sentence; None: sound."""
        if turn.record is None:
            sensor = "finite" in turn.problem or "float32" in turn.problem
            return ("dead" if sensor else "other_speed"), f"a turn {turn.problem}"
        if is_dead(turn.clipped_share, turn.constant_share, DEAD):
            return "dead", f"a turn must vary throughout, got one value for {turn.constant_share:.0%} of it"
        if turn.clipped_share > CLIPPED:
            return "clipped", f"a turn must stay inside the sensor's range, got {turn.clipped_share:.1%} at flat tops"
        return None

    def diagnose_turn(
        self, signal: Signal, conditions: RecordConditions, start_angle: float | None = None
    ) -> Finding:  # fmt: skip
        """What a turn shows to the twin.

        Raises
        ------
        SignalError
            A turn that the twin cannot compare.
        """
        seen = self.twin.diagnose_turn(*self.comparable(signal, conditions, start_angle))
        if seen.verdict == NOT_COMPARABLE:
            raise SignalError(seen.reason)
        named = {one.name for one in seen.faults} if seen.verdict == FAULTY else set()
        sizes = {fault.name: self._size(fault, seen, fault.name in named) for fault in self.twin.faults}
        return Finding(
            verdict=_verdict(seen, self.twin),
            healthy=seen.verdict == HEALTHY,
            probability=seen.faults[0].probability if named else None,
            sizes=sizes,
            novelty=max(seen.novelty, _UNEXPLAINED) if _nameless(seen) else seen.novelty,
            level=float(np.sqrt(np.mean(np.square(signal.values - signal.values.mean())))),
            more={
                "reason": seen.reason,
                "alarm": seen.alarm,
                "stations": {one.name: one.station for one in seen.faults if one.station is not None},
            },
        )

    def comparable(
        self, signal: Signal, known: RecordConditions, start_angle: float | None = None
    ) -> tuple[Signal, Conditions]:  # fmt: skip
        """A turn as the twin takes it."""
        mode = next(mode for mode in self.modes if round(mode.duration * mode.rate) == signal.values.size)
        assert mode.motor_speed is not None
        speed = mode.motor_speed if known.motor_speed is None else known.motor_speed
        values = in_true_time(signal.values, mode.motor_speed / speed)
        told = Signal(values, signal.sample_rate, unit=signal.unit, source=signal.source)
        return told, Conditions(speed, self.load_torque, start_angle=start_angle, sensor_radius=known.sensor_radius)

    def _size(self, fault: Fault, seen: TurnDiagnosis, named: bool) -> Size:
        value, *ends = (self._told(fault, one) for one in seen.severities[fault.name])
        # Of a fault of either sign that may be of either, the least size is nothing.
        low = 0.0 if fault.signed and np.ptp(np.sign(seen.severities[fault.name])) else min(ends)
        high = max(ends)
        if named:
            return Size(value, low, high)
        chance = seen.probabilities[fault.name]
        return Size(chance * value, 0.0, high if chance > _UNLIKELY else 0.0)

    def _told(self, fault: Fault, value: float) -> float:
        """A size in the unit of `units`; of a fault of either sign how large it is."""
        scale, unit = self._scales[fault.name]
        if unit == SHARE_UNIT:
            return scale * share_of(fault, value, self.twin.machine) if math.isfinite(value) else 0.0
        return abs(value)


def in_true_time(record: np.ndarray, longer: float) -> np.ndarray:
    """A turn (n,) that was stretched to its mode's length, in the time that it took, `longer` times its mode's."""
    values = np.asarray(record, dtype=float)
    return values if abs(longer - 1.0) <= _SAME_SPEED else np.asarray(resample(values, round(values.size * longer)))


def limits_of(twin: Twin, given: Mapping[str, Sequence[float] | None], deadband: float) -> dict[str, Limits]:
    """Limits of each fault in its unit.

    Alert is the smallest size that is surely seen; danger is `DANGER` of the largest size, or where that is more the
    geometric mean of alert and the largest; alarm is the geometric mean of alert and danger. A fault whose largest size
    is surely seen nowhere is not watched. `given` replaces the three of a fault; None: it is not watched.

    Raises
    ------
    ParameterError
        Limits of a fault that the twin does not know, or that do not rise.
    """
    unknown = sorted(set(given) - {fault.name for fault in twin.faults})
    if unknown:
        known = ", ".join(fault.name for fault in twin.faults)
        raise refuse("monitor", "twin_limits", f"limits of faults of the twin ({known})", unknown[0])
    limits = {}
    for fault in twin.faults:
        steps = given[fault.name] if fault.name in given else _steps(fault, twin)
        if steps is None:
            continue
        limits[fault.name] = limits_of_key("twin_limits", fault.name, steps, deadband)
    return limits


def scale_of(fault: Fault, twin: Twin) -> tuple[float, str]:
    """What the largest size is worth, and in which unit: the shop's, where its number grows from nothing."""
    smallest, largest = fault.told(0.0, twin.machine), fault.told(1.0, twin.machine)
    if math.isfinite(smallest) and abs(smallest) < abs(largest):
        return abs(largest), fault.unit
    return 100.0, SHARE_UNIT


def _steps(fault: Fault, twin: Twin) -> tuple[float, float, float] | None:
    alert = twin.matters[fault.name]
    if not 0.0 < alert < 1.0:
        return None
    danger = max(DANGER, math.sqrt(alert))
    scale = scale_of(fault, twin)[0]
    return scale * alert, scale * math.sqrt(alert * danger), scale * danger


def _nameless(seen: TurnDiagnosis) -> bool:
    """Whether there is an alarm for which no fault of the table is likely, on a turn that is not novel."""
    return seen.verdict == UNKNOWN and seen.novelty <= 1.0


def _verdict(seen: TurnDiagnosis, twin: Twin) -> str:
    if seen.verdict == HEALTHY:
        return _HEALTHY
    if seen.verdict == UNKNOWN:
        return _NAMELESS if _nameless(seen) else _UNLIKE
    words = {fault.name: fault.words for fault in twin.faults}
    return " and ".join(words[one.name] for one in seen.faults)


def _load(twin: Twin, given: float | None) -> float:
    low, high = twin.about["range"]["load_torque"]
    if given is None:
        if high - low > 1e-6 * max(1.0, abs(high)):
            rule = f"the load under which the machines run, {low:.4g} to {high:.4g} N m as the twin knows it"
            raise refuse("monitor", "load_torque", rule, None)
        return float(low)
    return float(given)


def _speeds(twin: Twin, given: Sequence[float] | None) -> list[float]:
    """Speeds [rad/s], each once: turns of two within the tolerance of a pulse cannot be told apart."""
    speeds: list[float] = []
    for speed in sorted(twin.view.remains.points[:, 0] if given is None else given):
        if not speeds or speed > speeds[-1] * (1.0 + SPEED_TOLERANCE):
            speeds.append(float(speed))
    return speeds


def _mode(twin: Twin, speed: float) -> Mode:
    duration = twin.machine.turn_duration(OperatingPoint(speed))
    return Mode(f"{speed / RPM:.4g} rpm", twin.healthy.cells.rate, duration, twin.healthy.sensor.unit, speed)
