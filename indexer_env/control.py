"""The control task of the environments: how often, how fast, what is seen and what counts. Shared by one and many."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from indexer_env.checks import check_number
from indexer_env.effects.drive import MeshFriction, Slip
from indexer_env.errors import ParameterError, refuse
from indexer_env.kernels import control as kernel
from indexer_env.law_table import law_table
from indexer_env.machine import Machine
from indexer_env.operating_point import START_ANGLE, OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.turns import LEAST_SPEED

RATE_MARGIN = 2.0
"""The encoder's range over the table's peak rate of rigid motion at the highest speed [-]."""

SPEED_MARGIN = 1.5
"""Range of the motor's speed over its highest command [-]: a slipping motor may overshoot."""

VIBRATION_SHARE = 0.1
"""Scale of the vibration over the peak table acceleration of rigid motion at nominal speed [-]; the healthy reference
machine rings in its dwell with 0.8 of that scale, with 20° of play with three times as much."""

TERMINATION_PENALTY = 100.0
"""Reward of the step in which a machine leaves the model's range, as a loss."""

MOST_SAMPLES = 100_000
"""Samples in a control period, 100 s at 1 kHz: what lies beyond is a slip of the unit."""

MOST_STEPS = 10_000_000
"""Integrator steps in a control period: some seconds of computing in one call that cannot be interrupted."""


@dataclass(frozen=True)
class ControlTask:
    """Numbers of the control problem.

    Attributes
    ----------
    period : float
        Control period [s], a whole number of samples, at most MOST_SAMPLES. The default is twenty in a cam turn of the
        reference machine: what a command did shows within the hundred steps that a discount of 0.99 sees.
    sample_rate : float
        Of the readings [Hz], 1 to 1e6.
    step : float
        Largest step of the integrator [s], as `Run.step`; a period takes at most MOST_STEPS.
    ramp : float
        Fastest change of the inverter's command [share of nominal speed per s], > 0. The default takes 4 s from
        standstill to nominal, as inverters of such drives are set; a faster one lets the random commands of an
        algorithm that explores shake the table until standing still pays best.
    highest_share : float
        Upper end of the speed command [share of nominal speed], in [0.1, 1.5].
    brake_torque : float
        Torque of the load brake at full command [N m], 0 to 500; 0: there is no brake and no second action.
    vibration_weight : float
        Weight of the vibration in the reward [-], 0 to 10.
    start_angle : float or None
        Cam angle at which an episode starts [rad]; None: drawn, uniform over the first dwell.
    """

    period: float = 0.05
    sample_rate: float = 1000.0
    step: float = 0.25e-3
    ramp: float = 0.25
    highest_share: float = 1.0
    brake_torque: float = 0.0
    vibration_weight: float = 0.5
    start_angle: float | None = None

    def __post_init__(self) -> None:
        check_number("IndexerEnv", "sample_rate", self.sample_rate, low=1.0, high=1e6, unit="Hz")
        check_number("IndexerEnv", "period", self.period, low=0.0, low_open=True, unit="s")
        samples = self.period * self.sample_rate
        if samples > MOST_SAMPLES:
            rule = f"at most {MOST_SAMPLES} samples of {1.0 / self.sample_rate:g} s"
            remedy = f"set it to {MOST_SAMPLES / self.sample_rate:g} s or less"
            raise refuse("IndexerEnv", "period", rule, self.period, remedy)
        if round(samples) < 1 or abs(samples - round(samples)) > 1e-9 * samples:
            remedy = f"{max(1, round(samples)) / self.sample_rate:g} s is the nearest"
            rule = f"a whole number of samples of {1.0 / self.sample_rate:g} s"
            raise refuse("IndexerEnv", "period", rule, self.period, remedy)
        check_number("IndexerEnv", "step", self.step, low=0.0, low_open=True, unit="s")
        if self.step < self.period / MOST_STEPS:
            rule = f">= {self.period / MOST_STEPS:g} s, of which a period has {MOST_STEPS}"
            raise refuse("IndexerEnv", "step", rule, self.step)
        check_number("IndexerEnv", "ramp", self.ramp, low=0.0, low_open=True, unit="1/s")
        check_number("IndexerEnv", "highest_share", self.highest_share, low=0.1, high=1.5)
        check_number("IndexerEnv", "brake_torque", self.brake_torque, low=0.0, high=500.0, unit="N m")
        check_number("IndexerEnv", "vibration_weight", self.vibration_weight, low=0.0, high=10.0)
        if self.start_angle is not None:
            check_number("IndexerEnv", "start_angle", self.start_angle, **START_ANGLE)

    @property
    def samples(self) -> int:
        """Samples in a control period."""
        return round(self.period * self.sample_rate)

    @property
    def steps_per_sample(self) -> int:
        """Integrator steps in a sampling interval."""
        return max(1, math.ceil(1.0 / (self.sample_rate * self.step) - 1e-9))

    @property
    def integrator_step(self) -> float:
        """Step that the integrator takes [s]: the largest part of a sampling interval that is at most `step`."""
        return 1.0 / (self.sample_rate * self.steps_per_sample)

    @property
    def actions(self) -> int:
        """Numbers in an action: the speed command, and the brake's where there is one."""
        return 2 if self.brake_torque > 0.0 else 1

    @property
    def highest(self) -> np.ndarray:
        """Upper ends (k,) of the commands: speed [share of nominal], brake [share]."""
        return np.array([self.highest_share, 1.0][: self.actions])

    def shares(self, actions: np.ndarray) -> np.ndarray:
        """Speed commands [share of nominal] and brake commands [share] (..., k) of actions (..., k) in [-1, 1]."""
        return 0.5 * (1.0 + actions) * self.highest


