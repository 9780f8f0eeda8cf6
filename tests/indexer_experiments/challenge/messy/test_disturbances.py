"""Each disturbance does what its equation says: the challenge's solver against DOP853 on equations written out here."""

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from indexer_env import OperatingPoint, load_machine
from indexer_env.machine import Joint, Machine
from indexer_env.motion_law import motion_law
from indexer_experiments.challenge.messy.disturbances import (
    DISTURBANCES,
    HALVES,
    JOINTS,
    KINDS,
    Scene,
    disturbance_table,
)
from indexer_experiments.challenge.messy.draw import MessyOrder, Wanted, messy_draw
from indexer_experiments.challenge.messy.sizes import readers_of
from indexer_experiments.challenge.truth import resumed
from indexer_experiments.challenge.unlisted import NOTHING, chance, on_table, table_inertia, wandering

TURN = 2.0 * math.pi
MACHINE = load_machine("smooth")
POINT = OperatingPoint(motor_speed=150.0, load_torque=3.0)
SCENE = Scene(MACHINE, MACHINE.reduction * POINT.motor_speed, 2.0)
SEED = 7.0
LAW = motion_law("modified_sine")

SHAPES = {
    "friction.position": {"centre": 0.05, "half_width": 0.1}, "stiffness.warming": {"time": 0.3},
    "stick.intermittent": {"share": 0.5}, "torque.beating": {"hertz": 12.0, "apart": 0.7},
    "mass.loose": {"hertz": 25.0, "damping": 0.05}, "preload.loss": {"centre": 0.4, "half_width": 0.1},
    "cam.waviness": {"order": 5.0, "phase": 1.0}, "joint.hysteresis": {"yielding": 0.2},
    "load.random_walk": {"time": 0.3}, "inverter.beat": {"hertz": 11.0, "phase": 2.0},
}  # fmt: skip

SIZES = {name: 5.0 * kind.unit for name, kind in DISTURBANCES.items()}


def cam(alpha: float) -> tuple[float, float, float, int, float]:
    """β, β', β'', cam turn and share of the motion (1 in the dwell), by the package's own law."""
    turn = math.floor(alpha / TURN)
    b, b1, b2 = LAW.evaluate(np.array([alpha - TURN * turn]), MACHINE.stations, MACHINE.motion_share)
    s = min((alpha / TURN - turn) / MACHINE.motion_share, 1.0)
    return turn * MACHINE.advance + float(b[0]), float(b1[0]), float(b2[0]), turn, s


def dry(rate: float) -> float:
    return rate / math.hypot(rate, 0.005)


def lump(phase: float, centre: float, half_width: float) -> float:
    y = ((phase - centre + 0.5) % 1.0 - 0.5) / half_width
    return (1.0 - y * y) ** 4 if abs(y) < 1.0 else 0.0


def contact(joint: Joint, deflection: float, rate: float) -> float:
    """A spring and damper that push and never pull, with play."""
    if joint.backlash == 0.0:
        return joint.stiffness * deflection + joint.damping * rate
    side = math.copysign(1.0, deflection)
    depth = abs(deflection) - 0.5 * joint.backlash
    return side * max(joint.stiffness * depth + joint.damping * side * rate, 0.0) if depth > 0.0 else 0.0


