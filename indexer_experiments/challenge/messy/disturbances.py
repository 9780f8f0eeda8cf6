"""Disturbances that no effect of the library describes: mechanisms of real machines, each with the joint and kind it
belongs to, and the half of the challenge that draws it.

Sizes are relative to the machine's own scales, so that a machine a hundred times as heavy gets the same motion:

    T0 = J_t h C ω²,  V0 = 1.8 h ω,  ω = cam rate/(2π motion share),  C = 5.5        peak torque and rate of the table

The halves. What a method is tuned on must not be what it is judged by, yet both halves must ask the same of it. So
kinds stand in pairs, alike in joint or in what they vary with, and one of each pair went to either half: drags that
grow with the square of a rate, differences between stations, changes with time, fixed frequencies, marks on the cam's
phase, forces with a memory, the input side, the sensor, the base. A threshold tuned on one of a pair helps with the
other only if it is about mechanics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from indexer_env.machine import Machine
from indexer_experiments.challenge.messy.reading import Reader, cabled, drifting, shocked, tilted
from indexer_experiments.challenge.unlisted import Bump, Wave
from indexer_experiments.tables import table

HALVES = ("tune", "judge")

JOINTS = ("input", "output", "base", "sensor")
"""Where a disturbance acts: drive, reducer and input shaft; indexer, output shaft and table; base; measuring chain. One
accelerometer on the table cannot tell a torque on the table from one of joint 2, so the two are one."""

KINDS = ("phase", "station", "speed", "time", "frequency")
"""What it varies with: cam phase, table angle or station, speed (within a record or between records), time (not locked
to any turn), a fixed frequency."""

_TURN = 2.0 * math.pi

Shape = Mapping[str, float]


@dataclass(frozen=True)
class Scene:
    """What a disturbance is scaled by: the machine, its slowest cam rate [rad/s] and its longest record [s]."""

    machine: Machine
    cam_rate: float
    duration: float

    @property
    def omega(self) -> float:
        """Cam rate over the motion's share of a turn [rad/s]."""
        return self.cam_rate / (_TURN * self.machine.motion_share)

    @property
    def rate(self) -> float:
        """V0 [rad/s]."""
        return 1.8 * self.machine.advance * self.omega

    @property
    def torque(self) -> float:
        """T0 [N m]."""
        return 5.5 * self.machine.table_inertia * self.machine.advance * self.omega**2

    @property
    def deflection(self) -> float:
        """T0 over the stiffness of joint 2 [rad]."""
        return self.torque / self.machine.output_joint.stiffness


Fields = Callable[[float, Shape, Scene], dict[str, Any]]
Read = Callable[[float, Shape, Scene, np.random.Generator], Reader]


@dataclass(frozen=True)
class Kind:
    """One kind of disturbance.

    Attributes
    ----------
    name, sentence, equation : str
    half, joint : str
        Of HALVES and of JOINTS.
    kinds : tuple of str
        Of KINDS: what it varies with; an answer that names one of them is right.
    shape : mapping
        Uniform law of each number that gives its shape.
    unit : float
        Size from which the search for the right one begins.
    fields : callable or None
        Its numbers in `Unlisted`, given size, shape and scene.
    reader : callable or None
        What it does to a reading, where it acts on the sensor.
    most : float
        Largest size that is still this mechanism.
    """

    name: str
    sentence: str
    equation: str
    half: str
    joint: str
    kinds: tuple[str, ...]
    shape: Mapping[str, tuple[float, float]]
    unit: float
    fields: Fields | None = None
    reader: Read | None = None
    most: float = math.inf


def _sine(q: Shape) -> dict[str, float]:
    return {"order": _TURN * q["hertz"], "phase": q["phase"]}


_PHASE = (0.0, _TURN)

