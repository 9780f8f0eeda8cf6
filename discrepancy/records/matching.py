"""A record against the nominal machine, by what hardly depends on its stiffness: the low orders of the cam turn.

The rigid part of an index is fixed by kinematics. Its first few Fourier coefficients a_k(m), of each cam turn m of the
record, are compared with those c_k of the nominal machine's steady cam turn:

    α(m) = argmax_α Re Σ_k a_k(m) c̄_k e^{-ikα}                                    cam angle at the first sample
    likeness = Re Σ_k a_k c̄_k e^{-ikα} / (‖a‖ ‖c‖),   level = Re Σ_k a_k c̄_k e^{-ikα} / ‖c‖²

The slope of α(m) over the turns is the error of the stated speed. What effects bend is told from another cam by whether
another motion is more like the record.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from indexer_env.errors import ParameterError, SimulationError
from indexer_env.machine import Machine
from indexer_env.motion_law import MOTION_LAWS, TableLaw, motion_law
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_env.simulate import simulate

_ORDERS = np.arange(1, 7)
"""Of the cam turn: an index of half a turn has most of its acceleration at order 2, its ringing lies above order 10."""

_ANGLES = 720
_ROUNDS = 3

_CURVED = 16
"""Cam turns from which on the angle at the first sample is that of a parabola: a speed that drifts by 0.2 % over 500
cam turns moves the straight line's by half a radian. Of fewer turns what wavers from station to station bends it."""

_STIFFNESSES = (0.75, 0.87, 1.0, 1.15, 1.33)
"""Factors of the output joint's stiffness with which motions are compared: a table that rings among their orders, and
at another frequency than the nominal one, looks like one with another motion."""

_OTHER_SHARE = 0.05
"""Motion shares that are tried lie so far on either side: half of it changes the likeness by 0.003 to 0.013."""


@dataclass(frozen=True)
class Match:
    """How a record compares with the nominal machine.

    Attributes
    ----------
    speed : float
        Measured over stated speed [-].
    start_angle : float
        Cam angle at the first sample [rad], in 0 to 2π: which station is first cannot be seen.
    likeness : float
        Cosine of the angle between the two sets of coefficients, in -1 to 1.
    level : float
        Amplitude measured over nominal [-].
    """

    speed: float
    start_angle: float
    likeness: float
    level: float


def nominal_orders(machine: Machine, point: OperatingPoint, sensor: Sensor, rate: float) -> np.ndarray:
    """Coefficients c_k (k,) of the nominal machine's reading over a cam turn from cam angle 0 [unit of the sensor].

    Raises
    ------
    ParameterError, SimulationError
        The machine cannot run at this point.
    """
    from scipy.signal import freqz_sos

    samples = round(machine.turn_duration(point) * rate)
    run = simulate(machine, OperatingPoint(point.motor_speed, point.load_torque), Run(rate, samples))
    cam_rate = machine.reduction * point.motor_speed
    time = np.arange(samples) / rate
    found = sensor.scale * _coefficients(run.table_acceleration, time, cam_rate)
    for sections in sensor.sections(rate):
        found = found * freqz_sos(sections, _ORDERS * cam_rate, fs=2.0 * math.pi * rate)[1]  # type: ignore[arg-type]
    return found


def matched(values: np.ndarray, rate: float, cam_rate: float, nominal: np.ndarray) -> Match:
    """Compare a record (n,) at `rate` [Hz], its cam turning at `cam_rate` [rad/s] as stated, with c_k (k,)."""
    factor, start = 1.0, 0.0
    for _ in range(_ROUNDS):
        turn_angles, turns, mean = _angles(values, rate, factor * cam_rate, nominal)
        angles = np.unwrap(turn_angles)
        slope, start = (np.polyfit(turns, angles, 1)) if len(turns) > 1 else (0.0, angles[0])
        factor *= 1.0 + float(slope) / (2.0 * math.pi)
    if len(turns) >= _CURVED:
        start = np.polyfit(turns, angles, 2)[-1]
    overlap = float((mean * nominal.conj()).sum().real)
    sizes = float(np.linalg.norm(mean)), float(np.linalg.norm(nominal))
    likeness = overlap / (sizes[0] * sizes[1])
    return Match(factor, float(start) % (2.0 * math.pi), likeness, overlap / sizes[1] ** 2)


