"""Signals that a drive measures itself, beside the table's acceleration: the motor's torque and current, two encoders.

    torque    T = u M1 + J_m γ̈          on the motor shaft: what the input joint takes, and the rotor; u is the ratio τ,
                                        with the derivative by γ of what ripples on the drive side where it does; where
                                        the mesh rubs (`drive.mesh_friction`) M1 is that before its loss
    current   I = T / k_T + n            k_T the motor's torque constant, n white noise
    encoder   round(x N / 2π) 2π / N     angle within a turn, [0, 2π), of N counts a turn

A servo drive offers these without a sensor being mounted. Source: M. P. Groover, Industrial robotics (2012), ch. 3, for
the torque constant. J_m counts where the speed of the motor changes (effect `drive.slip`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from indexer_env.checks import check_choice, check_integer, check_number
from indexer_env.effects.drive import MeshFriction, SpeedRipple, TransmissionError
from indexer_env.errors import refuse
from indexer_env.machine import Machine

SIGNALS: dict[str, tuple[str, tuple[str, ...]]] = {
    "motor_torque": ("N m", ("torque_1", "region_1", "motor_angle", "motor_acceleration")),
    "motor_current": ("A", ("torque_1", "region_1", "motor_angle", "motor_acceleration")),
    "motor_angle": ("rad", ("motor_angle",)),
    "table_angle": ("rad", ("table_angle",)),
}
"""Unit of each signal, and the channels of `trajectory.CHANNELS` that it is made of."""

TURN = 2.0 * math.pi
MOST_COUNTS = 2**24
"""Counts a turn that a float32 can tell apart."""


@dataclass(frozen=True)
class DriveSensors:
    """Which signals of the drive are read, and how.

    Attributes
    ----------
    signals : tuple of str
        Of SIGNALS; () for none.
    torque_constant : float
        k_T [N m/A], > 0.
    current_noise_density : float
        One-sided density of the current's noise [A/√Hz], >= 0.
    motor_counts, table_counts : int or None
        Counts in a turn of the encoder on the motor and on the table, 2 to 2^24; None: as fine as float32.

    Raises
    ------
    ParameterError
    """

    signals: tuple[str, ...] = ()
    torque_constant: float = 1.0
    current_noise_density: float = 0.0
    motor_counts: int | None = None
    table_counts: int | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.signals, list | tuple):
            raise refuse("DriveSensors", "signals", f"a list of some of {', '.join(SIGNALS)}", self.signals)
        object.__setattr__(self, "signals", tuple(self.signals))
        for name in self.signals:
            check_choice("DriveSensors", "signals", name, SIGNALS)
            if self.signals.count(name) > 1:
                raise refuse("DriveSensors", "signals", "a list that names each signal once", list(self.signals))
        check_number("DriveSensors", "torque_constant", self.torque_constant, low=0.0, low_open=True, unit="N m/A")
        density = self.current_noise_density
        check_number("DriveSensors", "current_noise_density", density, low=0.0, unit="A/sqrt(Hz)")
        for name in ("motor_counts", "table_counts"):
            if getattr(self, name) is not None:
                check_integer("DriveSensors", name, getattr(self, name), low=2, high=MOST_COUNTS)

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that a simulation must record for these signals."""
        return tuple(dict.fromkeys(channel for name in self.signals for channel in SIGNALS[name][1]))

    @property
    def noisy(self) -> bool:
        """Whether a reading needs a random generator."""
        return "motor_current" in self.signals and self.current_noise_density > 0.0

    def check_machine(self, machine: Machine) -> None:
        """Raise ParameterError for a machine whose motor's torque the model does not give."""
        if machine.model == "A" and {"motor_torque", "motor_current"} & set(self.signals):
            rule = "free of motor_torque and motor_current for a machine of Model A, which has no input joint"
            raise refuse("DriveSensors", "signals", rule, list(self.signals), "set machine.model to B")

    def read(
        self,
        machine: Machine,
        channels: Mapping[str, np.ndarray],
        sample_rate: float,
        rng: np.random.Generator | None = None,
    ) -> dict[str, np.ndarray]:
        """The signals (n,) float32 of one machine by name, in the units of SIGNALS.

        Parameters
        ----------
        machine : Machine
        channels : mapping
            Those of `channels` (n,).
        sample_rate : float
            Of the channels [Hz].
        rng : Generator or None
            Source of the noise, a standard normal for each sample; None without noise.
        """
        self.check_machine(machine)
        if any(name not in channels for name in self.channels):
            rule = f"a mapping with {', '.join(self.channels)}"
            raise refuse("DriveSensors.read", "channels", rule, list(channels), "record Run(channels=sensors.channels)")
        found: dict[str, np.ndarray] = {}
        if {"motor_torque", "motor_current"} & set(self.signals):
            taken = channels["torque_1"] * (1.0 + _friction(machine) * channels["region_1"])
            lever = _lever(machine, channels["motor_angle"])
            torque = lever * taken + machine.motor_inertia * channels["motor_acceleration"]
            found["motor_torque"] = torque
            found["motor_current"] = torque / self.torque_constant
            if self.noisy:
                if rng is None:
                    raise refuse("DriveSensors.read", "rng", "a numpy.random.Generator, as the current has noise", None)
                sigma = self.current_noise_density * math.sqrt(sample_rate / 2.0)
                found["motor_current"] += sigma * rng.standard_normal(torque.size)
        for name, counts in (("motor_angle", self.motor_counts), ("table_angle", self.table_counts)):
            if name in self.signals:
                found[name] = _encoded(channels[name], counts)
        return {name: found[name].astype(np.float32) for name in self.signals}


def _encoded(angle: np.ndarray, counts: int | None) -> np.ndarray:
    """An angle [rad] as an absolute encoder reads it within its turn."""
    share = np.mod(angle / TURN, 1.0)
    if counts is not None:
        share = np.mod(np.rint(share * counts), counts) / counts
    return TURN * share


def _friction(machine: Machine) -> float:
    """κ of the reducer's mesh [-], 0 where it does not rub."""
    return sum(effect.friction for effect in machine.effects if isinstance(effect, MeshFriction))


def _lever(machine: Machine, angle: np.ndarray) -> np.ndarray | float:
    """Derivative of the drive side's angle by the motor's [-], at motor angles (n,) [rad]."""
    lever: np.ndarray | float = machine.reduction
    for effect in machine.effects:
        if isinstance(effect, SpeedRipple):
            lever = lever + machine.reduction * effect.depth * np.cos(effect.order * angle + effect.phase)
        if isinstance(effect, TransmissionError):
            lever = lever + effect.amplitude * effect.order * np.cos(effect.order * angle + effect.phase)
    return lever