KINDS_OF_DISTURBANCE = (
    Kind(
        "drag.quadratic", "Air drag of the fixtures grows with the square of the table's speed.",
        "T_L += c φ̇|φ̇|", "tune", "output", ("speed", "phase"), {}, 0.02,
        lambda a, q, s: {"quadratic": a * s.torque / s.rate**2},
    ),
    Kind(
        "damping.rate_squared", "The oil film in the indexer damps with the square of the rate.",
        "M2 += c δ̇2|δ̇2|", "judge", "output", ("speed", "phase"), {}, 0.05,
        lambda a, q, s: {"rate_squared": a * s.torque / s.rate**2 * 100.0},
    ),
    Kind(
        "inertia.by_station", "Workpieces of different mass: the table's inertia differs from station to station.",
        "J_t → J_t (1 + e (2 u_s - 1)), u_s random in 0 to 1 for each station", "tune", "output", ("station",),
        {}, 0.02,
        lambda a, q, s: {"inertia": a, "stations": float(s.machine.stations)}, most=0.5,
    ),
    Kind(
        "friction.position", "A dry patch of the table's seal rubs over part of the table's turn.",
        "T_L += T_p (1 - y²)⁴ s/√(1+s²), y = (φ/2π - centre)/half_width, s = φ̇/0.005", "judge", "output",
        ("station",), {"centre": (0.0, 1.0), "half_width": (0.1, 0.25)}, 0.05,
        lambda a, q, s: {"patch": Bump(a * s.torque, q["centre"], q["half_width"])},
    ),
    Kind(
        "stiffness.warming", "Joint 2 carries less as the housing warms up and its rollers lose preload.",
        "M2 → M2 (1 - a (1 - e^{-t/τ}))", "tune", "output", ("time",), {"time": (0.2, 0.8)}, 0.02,
        lambda a, q, s: {"warming": a, "warming_time": q["time"] * s.duration}, most=0.6,
    ),
    Kind(
        "stick.intermittent", "The table bearing sticks in some cam turns, as its lubrication fails now and then.",
        "T_L += T_s s/√(1+s²) in a random share of the cam turns, s = φ̇/0.005", "judge", "output", ("time",),
        {"share": (0.2, 0.5)}, 0.03,
        lambda a, q, s: {"stick": a * s.torque, "sticking": q["share"]},
    ),
    Kind(
        "torque.beating", "Two pumps nearby shake the table at two close frequencies, which beat.",
        "T_L += T_b (sin 2πf t + sin 2π(f + Δf) t)", "tune", "output", ("frequency", "time"),
        {"hertz": (9.0, 30.0), "apart": (0.3, 1.2)}, 0.005,
        lambda a, q, s: {
            "beat": a * s.torque, "beat_low": _TURN * q["hertz"], "beat_high": _TURN * (q["hertz"] + q["apart"]),
        },
    ),
    Kind(
        "mass.loose", "A tool hangs on the table by a soft clamp and swings against it.",
        "J_a ẍ = -k_a(x - φ) - c_a(ẋ - φ̇), T_L += k_a(φ - x) + c_a(φ̇ - ẋ)", "judge", "output",
        ("frequency", "phase"), {"hertz": (18.0, 45.0), "damping": (0.02, 0.1)}, 0.02,
        lambda a, q, s: _mass(a * s.machine.table_inertia, _TURN * q["hertz"], q["damping"]), most=0.3,
    ),
    Kind(
        "preload.loss", "One flank of the cam is worn: at one phase of the motion its rollers lose their preload.",
        "M2 → M2 (1 - a (1 - y²)⁴), y = (cam phase - centre)/half_width", "tune", "output", ("phase",),
        {"centre": (0.2, 0.8), "half_width": (0.05, 0.12)}, 0.1,
        lambda a, q, s: {"loss": Bump(a, q["centre"] * s.machine.motion_share, q["half_width"])}, most=0.9,
    ),
    Kind(
        "cam.waviness", "Grinding left chatter marks on the cam's track.",
        "β += A sin²(π s) sin(2π m s + ψ), s = share of the motion", "judge", "output", ("phase",),
        {"order": (4.0, 9.0), "phase": _PHASE}, 0.003,
        lambda a, q, s: {"wavy": Wave(a * s.machine.advance / q["order"] ** 2, q["order"], q["phase"])},
    ),
    Kind(
        "joint.hysteresis", "A shrink fit beside joint 2 creeps and gives back less than it took.",
        "M2 += a k2 z, ż = δ̇2 - |δ̇2| z/z_y", "tune", "output", ("phase",), {"yielding": (0.05, 0.3)}, 0.05,
        lambda a, q, s: {
            "hysteresis": a * s.machine.output_joint.stiffness, "yielding": q["yielding"] * s.deflection,
        },
    ),
    Kind(
        "load.random_walk", "The process loads the table with a torque that wanders.",
        "T_L += w, ẇ = n - w/τ, n random every 5 ms, straight between", "judge", "output", ("time",),
        {"time": (0.1, 1.0)}, 0.003,
        lambda a, q, s: {"walk": a * s.torque, "walk_time": q["time"]},
    ),
    Kind(
        "inverter.beat", "The inverter's switching beats with the motor's current: a torque of fixed frequency that "
        "grows with the square of the speed.",
        "M1 += T_i (γ̇/γ̇_0)² sin(2πf t + ψ) at the cam", "tune", "input", ("frequency", "time"),
        {"hertz": (8.0, 25.0), "phase": _PHASE}, 0.02,
        lambda a, q, s: {"inverter": Wave(a * s.torque, **_sine(q))},
    ),
    Kind(
        "coupling.rubber", "The rubber star of the coupling behind the motor hardens as it is pressed.",
        "M1 → M1 (1 + a (M1/M_c)²), M_c = T0 V0/cam rate", "judge", "input", ("phase",), {}, 0.1,
        lambda a, q, s: {"rubber": a / (s.torque * s.rate / s.cam_rate) ** 2}, most=4.0,
    ),
    Kind(
        "gain.drift", "The charge amplifier's gain drifts as it warms up.",
        "y → y (1 + a (t/T - 1/2))", "tune", "sensor", ("time",), {}, 0.02,
        reader=lambda a, q, s, rng: drifting(a), most=0.5,
    ),
    Kind(
        "sensor.cable", "The sensor's cable whips at a resonance of its own and drags the sensor along.",
        "y += A s²/(s² + 2ζωs + ω²) y", "judge", "sensor", ("frequency", "phase"),
        {"hertz": (20.0, 80.0), "damping": (0.03, 0.1)}, 0.02,
        reader=lambda a, q, s, rng: cabled(a, q["hertz"], q["damping"]), most=1.0,
    ),
    Kind(
        "base.shock", "A press nearby shakes the floor now and then, and the housing rings.",
        "y += Σ_j A e^{-ζω(t-t_j)} sin ω(t-t_j), one random t_j in 1.5 s on average", "tune", "base", ("time",),
        {"hertz": (15.0, 40.0), "damping": (0.03, 0.1)}, 0.05,
        reader=lambda a, q, s, rng: shocked(a * s.torque / s.machine.table_inertia, q["hertz"], q["damping"], rng),
    ),
    Kind(
        "base.tilt", "The reaction rocks the machine on a soft floor, and the tilted sensor reads gravity.",
        "y += A ψ sin(φ + p), ψ̈ + 2ζωψ̇ + ω²ψ = ω² φ̈", "judge", "base", ("station", "frequency"),
        {"hertz": (4.0, 10.0), "damping": (0.03, 0.1), "phase": _PHASE}, 0.02,
        reader=lambda a, q, s, rng: tilted(a, q["hertz"], q["damping"], q["phase"]), most=1.0,
    ),
)  # fmt: skip
"""All kinds, the two of a pair one after the other."""

DISTURBANCES: Mapping[str, Kind] = {kind.name: kind for kind in KINDS_OF_DISTURBANCE}


def _mass(inertia: float, omega: float, damping: float) -> dict[str, float]:
    return {"mass": inertia, "mass_stiffness": inertia * omega**2, "mass_damping": 2.0 * damping * inertia * omega}


def disturbance_table() -> str:
    """All kinds with equation, joint, what they vary with and half, in Markdown."""
    rows = [
        [f"`{k.name}`", k.sentence, k.equation.replace("|", "\\|"), k.joint, ", ".join(k.kinds), k.half]
        for k in KINDS_OF_DISTURBANCE
    ]
    return table(["name", "what it is", "equation", "joint", "varies with", "half"], rows)
