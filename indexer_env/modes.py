"""The linearised machine: natural frequencies by cam angle, and what step resolves the fastest of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env.coefficients import Coefficients, coefficients
from indexer_env.errors import ParameterError
from indexer_env.kernels import layout
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint

LARGEST_PHASE_STEP = 0.25
"""h ω of the fastest mode may not exceed this [rad]: 25 steps a period."""

LARGEST_DECAY_STEP = 1.0
"""h λ of the fastest decay may not exceed this [-]; the scheme turns unstable at 2.78."""

ACCURATE_SHARES = (0.8, 0.2)
"""The automatic step over those that resolve the fastest mode and the fastest decay: h ω ≤ 0.2 rad, h λ ≤ 0.2. The
error goes with the step's fourth power; at half and twice of it it is a sixteenth and sixteen times as large."""

MOTION_STEPS = 400
"""Least steps in a motion of the cam: with fewer, what the law's own time scale adds to the error begins to count."""

HARMONIC_PHASE = 0.4
"""Most that the phase of a drive's harmonic goes on in an automatic step [rad]."""

HARMONIC_ERROR = 0.09
"""The same times d^(1/4), where the harmonic changes the cam's speed by the share d: its error goes with d times the
fourth power of that phase, and at 0.09 is some 5e-6 of the motion."""

LARGE_RIPPLE = 0.01
"""Share of the motor's speed in its ripple from which on half the step is needed: what the ripple shakes then outweighs
the motion, by which the error is measured."""

RATTLING = 200.0
"""ω T of the fastest mode over a motion of the cam [rad] from which on half the step is needed with play: the record of
so slow a motion is the rattling itself, whose error grows from contact to contact."""

FINEST_STEP = 0.25e-3
"""s; the automatic step is no finer: a machine that needs that for the accuracy gets this one, and is refused where it
does not resolve its fastest mode. What takes longer than usual is asked for by name."""

PULSE_STEPS = 16
"""Least automatic steps in half the width of a process torque or of a bump on the cam: with 9 the error of a bump of
0.3° that is 3.6° of the cam wide on either side is 8e-5 of the motion."""

_SLOW = 1e-9
"""1/s; stands for no decay at all."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of the linearised machine.

    Attributes
    ----------
    cam_angle : ndarray (n,)
        [rad].
    frequency_hz : ndarray (n, d)
        Undamped natural frequencies [Hz], ascending; d = 1, 2 or 3 with the model.
    damping_ratio : ndarray (n, d)
        Damping ratio of each mode [-], from the mode's own damping (exact for light damping).
    """

    cam_angle: np.ndarray
    frequency_hz: np.ndarray
    damping_ratio: np.ndarray


def natural_frequencies(machine: Machine, cam_angle: float | np.ndarray = 0.0) -> Modes:
    """Natural frequencies of the machine about rest at given cam angles, every joint in contact on its stiffer flank,
    the reducer's mesh without friction.

    M q̈ + R q̇ + K q = 0 in q = (α, φ, θ) with δ1 = -α, δ2 = φ - β'α - θ, δ3 = θ::

        M = [[J_C + J_F β'², 0, J_F β'], [0, J_t, 0], [J_F β', 0, J_F + J_b]],   K = Σ k_j v_j v_jᵀ,   v_j = ∂δ_j/∂q

    Parameters
    ----------
    machine : Machine
    cam_angle : float or ndarray (n,)
        [rad]; β' of the law at these angles enters, effects on the law do not.

    Returns
    -------
    Modes

    Raises
    ------
    ParameterError
        An effect that does not fit the machine.
    """
    angles = np.atleast_1d(np.asarray(cam_angle, dtype=float))
    item = coefficients(machine, OperatingPoint())
    _, slope, _ = machine.motion_law.evaluate(angles, machine.stations, machine.motion_share)
    inertia, damping, stiffness = _matrices(item.model, item.__getitem__, np.asarray(slope))
    squares, shapes = (np.real(part) for part in np.linalg.eig(np.linalg.solve(inertia, stiffness)))
    order = np.argsort(squares, axis=-1)
    squares = np.take_along_axis(squares, order, axis=-1)
    shapes = np.take_along_axis(shapes, order[:, None, :], axis=-1)
    omega = np.sqrt(squares)
    modal_damping = np.einsum("nij,nik,nkj->nj", shapes, damping, shapes)
    modal_inertia = np.einsum("nij,nik,nkj->nj", shapes, inertia, shapes)
    return Modes(angles, omega / (2.0 * math.pi), modal_damping / (2.0 * omega * modal_inertia))