def written_out(name: str | None, m: Machine = MACHINE) -> Callable[[float, np.ndarray], np.ndarray]:
    """dy/dt of α, α̇, φ, φ̇, γ, z, x, ẋ, w with one disturbance, from its equation in the table of kinds."""
    size, q = SIZES.get(name or "", 0.0), SHAPES.get(name or "", {})
    T0, V0, S0 = SCENE.torque, SCENE.rate, SCENE.deflection

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        alpha, da, phi, dp, gamma, z, x, dx, w = y
        b, b1, b2, turn, s = cam(alpha)
        if name == "cam.waviness" and s < 1.0:
            # derivatives by differences: no formula is shared
            def mark(v: float) -> float:
                amplitude = size * m.advance / q["order"] ** 2
                return amplitude * math.sin(math.pi * v) ** 2 * math.sin(TURN * q["order"] * v + q["phase"])

            h, per = 1e-4, 1.0 / (TURN * m.motion_share)
            b += mark(s)
            b1 += (mark(s + h) - mark(s - h)) / (2 * h) * per
            b2 += (mark(s + h) - 2 * mark(s) + mark(s - h)) / h**2 * per**2
        d1, v1 = m.reduction * gamma - alpha, m.reduction * POINT.motor_speed - da
        d2, v2 = phi - b, dp - b1 * da
        M1 = contact(m.input_joint, d1, v1)
        M2 = contact(m.output_joint, d2, v2)
        load, J, cam_torque, dz, ddx, dw = POINT.load_torque, m.table_inertia, M1, 0.0, 0.0, 0.0
        match name:
            case "drag.quadratic":
                load += size * T0 / V0**2 * dp * abs(dp)
            case "damping.rate_squared":
                M2 += 100.0 * size * T0 / V0**2 * v2 * abs(v2)
            case "inertia.by_station":
                J *= 1.0 + size * (2.0 * chance(SEED, float(turn % m.stations)) - 1.0)
            case "friction.position":
                load += size * T0 * lump(phi / TURN, q["centre"], q["half_width"]) * dry(dp)
            case "stiffness.warming":
                M2 *= 1.0 - size * (1.0 - math.exp(-t / (q["time"] * SCENE.duration)))
            case "stick.intermittent":
                load += size * T0 * dry(dp) if chance(SEED, float(turn)) < q["share"] else 0.0
            case "torque.beating":
                load += size * T0 * (math.sin(TURN * q["hertz"] * t) + math.sin(TURN * (q["hertz"] + q["apart"]) * t))
            case "mass.loose":
                omega, J_a = TURN * q["hertz"], size * m.table_inertia
                pull = J_a * omega**2 * (x - phi) + 2.0 * q["damping"] * J_a * omega * (dx - dp)
                load, ddx = load - pull, -pull / J_a
            case "preload.loss":
                M2 *= 1.0 - size * lump(alpha / TURN, q["centre"] * m.motion_share, q["half_width"])
            case "joint.hysteresis":
                M2 += size * m.output_joint.stiffness * z
                dz = v2 - abs(v2) * z / (q["yielding"] * S0)
            case "load.random_walk":
                load += w
                k = math.floor(t / 0.005)
                kicks = [2.0 * chance(SEED, float(k + after)) - 1.0 for after in (0, 1)]
                dw = size * T0 * np.interp(t / 0.005 - k, (0.0, 1.0), kicks) / 0.005 - w / q["time"]
            case "inverter.beat":
                cam_torque += size * T0 * math.sin(TURN * q["hertz"] * t + q["phase"])
            case "coupling.rubber":
                cam_torque *= 1.0 + size * (M1 / (T0 * V0 / SCENE.cam_rate)) ** 2
        dda = (cam_torque + b1 * (M2 - m.follower_inertia * b2 * da**2)) / (m.cam_inertia + m.follower_inertia * b1**2)
        return np.array([da, dda, dp, -(load + M2) / J, POINT.motor_speed, dz, dx, ddx, dw])

    return rates


SAMPLES, RATE, BEGIN = 1200, 1000.0, -0.3
"""1.2 s from cam angle -0.3 on: a cam turn's end, a whole motion, its dwell and the next motion."""


def by_solver(name: str | None, machine: Machine = MACHINE, samples: int = SAMPLES) -> np.ndarray:
    fields = {"seed": SEED} if name is None else {"seed": SEED} | by_kind(name)
    state = np.zeros(13)
    b, *_ = cam(BEGIN)
    state[[0, 1, 2, 6, 7, 10]] = (
        BEGIN, MACHINE.reduction * POINT.motor_speed, b, BEGIN / MACHINE.reduction, POINT.motor_speed, b,
    )  # fmt: skip
    return resumed(machine, POINT, state, samples, RATE, NOTHING._replace(**fields))[0]


def by_kind(name: str) -> dict:
    fields = DISTURBANCES[name].fields
    assert fields is not None
    return fields(SIZES[name], SHAPES.get(name, {}), SCENE)


def by_dop853(
    name: str | None, machine: Machine = MACHINE, samples: int = SAMPLES, longest: float = 2e-3
) -> np.ndarray:
    rates, b = written_out(name, machine), cam(BEGIN)[0]
    cam_rate, motor = MACHINE.reduction * POINT.motor_speed, BEGIN / MACHINE.reduction
    start = np.array([BEGIN, cam_rate, b, 0.0, motor, 0.0, b, 0.0, 0.0])
    times = np.arange(samples) / RATE
    found = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, rtol=1e-8, atol=1e-10, max_step=longest)
    return np.array([rates(t, y)[3] for t, y in zip(times, found.y.T, strict=True)])