@dataclass(frozen=True)
class Limits:
    """Published limits of the observation: a quantity over its limit, clipped to ±1.

    Attributes
    ----------
    acceleration : float
        The sensor's range [its unit].
    table_rate : float
        Range of the table's encoder [rad/s].
    motor_speed : float
        [share of nominal].
    vibration : float
        The reward's scale of the dwell's rms acceleration [rad/s²].
    """

    acceleration: float
    table_rate: float
    motor_speed: float
    vibration: float


def limits_of(machine: Machine, operating_point: OperatingPoint, sensor: Sensor, task: ControlTask) -> Limits:
    """The limits, from the machine as it was ordered: faults and variations of it do not move them.

    Raises
    ------
    ParameterError
        A sensor without a range, which would leave the observation unbounded.
    """
    if sensor.full_scale is None:
        raise ParameterError(
            "IndexerEnv.sensor must have a range (full_scale), which bounds the observation, got full_scale None; "
            "set it to the largest reading that counts."
        )
    angles = np.linspace(0.0, 2.0 * math.pi, 4097)
    _, slope, curvature = machine.motion_law.evaluate(angles, machine.stations, machine.motion_share)
    cam_rate = machine.reduction * operating_point.motor_speed
    return Limits(
        acceleration=float(sensor.full_scale),
        table_rate=RATE_MARGIN * task.highest_share * cam_rate * float(np.abs(slope).max()),
        motor_speed=SPEED_MARGIN * task.highest_share,
        vibration=VIBRATION_SHARE * cam_rate**2 * float(np.abs(curvature).max()),
    )


def task_numbers(task: ControlTask, limits: Limits, reading: float) -> np.ndarray:
    """The task as the kernels take it (kernels/control.py), shape (TASK_NUMBERS,); `reading` per acceleration, or 0."""
    row = np.zeros(kernel.TASK_NUMBERS)
    row[kernel.PERIOD] = task.samples / task.sample_rate
    row[kernel.MOST_CHANGE] = task.ramp * row[kernel.PERIOD]
    row[kernel.BRAKE] = task.brake_torque
    row[kernel.LIMIT_ACCELERATION] = limits.acceleration
    row[kernel.LIMIT_RATE] = limits.table_rate
    row[kernel.LIMIT_SPEED] = limits.motor_speed
    row[kernel.WEIGHT] = task.vibration_weight
    row[kernel.SCALE] = limits.vibration
    row[kernel.PENALTY] = TERMINATION_PENALTY
    row[kernel.READING] = reading
    return row