def _matrices(
    model: int, value: Callable[[str], float | np.ndarray], slope: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, R, K (n, d, d) at the law's slopes β' (n,), reduced to the model's coordinates.

    `value` gives a coefficient by name, one for all or (n,).
    """
    n, one, zero = len(slope), np.ones_like(slope), np.zeros_like(slope)
    gradients = (
        np.stack([-one, zero, zero], axis=-1),
        np.stack([-slope, one, -one], axis=-1),
        np.stack([zero, zero, one], axis=-1),
    )
    inertia, damping, stiffness = np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    inertia[:, 0, 0] = value("cam_inertia") + value("follower_inertia") * slope**2
    inertia[:, 0, 2] = inertia[:, 2, 0] = value("follower_inertia") * slope
    inertia[:, 1, 1] = value("table_inertia")
    inertia[:, 2, 2] = value("follower_inertia") + value("housing_inertia")
    for number, gradient in enumerate(gradients, start=1):
        square = gradient[:, :, None] * gradient[:, None, :]
        damping += np.reshape(value(f"damping_{number}"), (-1, 1, 1)) * square
        stiffness += np.reshape(value(f"stiffness_{number}"), (-1, 1, 1)) * square
    kept = {layout.MODEL_A: [1], layout.MODEL_B: [0, 1], layout.MODEL_B_ON_BASE: [0, 1, 2]}[model]
    index = np.ix_(range(n), kept, kept)
    return inertia[index], damping[index], stiffness[index]


def largest_steps(items: Sequence[Coefficients]) -> np.ndarray:
    """The largest step (n,) [s] that resolves fastest mode and fastest decay of each of n items of one model."""
    return np.minimum(*_resolving_steps(items, _columns(items)))


def coarse_step(owner: str, machine: Machine, item: Coefficients, step: float) -> ParameterError:
    """What to say of a step [s] that does not resolve a machine's fastest mode or its fastest decay."""
    mode, decay = (float(most[0]) for most in _resolving_steps([item], _columns([item])))
    limits = f"mode of {machine.name} (phase per step <= {LARGEST_PHASE_STEP} rad)", f"decay of {machine.name}"
    remedy = f"got {step:.3g} s; set step to {0.9 * min(mode, decay):.2g}"
    what = limits[0] if mode <= decay else f"{limits[1]} (step over its time constant <= {LARGEST_DECAY_STEP:g})"
    return ParameterError(f"{owner}.step must be <= {min(mode, decay):.3g} s to resolve the fastest {what}, {remedy}.")


def _columns(items: Sequence[Coefficients]) -> dict[str, np.ndarray]:
    """Coefficients of n items by their names, (n,) each."""
    return dict(zip(layout.COEFFICIENT_NAMES, np.stack([item.row for item in items]).T, strict=True))


def _resolving_steps(items: Sequence[Coefficients], columns: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The largest steps (n,) [s] that resolve the fastest mode and the fastest decay of each of n items of one model,
    in the dwell and where the law is steepest. Cubic hardening does not count: its stiffness depends on the motion; a
    torque that is tabulated over the output joint's deflection counts where it is steepest."""
    springs, dampers = _steepest_tables(columns)
    rubbing = 1.0 / (1.0 - columns["mesh_friction"])
    stiffness = rubbing * columns["stiffness_1"] * (1.0 + columns["mesh_depth"])
    columns = columns | {
        "stiffness_1": stiffness, "damping_1": rubbing * columns["damping_1"],
        "stiffness_2": columns["stiffness_2"] + springs,
    }  # fmt: skip
    omega, decay = np.zeros(len(items)), np.zeros(len(items))
    for slope in (np.zeros(len(items)), np.array([item.law.steepest for item in items])):
        inertia, damping, stiffness = _matrices(items[0].model, columns.__getitem__, slope)
        squares = np.abs(np.linalg.eigvals(np.linalg.solve(inertia, stiffness))).max(axis=1)
        omega = np.maximum(omega, np.sqrt(squares))
        decay = np.maximum(decay, np.abs(np.linalg.eigvals(np.linalg.solve(inertia, damping))).max(axis=1))
    slipping = np.array([bool(item.features & layout.USES_SLIP) for item in items])
    decay = np.maximum(decay, _decay_of_loads(columns, slipping, dampers))
    return LARGEST_PHASE_STEP / omega, LARGEST_DECAY_STEP / decay


def _decay_of_loads(columns: Mapping[str, np.ndarray], slipping: np.ndarray, tabulated: np.ndarray) -> np.ndarray:
    """Fastest decay (n,) [1/s] by friction on the table, what is `tabulated` of it included, and by the slip of the
    motors that are `slipping`, (n,) each."""
    friction = (
        columns["coulomb_torque"] / columns["coulomb_speed"]
        + columns["viscous"]
        + columns["stribeck_torque"] / columns["stribeck_smoothing"]
        + tabulated
    )
    slip = np.where(slipping, 1.0 / (columns["slip_compliance"] * columns["motor_inertia"]), 0.0)
    return np.maximum.reduce([friction / columns["table_inertia"], slip, np.full(len(slipping), _SLOW)])


def quick_steps(
    model: int, features: int, rows: np.ndarray, steepest: float, speed: float, phase: float, decay: float
) -> np.ndarray:
    """Steps h (n,) [s] that resolve some coefficients (n, c) of one model and features each, found quickly.

    h ω ≤ phase [rad] for the fastest mode and for what the drive does at orders of a motor of this `speed` [rad/s], and
    h λ ≤ decay for the fastest decay, in the dwell and where the law's slope is `steepest` [-]. Modes and decays are
    bounded as in `largest_steps`, but from below: the largest eigenvalues of M⁻¹K and M⁻¹R are at most the traces
    Σ k_j μ_j and Σ r_j μ_j, with μ_j = v_jᵀM⁻¹v_j the mobility of joint j.
    """
    columns = dict(zip(layout.COEFFICIENT_NAMES, rows.T, strict=True))
    rubbing = 1.0 / (1.0 - columns["mesh_friction"])
    stiffness_1 = rubbing * columns["stiffness_1"] * (1.0 + columns["mesh_depth"])
    springs, dampers = _steepest_tables(columns)
    stiffness = stiffness_1, columns["stiffness_2"] + springs, columns["stiffness_3"]
    damping = rubbing * columns["damping_1"], columns["damping_2"], columns["damping_3"]
    orders = (np.where(columns[name] != 0.0, columns[f"{kind}_order"], 0.0) for kind, name in _HARMONICS)
    square = (np.maximum.reduce([*orders]) * speed) ** 2
    rate = _decay_of_loads(columns, np.full(len(rows), bool(features & layout.USES_SLIP)), dampers)
    for slope in (0.0, steepest):
        mobilities = _mobilities(model, columns, slope)
        square = np.maximum(square, sum(k * m for k, m in zip(stiffness, mobilities, strict=False)))
        rate = np.maximum(rate, sum(r * m for r, m in zip(damping, mobilities, strict=False)))
    return np.minimum(phase / np.sqrt(square), decay / rate)


def _mobilities(model: int, columns: Mapping[str, np.ndarray], slope: float) -> tuple[np.ndarray | float, ...]:
    """v_jᵀM⁻¹v_j of the joints of a model where the law's slope is β'."""
    table, cam, followers, housing = (
        columns[name] for name in ("table_inertia", "cam_inertia", "follower_inertia", "housing_inertia")
    )
    if model == layout.MODEL_A:
        return 0.0, 1.0 / table
    turned = cam + followers * slope**2
    if model == layout.MODEL_B:
        return 1.0 / turned, 1.0 / table + slope**2 / turned
    determinant = cam * (followers + housing) + followers * housing * slope**2
    return (
        (followers + housing) / determinant,
        1.0 / table + (housing * slope**2 + cam) / determinant,
        turned / determinant,
    )


def _steepest_tables(columns: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Largest slopes (n,) of a torque that is tabulated, else 0: over the output joint's deflection [N m/rad], and over
    its rate or the table's speed [N m s/rad]."""
    springs, dampers = np.zeros((2, len(columns["tabulated_over_1"])))
    for k in np.flatnonzero(columns["tabulated_over_1"] >= 0.0).tolist():
        own = {name: float(columns[f"tabulated_{name}"][k]) for name in _TABLE_NUMBERS}
        lines = int(own["count_2"]) if own["stride"] else 1
        size = int(own["count_1"]) * lines
        spline = np.array([columns[f"tabulated_{n}"][k] for n in range(size)]).reshape(lines, -1)
        for n, over in ((1, own["over_1"]), (2, own["over_2"])):
            if over in (0.0, 3.0, 4.0):
                found = springs if over == 3.0 else dampers
                found[k] = float(np.abs(np.diff(spline, axis=2 - n)).max()) * own[f"per_{n}"]
    return springs, dampers


_TABLE_NUMBERS = ("over_1", "over_2", "per_1", "per_2", "count_1", "count_2", "stride")


def steps_of(items: Sequence[Coefficients], points: Sequence[OperatingPoint]) -> tuple[np.ndarray, np.ndarray]:
    """The largest step (n,) [s] of each of n items of one model, as by `largest_steps`, and its automatic one (n,) [s]:
    ACCURATE_SHARES of the largest ones, MOTION_STEPS to a motion of the cam, PULSE_STEPS to half the width of what acts
    in a part of it, HARMONIC_PHASE and HARMONIC_ERROR to a step at the drive's orders; half of it with hardening
    contact, a LARGE_RIPPLE or RATTLING; never finer than FINEST_STEP."""
    columns = _columns(items)
    largest = _resolving_steps(items, columns)
    speed = np.maximum(np.abs([point.motor_speed for point in points]), _SLOW)
    cam_speed = columns["reduction"] * speed
    motion = np.array([item.law.motion for item in items]) / cam_speed
    pulse = np.minimum.reduce([
        np.where(columns[size] != 0.0, 2.0 * math.pi * columns[width] / cam_speed, math.inf) for size, width in _PULSES
    ])  # fmt: skip
    harmonic = [
        np.where(size != 0.0, order * np.maximum(1.0 / HARMONIC_PHASE, share**0.25 / HARMONIC_ERROR), _SLOW)
        for size, order, share in (_harmonic(columns, kind, name) for kind, name in _HARMONICS)
    ]
    steps = np.minimum.reduce([
        *(share * step for share, step in zip(ACCURATE_SHARES, largest, strict=True)),
        motion / MOTION_STEPS, pulse / PULSE_STEPS, 1.0 / (np.maximum.reduce(harmonic) * speed),
    ])  # fmt: skip
    edges = np.array([bool(item.features & ~layout.USES_ANY_EFFECT) for item in items])
    rattling = edges & (LARGEST_PHASE_STEP * motion > RATTLING * largest[0])
    ripple = _harmonic(columns, *_HARMONICS[0])[2] > LARGE_RIPPLE
    half = (columns["cubic_2"] != 0.0) | ripple | rattling
    return np.minimum(*largest), np.maximum(np.where(half, 0.5, 1.0) * steps, FINEST_STEP)


def _harmonic(columns: dict[str, np.ndarray], kind: str, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size of a harmonic, its order, and by what share it changes the cam's speed: nothing, if it is the mesh's."""
    size, order = columns[name], columns[f"{kind}_order"]
    return size, order, np.zeros(len(size)) if kind == "mesh" else np.abs(size) * order / columns["reduction"]


_HARMONICS = (
    ("ripple", "ripple_amplitude"), ("transmission", "transmission_amplitude"), ("mesh", "mesh_depth"),
)  # fmt: skip
"""Effects at orders of the motor, and the coefficient of their size."""

_PULSES = (("process_torque", "process_half_width"), ("bump_height", "bump_half_width"))
"""Effects that act in a part of the cam turn: coefficients of their size, and of half their width [cam turns]."""