IN_EQUATIONS = [name for name, kind in DISTURBANCES.items() if kind.fields is not None]


@pytest.mark.parametrize("name", [None, *IN_EQUATIONS])
def test_the_solver_gives_what_the_equation_says(name: str | None) -> None:
    """To 3e-4 of what the disturbance changes; the equations that this is held against are those of the table."""
    expected, found = by_dop853(name), by_solver(name)
    quiet = by_solver(None)
    changes = np.abs(expected - quiet).max() if name else expected.std()
    assert changes > 1e-3 * expected.std()
    assert np.abs(found - expected).max() < 3e-4 * changes


@pytest.mark.slow
@pytest.mark.parametrize("name", ["preload.loss", "joint.hysteresis"])
def test_the_solver_gives_the_same_with_play(name: str) -> None:
    """0.35 s with 2 and 0.2 mrad in the joints, DOP853 in steps of 0.05 ms as it does not stop at edges."""
    first, second = MACHINE.input_joint, MACHINE.output_joint
    machine = dataclasses.replace(
        MACHINE,
        input_joint=dataclasses.replace(first, backlash=2e-3),
        output_joint=dataclasses.replace(second, backlash=2e-4),
    )
    expected, found = by_dop853(name, machine, 350, 5e-5), by_solver(name, machine, 350)
    changes = np.abs(expected - by_solver(None, machine, 350)).max()
    assert np.abs(found - by_solver(name, MACHINE, 350)).max() > 0.05 * found.std()
    assert np.abs(found - expected).max() < 5e-3 * changes


def test_what_is_random_over_time_differs_between_records_and_stations_do_not() -> None:
    """Of two records that begin alike; in the third the first one's seed comes again."""
    state = np.zeros(13)
    u = NOTHING._replace(seed=SEED, stations=4.0, stick=1.0, sticking=0.5, walk=1.0, walk_time=0.3, inertia=0.1)
    state[3], other = 1.0, u._replace(record=1.0)
    sticks = [[on_table(one, state, float(turn)) > 0.5 for turn in range(40)] for one in (u, other, u)]
    kicks = [[wandering(one, np.r_[state[:8], 0.0025 * k, state[9:]]) for k in range(1, 9)] for one in (u, other, u)]
    for first, second, again in (sticks, kicks):
        assert first == again and first != second
    assert 12 < sum(sticks[1]) < 28
    assert [table_inertia(u, 5.0, turn) for turn in range(4)] == [table_inertia(other, 5.0, turn) for turn in range(4)]


def test_shocks_differ_between_records() -> None:
    drawn = messy_draw(MessyOrder(1, 3, "tune"), 0)
    wanted = Wanted("base.shock", {name: sum(law) / 2 for name, law in DISTURBANCES["base.shock"].shape.items()})
    still, readings = np.zeros(4000), []
    for number in (0, 1, 0):
        (reader,) = readers_of([(wanted, 1.0)], drawn, dataclasses.replace(drawn.records[0], number=number))
        readings.append(reader(still, still, 1000.0))
    assert np.array_equal(readings[0], readings[2]) and not np.array_equal(readings[0], readings[1])


def test_halves_ask_the_same_of_a_method() -> None:
    """Both have every joint, and equally many kinds."""
    mine = {half: [kind for kind in DISTURBANCES.values() if kind.half == half] for half in HALVES}
    assert len(mine["tune"]) == len(mine["judge"]) >= 8
    for kinds in mine.values():
        assert {kind.joint for kind in kinds} == set(JOINTS)
        assert {what for kind in kinds for what in kind.kinds} == set(KINDS)


@pytest.mark.parametrize("name", list(DISTURBANCES))
def test_every_kind_acts_in_the_equations_or_on_the_reading(name: str) -> None:
    kind = DISTURBANCES[name]
    assert (kind.fields is None) != (kind.reader is None)
    assert kind.sentence.endswith(".") and kind.equation


def test_the_page_has_the_table() -> None:
    page = Path(__file__).parents[4] / "docs" / "explanation" / "challenge.md"
    assert disturbance_table() in page.read_text(encoding="utf-8")
