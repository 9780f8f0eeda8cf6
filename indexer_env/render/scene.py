"""What a picture shows, apart from how it is drawn: plain numbers, from the simulator or from anywhere else."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from indexer_env.checks import check_integer, check_number
from indexer_env.coefficients import Coefficients, coefficients
from indexer_env.errors import ParameterError, refuse
from indexer_env.kernels.layout import HAS_EDGES_1
from indexer_env.machine import Machine
from indexer_env.motion_law import ModifiedSine, MotionLaw
from indexer_env.operating_point import OperatingPoint

SCENE_CHANNELS = (
    "cam_angle", "table_angle", "housing_angle", "deflection_1", "deflection_2", "deflection_3",
    "motor_angle", "table_acceleration",
)  # fmt: skip
"""Channels to record so that every sample can be drawn: `Run(channels=SCENE_CHANNELS)`."""

_NOW = SCENE_CHANNELS[:6]
_HISTORY = ("time", "motor_angle", "table_acceleration")


_ROOM = 1.25
"""Room of the chart over the theoretical peak, for the ringing of a sound machine [-]."""


def _none() -> np.ndarray:
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class Scene:
    """One moment of one machine.

    Attributes
    ----------
    cam_angle, table_angle, housing_angle : float
        α, φ, θ [rad].
    stations : int
        S, >= 2.
    motion_law : MotionLaw
        Law of the cam, whose tracks are drawn.
    motion_share : float
        f, share of the cam turn in which the table moves [-], in (0, 1].
    deflections, half_plays : tuple of three float
        δ and g/2 of joints 1, 2 and 3 [rad].
    cracked_stations : tuple of int
        Stations whose roller is cracked; () is none, `range(stations)` as a tuple is all.
    loose_screws : bool
        Whether the base screws are loose; they are drawn red while the housing stands off its place.
    dwell : bool
        Whether the cam is in its dwell.
    time : float
        [s].
    history_time, acceleration, theoretical_acceleration : ndarray (n,)
        Time [s], table acceleration φ̈ and theoretical one [rad/s²] up to now; all empty where there is no history.
    window : float
        Length of the strip chart [s], > 0; its right end is `time`.
    acceleration_scale : float
        Least acceleration that the chart has room for [rad/s²], > 0, so that it keeps its scale from the start on.
    exaggeration : float
        Factor by which deflections, plays and the housing's angle are drawn larger than they are [-], > 0.

    Raises
    ------
    ParameterError
        A value that breaks its rule; histories of unequal length.
    """

    cam_angle: float
    table_angle: float
    housing_angle: float
    stations: int
    motion_law: MotionLaw = field(default_factory=ModifiedSine)
    motion_share: float = 0.5
    deflections: tuple[float, float, float] = (0.0, 0.0, 0.0)
    half_plays: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cracked_stations: tuple[int, ...] = ()
    loose_screws: bool = False
    dwell: bool = False
    time: float = 0.0
    history_time: np.ndarray = field(default_factory=_none)
    acceleration: np.ndarray = field(default_factory=_none)
    theoretical_acceleration: np.ndarray = field(default_factory=_none)
    window: float = 2.0
    acceleration_scale: float = 1.0
    exaggeration: float = 25.0

    def __post_init__(self) -> None:
        for name in ("cam_angle", "table_angle", "housing_angle"):
            check_number("Scene", name, getattr(self, name), unit="rad")
        check_integer("Scene", "stations", self.stations, low=2, high=1000)
        if not isinstance(self.motion_law, MotionLaw):
            raise refuse("Scene", "motion_law", "a MotionLaw", self.motion_law, "see indexer_env.motion_law")
        check_number("Scene", "motion_share", self.motion_share, low=0.0, low_open=True, high=1.0)
        for name, low in (("deflections", None), ("half_plays", 0.0)):
            values = getattr(self, name)
            if not isinstance(values, tuple) or len(values) != 3:
                raise refuse("Scene", name, "a tuple of three angles in rad, of joints 1, 2 and 3", values)
            for value in values:
                check_number("Scene", name, value, low=low, unit="rad")
        if not isinstance(self.cracked_stations, tuple):
            raise refuse("Scene", "cracked_stations", "a tuple of stations", self.cracked_stations)
        for station in self.cracked_stations:
            check_integer("Scene", "cracked_stations", station, low=0, high=self.stations - 1)
        for name in ("loose_screws", "dwell"):
            if not isinstance(getattr(self, name), (bool, np.bool_)):
                raise refuse("Scene", name, "True or False", getattr(self, name))
        check_number("Scene", "time", self.time, unit="s")
        check_number("Scene", "window", self.window, low=0.0, low_open=True, unit="s")
        check_number("Scene", "acceleration_scale", self.acceleration_scale, low=0.0, low_open=True, unit="rad/s²")
        check_number("Scene", "exaggeration", self.exaggeration, low=0.0, low_open=True)
        self._check_history()

    def _check_history(self) -> None:
        for name in ("history_time", "acceleration", "theoretical_acceleration"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.ndim != 1 or len(values) != len(self.history_time):
                rule = "one-dimensional and as long as history_time"
                raise refuse("Scene", name, rule, values.shape, "give all three histories sample by sample")
            if not np.isfinite(values).all():
                raise refuse("Scene", name, "finite", float(values[~np.isfinite(values)][0]))
            object.__setattr__(self, name, values)

    @property
    def station(self) -> int:
        """Station that the cam last left or dwells at, counted on over the turns of the table."""
        return math.floor(self.cam_angle / (2.0 * math.pi)) + int(self.dwell)


def scene_from(
    machine: Machine,
    sample: Mapping[str, float],
    *,
    time: float = 0.0,
    operating_point: OperatingPoint | None = None,
    history: Mapping[str, ArrayLike] | None = None,
    window: float | None = None,
    exaggeration: float = 25.0,
) -> Scene:
    """The scene of one sample of a simulated machine.

    The theoretical acceleration is that of a rigid machine without play at nominal speed, β''(α) α̇² with α = τγ and
    α̇ = τ·(commanded motor speed).

    Parameters
    ----------
    machine : Machine
        With its effects: they say which rollers are cracked, how large the plays are, whether the screws are loose.
    sample : mapping of str to float
        The channels now: cam_angle, table_angle, housing_angle, deflection_1, deflection_2, deflection_3 [rad];
        others are passed over.
    time : float
        Time of the sample [s].
    operating_point : OperatingPoint, optional
        Whose motor speed is the nominal one; the reference one where not given.
    history : mapping of str to array_like (n,), optional
        time [s], motor_angle [rad], table_acceleration [rad/s²], rising in time; others are passed over, and so is
        what lies after `time` or before the window.
    window : float, optional
        Length of the strip chart [s]; two cam turns at nominal speed where not given.
    exaggeration : float
        See `Scene`.

    Raises
    ------
    ParameterError
        A channel that is missing, a value that breaks its rule.
    """
    _check_present("sample", sample, _NOW)
    point = operating_point or OperatingPoint()
    numbers = coefficients(machine, point)
    cam_turns = float(sample["cam_angle"]) / (2.0 * math.pi)
    if window is None:
        window = 2.0 * machine.turn_duration(point) / machine.stations
    check_number("scene_from", "time", time, unit="s")
    check_number("scene_from", "window", window, low=0.0, low_open=True, unit="s")
    past, acceleration, theory = _histories(machine, point, history, time - window, time)
    return Scene(
        cam_angle=float(sample["cam_angle"]),
        table_angle=float(sample["table_angle"]),
        housing_angle=float(sample["housing_angle"]),
        stations=machine.stations,
        motion_law=machine.motion_law,
        motion_share=machine.motion_share,
        deflections=(
            float(sample["deflection_1"]),
            float(sample["deflection_2"]),
            float(sample["deflection_3"]),
        ),
        half_plays=(_half_play(numbers, 1), _half_play(numbers, 2), _half_play(numbers, 3)),
        cracked_stations=_cracked_stations(machine, numbers),
        loose_screws=any(effect.name == "base.looseness" and not effect.is_null for effect in machine.effects),
        dwell=_dwells(cam_turns - math.floor(cam_turns), numbers),
        time=time,
        history_time=past,
        acceleration=acceleration,
        theoretical_acceleration=theory,
        window=window,
        acceleration_scale=_ROOM * _theoretical_peak(machine, point, numbers),
        exaggeration=exaggeration,
    )


def _check_present(name: str, mapping: Mapping[str, object], needed: tuple[str, ...]) -> None:
    missing = [channel for channel in needed if channel not in mapping]
    if missing:
        raise ParameterError(
            f"scene_from.{name} must hold {', '.join(needed)}, got none of {', '.join(missing)}; "
            "record with Run(channels=SCENE_CHANNELS)."
        )


def _half_play(numbers: Coefficients, joint: int) -> float:
    # a model that lacks the joint lacks its edges too
    return numbers[f"edge_{joint}"] if numbers.features & (HAS_EDGES_1 << (joint - 1)) else 0.0


def _dwells(phase: float, numbers: Coefficients) -> bool:
    moves = (low <= place < high for low, high in numbers.law.motions for place in (phase, phase + 1.0))
    return not any(moves)


def _theoretical_peak(machine: Machine, point: OperatingPoint, numbers: Coefficients) -> float:
    """Largest theoretical acceleration, Ca h (α̇ / 2πf)² [rad/s²]; f is the law's own share of motion."""
    cam_rate = machine.reduction * point.motor_speed
    share = sum(high - low for low, high in numbers.law.motions)
    return machine.motion_law.peaks().acceleration * machine.advance * (cam_rate / (2.0 * math.pi * share)) ** 2


def _cracked_stations(machine: Machine, numbers: Coefficients) -> tuple[int, ...]:
    if numbers["ratio_2"] < 1.0:
        return tuple(range(machine.stations))
    if numbers["single_ratio_2"] < 1.0:
        return (int(numbers["single_station"]),)
    return ()


def _histories(
    machine: Machine, point: OperatingPoint, history: Mapping[str, ArrayLike] | None, first: float, last: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if history is None:
        return _none(), _none(), _none()
    _check_present("history", history, _HISTORY)
    past, motor, acceleration = (np.asarray(history[name], dtype=np.float64) for name in _HISTORY)
    if not past.shape == motor.shape == acceleration.shape or past.ndim != 1:
        shapes = (past.shape, motor.shape, acceleration.shape)
        raise refuse("scene_from", "history", "three arrays (n,) of one length", shapes)
    # half a microsecond: times are whole samples, computed by division
    shown = slice(*np.searchsorted(past, (first - 5e-7, last + 5e-7)))
    _, _, beta_2 = machine.motion_law.evaluate(motor[shown] * machine.reduction, machine.stations, machine.motion_share)
    theory = beta_2 * (machine.reduction * point.motor_speed) ** 2
    return past[shown].copy(), acceleration[shown].copy(), theory