def likest(signal: Signal, cam_rate: float, machine: Machine, point: OperatingPoint, sensor: Sensor) -> float:
    """Likeness of a record and a machine whose output joint may be as stiff as makes them most alike; -1 where it
    cannot run."""
    joint, found = machine.output_joint, [-1.0]
    for factor in _STIFFNESSES:
        # as much damping for its mode
        damping = math.sqrt(factor) * joint.damping
        other = dataclasses.replace(joint, stiffness=factor * joint.stiffness, damping=damping)
        with contextlib.suppress(ParameterError, SimulationError):
            nominal = nominal_orders(
                dataclasses.replace(machine, output_joint=other), point, sensor, signal.sample_rate
            )
            found.append(matched(signal.values, signal.sample_rate, cam_rate, nominal).likeness)
    return max(found)


def likest_other(
    signal: Signal, cam_rate: float, machine: Machine, point: OperatingPoint, sensor: Sensor
) -> tuple[str, float]:
    """Of the library's other motion laws, and of motion shares about the machine's, the one that is most like a record,
    in words, and its likeness."""
    found = [(words, likest(signal, cam_rate, other, point, sensor)) for words, other in _other_motions(machine)]
    return max(found, key=lambda pair: pair[1])


def _other_motions(machine: Machine) -> Iterator[tuple[str, Machine]]:
    for name, law in MOTION_LAWS.items():
        if law is not TableLaw and not isinstance(machine.motion_law, law):
            yield f"motion_law {name}", dataclasses.replace(machine, motion_law=motion_law(name))
    for share in (machine.motion_share - _OTHER_SHARE, machine.motion_share + _OTHER_SHARE):
        if 0.0 < share < 1.0:
            yield f"motion_share {share:.3g}", dataclasses.replace(machine, motion_share=share)


def upright(
    name: str, signal: Signal, cam_rate: float, nominal: np.ndarray, likeness: float
) -> tuple[Signal, Match, list[str]]:
    """The signal of a record with the nominal machine's sign, how it compares, and what is to be said of it: turned
    round where only so it is as like as `likeness`."""
    match = matched(signal.values, signal.sample_rate, cam_rate, nominal)
    if match.likeness < likeness:
        turned = matched(-signal.values, signal.sample_rate, cam_rate, nominal)
        if turned.likeness >= likeness:
            said = f"{name}: the table turns the other way, or the sensor reads it so; its sign is put right"
            return dataclasses.replace(signal, values=-signal.values), turned, [said]
    return signal, match, []


def _angles(
    values: np.ndarray, rate: float, cam_rate: float, nominal: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """α (m,) [rad] of each whole cam turn, the turn's middle counted in turns from the first sample (m,), and the mean
    of the coefficients turned back by them (k,)."""
    length = 2.0 * math.pi / cam_rate * rate
    count = max(1, int(len(values) / length))
    rows, turns = [], []
    for number in range(count):
        first, last = round(number * length), min(round((number + 1) * length), len(values))
        rows.append(_coefficients(values[first:last], np.arange(first, last) / rate, cam_rate))
        turns.append(number + 0.5)
    a = np.array(rows)
    grid = np.linspace(0.0, 2.0 * math.pi, _ANGLES, endpoint=False)
    turned = np.exp(-1j * np.outer(_ORDERS, grid))
    agreement = np.real((a * nominal.conj()) @ turned)
    best = agreement.argmax(axis=1)
    three = np.stack([agreement[np.arange(count), (best + shift) % _ANGLES] for shift in (-1, 0, 1)])
    vertex = 0.5 * (three[0] - three[2]) / (three[0] - 2.0 * three[1] + three[2])
    angles = grid[best] + vertex * grid[1]
    mean = (a * np.exp(-1j * np.outer(angles, _ORDERS))).mean(axis=0)
    return angles, np.array(turns), mean


def _coefficients(values: np.ndarray, time: np.ndarray, cam_rate: float) -> np.ndarray:
    """(2/n) Σ y e^{-ikωt} (k,), the mean taken out."""
    waves = np.exp(-1j * np.outer(_ORDERS, cam_rate * time))
    return 2.0 / len(values) * (waves @ (values - values.mean()))
