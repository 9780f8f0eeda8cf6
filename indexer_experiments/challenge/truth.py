"""The truth of the challenge: a machine with what is hidden in it, solved from edge to edge, as fast as it can be."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from indexer_env.checks import check_choice
from indexer_env.compiled import fingerprint, one_version
from indexer_env.effects import Effect
from indexer_env.errors import SimulationError, refuse
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_experiments.challenge.equations import STATES, Joint, Plant
from indexer_experiments.challenge.laws import LAWS
from indexer_experiments.challenge.solver import STEPS_PER_MS, entries
from indexer_experiments.challenge.unlisted import NOTHING, Bump, Unlisted, Wave

_EQUATIONS = ("equations", "laws", "solver", "unlisted")
"""Modules whose functions the solver is compiled of."""


def true_motion(
    machine: Machine, point: OperatingPoint, samples: int, sample_rate: float
) -> tuple[np.ndarray, OperatingPoint]:
    """Table acceleration φ̈ (samples,) [rad/s²] after one table turn at the commanded speed, and the operating point as
    a once-per-turn pulse shows it: the motor's mean speed over the record, the drive's angle at its first sample.

    The machine is as `run` takes it. Validated against `indexer_env.reference.simulate_reference`.
    """
    motion = run(machine, point, samples, sample_rate)
    return motion[0], seen(machine, point, motion, sample_rate)


def turn_samples(machine: Machine, point: OperatingPoint, sample_rate: float) -> int:
    """Samples of one table turn."""
    return round(machine.turn_duration(point) * sample_rate)


def run(
    machine: Machine, point: OperatingPoint, samples: int, sample_rate: float, unlisted: Unlisted = NOTHING,
    steps_per_ms: int = STEPS_PER_MS, lead: int = 0,
) -> np.ndarray:  # fmt: skip
    """Table acceleration [rad/s²], then the state of `equations`, at each sample (1 + STATES, lead + samples), of a
    record after one table turn at the commanded speed.

    Parameters
    ----------
    machine : Machine
        Model B with a law of `LAWS`, the clipped contact law and any effects of the library that are not the sensor's.
    point : OperatingPoint
    samples : int
    sample_rate : float
        [Hz]
    unlisted : Unlisted
        What acts besides the effects.
    steps_per_ms : int
        Of the solver, >= 1.
    lead : int
        Samples of the turn before the record that are given too, from 0 to `turn_samples`; they change no bit of it.

    Raises
    ------
    ParameterError
        Another model, law or contact law.
    SimulationError
        The run left the physical range.
    """
    _check(machine)
    before = turn_samples(machine, point, sample_rate)
    numbers = plant(machine, point, unlisted)
    started, _ = compiled()
    start = started(numbers, float(point.start_angle), -before / sample_rate)
    return _finite(machine, _solved(numbers, start, before - lead, lead + samples, sample_rate, steps_per_ms))


def resumed(
    machine: Machine, point: OperatingPoint, state: np.ndarray, samples: int, sample_rate: float,
    unlisted: Unlisted = NOTHING, steps_per_ms: int = STEPS_PER_MS,
) -> np.ndarray:  # fmt: skip
    """As `run`, from a state (STATES,) on; a housing that this machine holds fast is at rest."""
    _check(machine)
    numbers, start = plant(machine, point, unlisted), np.array(state)
    if numbers.loose == 0.0:
        start[4:6] = 0.0
    return _finite(machine, _solved(numbers, start, 0, samples, sample_rate, steps_per_ms))


def seen(machine: Machine, point: OperatingPoint, motion: np.ndarray, sample_rate: float) -> OperatingPoint:
    """The operating point as a once-per-turn pulse shows it over a run's record. The table's turn before the record
    counts: the motor need not make whole turns in it, and the phases of its orders are told by its whole angle."""
    motor = motion[7]
    mean = float(motor[-1] - motor[0]) * sample_rate / (len(motor) - 1)
    return dataclasses.replace(point, motor_speed=mean, start_angle=machine.reduction * float(motor[0]))


def _solved(
    numbers: Plant, state: np.ndarray, before: int, samples: int, sample_rate: float, steps_per_ms: int
) -> np.ndarray:
    steps, interval = max(1, round(1000.0 / sample_rate * steps_per_ms)), 1.0 / sample_rate
    _, solved = compiled()
    return solved(numbers, state, before, samples, interval, steps)


@functools.lru_cache(maxsize=1)
def compiled() -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
    """The compiled `started` and `solved` of `solver.entries`."""
    own = Path(__file__).parent
    started, solved = entries(int(fingerprint([own / f"{name}.py" for name in _EQUATIONS])[:15], 16))
    numbers = plant(load_machine("reference"), OperatingPoint())
    idle = numbers, np.zeros(STATES), 0, 0, 1e-3, 1
    one_version("the challenge's solver", 8, (started, (numbers, 0.0, 0.0)), (solved, idle))
    return started, solved


def _finite(machine: Machine, motion: np.ndarray) -> np.ndarray:
    if not np.isfinite(motion).all():
        raise SimulationError(f"{machine.name} left the physical range at sample {int(np.isfinite(motion[0]).sum())}.")
    return motion


def _check(machine: Machine) -> None:
    if machine.model != "B":
        raise refuse("Machine", "model", "'B'", machine.model, "a loose base is the effect base.looseness")
    if machine.contact_law != "clipped":
        raise refuse("Machine", "contact_law", "'clipped'", machine.contact_law)
    check_choice("Machine", "motion_law", machine.motion_law.name, LAWS)


def plant(machine: Machine, point: OperatingPoint, unlisted: Unlisted = NOTHING) -> Plant:
    """The plain numbers of the equations."""
    effects: dict[str, Effect] = {effect.name: effect for effect in machine.effects}

    def of(name: str, field: str, missing: float = 0.0) -> float:
        effect = effects.get(name)
        return float(getattr(effect, field)) if effect is not None else missing

    def wave(name: str, size: str, factor: float = 1.0) -> Wave:
        return Wave(factor * of(name, size), of(name, "order", 1.0), of(name, "phase"))

    def bump(name: str, size: str) -> Bump:
        return Bump(of(name, size), of(name, "centre"), of(name, "half_width", 1.0))

    tau = machine.reduction
    rho = machine.output_joint.stiffness_ratio * (1.0 - of("roller.crack", "stiffness_loss"))
    single = 1.0 - of("roller.crack_single", "stiffness_loss")
    first, second = machine.input_joint, machine.output_joint
    g1, g2 = first.backlash + of("input.backlash", "backlash"), second.backlash + of("output.backlash", "backlash")
    compliance, slip = of("base.looseness", "compliance"), of("drive.slip", "compliance")
    k3 = 1.0 / compliance if compliance else 0.0
    carried = machine.follower_inertia + machine.housing_inertia
    ripple, loss = wave("drive.speed_ripple", "depth"), of("drive.mesh_friction", "loss")
    return _of_floats(Plant(
        J_C=machine.cam_inertia, J_F=machine.follower_inertia, J_t=machine.table_inertia,
        J_b=machine.housing_inertia, J_m=machine.motor_inertia, tau=tau, stations=float(machine.stations),
        share=machine.motion_share,
        joint_1=Joint(
            first.stiffness, first.damping, g1, first.stiffness_ratio, 0.0,
            float(g1 > 0.0 or first.stiffness_ratio < 1.0 or loss > 0.0),
        ),
        joint_2=Joint(
            second.stiffness, second.damping, g2, rho, of("output.cubic_stiffness", "stiffness"),
            float(g2 > 0.0 or rho < 1.0 or single < 1.0),
        ),
        single_rho=single, single_station=of("roller.crack_single", "station", -1.0),
        loose=float(k3 > 0.0), k3=k3, r3=2.0 * of("base.looseness", "damping_ratio") * (k3 * carried) ** 0.5,
        load=point.load_torque, coulomb=of("friction.coulomb", "torque"),
        coulomb_speed=of("friction.coulomb", "smoothing", 1.0), viscous=of("friction.viscous", "coefficient"),
        stribeck=of("friction.stribeck", "torque"), stribeck_speed=of("friction.stribeck", "speed", 1.0),
        stribeck_smoothing=of("friction.stribeck", "smoothing", 1.0),
        imbalance=of("load.imbalance", "torque"), imbalance_phase=of("load.imbalance", "phase"),
        process=bump("load.process", "torque"), profile=bump("cam.profile_error", "height"),
        spacing=of("cam.station_spacing", "error"), spacing_station=of("cam.station_spacing", "station", -1.0),
        command=point.motor_speed, slip=1.0 / slip if slip else 0.0,
        ripple=Wave(tau * ripple.size / ripple.order, ripple.order, ripple.phase),
        transmission=wave("drive.transmission_error", "amplitude"), mesh=wave("drive.mesh_stiffness", "depth"),
        mesh_friction=loss / (1.0 - loss),
        law=LAWS.index(machine.motion_law.name), unlisted=unlisted,
    ))  # fmt: skip


def _of_floats(numbers: Any) -> Any:
    """The same with whole numbers as floats, for which alone the solver is compiled."""
    return type(numbers)(*map(_of_floats, numbers)) if isinstance(numbers, tuple) else float(numbers)