def dwell_begin(machine: Machine) -> float:
    """Cam phase from which on a machine dwells, to the end of the cam turn [rad]; 2π where it never does.

    Raises
    ------
    ParameterError
        A table whose motion does not begin with the cam turn, or that moves more than once in it.
    """
    motions = law_table(machine.motion_law, machine.stations, machine.motion_share).motions
    (low, high), *others = motions
    if others or low != 0.0:
        moves = " and ".join(f"{360.0 * begin:.4g} to {360.0 * end:.4g} deg" for begin, end in motions)
        rule = "one that moves once a cam turn, from cam angle 0 on, and then dwells"
        remedy = "shift the cam angles of its motion law so that its one motion begins at 0 deg"
        raise refuse("IndexerEnv", "machine", rule, f"{machine.name}, which moves from {moves}", remedy)
    return 2.0 * math.pi * high


def speed_kept(machine: Machine, torque: float, motor_speed: float) -> float:
    """Share of the commanded speed [rad/s] that the motor keeps under a torque on the table [N m] where the cam is
    steepest, motion taken as slow: 1 - c τ β'_max T / (ω η), of a reducer whose mesh leaves the share η of a torque."""
    compliance = next((effect.compliance for effect in machine.effects if isinstance(effect, Slip)), 0.0)
    left = 1.0 - sum(effect.loss for effect in machine.effects if isinstance(effect, MeshFriction))
    steepest = law_table(machine.motion_law, machine.stations, machine.motion_share).steepest
    return 1.0 - compliance * machine.reduction * steepest * torque / (left * motor_speed)


def check_drive(machine: Machine, operating_point: OperatingPoint, task: ControlTask) -> None:
    """Refuse a motor that slips so much under load and full brake that it stands still where the cam is steepest."""
    share = speed_kept(machine, abs(operating_point.load_torque) + task.brake_torque, operating_point.motor_speed)
    if share < LEAST_SPEED:
        rule = f"one that keeps {LEAST_SPEED:.0%} of the commanded speed under its load and the full brake"
        remedy = "lower the load, brake_torque or drive.slip's compliance"
        raise refuse("IndexerEnv", "machine", rule, f"{machine.name} with {share:.0%}", remedy)


def reward_bounds(task: ControlTask) -> tuple[float, float]:
    """Lowest and highest reward of a step."""
    lowest = -max(TERMINATION_PENALTY, task.vibration_weight * kernel.MOST_VIBRATION)
    return lowest, kernel.MOST_THROUGHPUT


def checked_actions(owner: str, given: object, shape: tuple[int, ...]) -> np.ndarray:
    """Actions (k,) or (n, k) as float64, or one sentence on what is wrong with them; nothing is clipped."""
    if isinstance(given, np.ma.MaskedArray):
        raise refuse(owner, "action", "an array without a mask", given, "fill what is masked yourself")
    actions = np.asarray(given)
    if actions.dtype.kind not in "fiu":
        raise refuse(owner, "action", "an array of floats", given, f"its dtype is {actions.dtype}")
    if actions.shape != shape:
        raise refuse(owner, "action", f"of shape {shape}", given if actions.size < 9 else actions.shape)
    if len(shape) == 1:  # a single environment's few numbers are checked faster one by one
        for place, value in enumerate(actions.tolist()):
            if not -1.0 <= value <= 1.0:  # NaN fails too
                raise _out_of_box(owner, place, value)
    else:
        good = np.abs(actions) <= 1.0
        if not good.all():
            item, place = np.argwhere(~good)[0].tolist()
            raise _out_of_box(f"{owner} (item {item})", place, float(actions[item, place]))
    return actions.astype(np.float64, order="C")


def _out_of_box(owner: str, place: int, value: float) -> ParameterError:
    name = ("speed", "brake")[place]
    return refuse(owner, "action", f"finite and within [-1, 1] ({name})", value, "clip it yourself where that is meant")
