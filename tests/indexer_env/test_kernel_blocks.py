"""Whole blocks of the kernel, compiled and in plain Python: the same to the last bit.

Run as a script, this file prints digests of each model's block and of some of its lanes, with NUMBA_DISABLE_JIT as the
environment says.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from indexer_env.coefficients import coefficients, pack
from indexer_env.effects import EFFECTS, make_effect
from indexer_env.engine import advance
from indexer_env.kernels import layout
from indexer_env.machine import CONTACT_LAWS, Joint, Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine

EDGED = " with edges"
BLOCKS = tuple(model + edged for model in ("A", "B", "B_on_base") for edged in ("", EDGED))
NEED_EDGES = ("roller.crack", "roller.crack_single", "input.backlash", "output.backlash", "drive.mesh_friction")
SIZES = {
    "friction.coulomb": {"torque": 20.0, "smoothing": 0.05},
    "friction.viscous": {"coefficient": 15.0},
    "friction.stribeck": {"torque": 20.0, "smoothing": 0.05},
    "load.imbalance": {"torque": 30.0, "phase": 0.4},
    "load.process": {"torque": 50.0, "centre": 0.2, "half_width": 0.3},
    "drive.slip": {"compliance": 2.0},
    "drive.speed_ripple": {"depth": 0.2},
    "drive.transmission_error": {"amplitude": 1e-2},
    "drive.mesh_stiffness": {"depth": 0.3},
    "drive.mesh_friction": {"loss": 0.2},
    "cam.profile_error": {"height": 1e-2, "centre": 0.26},
    "cam.station_spacing": {"error": 0.02, "station": 1},
    "roller.crack": {"stiffness_loss": 0.4},
    "roller.crack_single": {"stiffness_loss": 0.4, "station": 0},
    "input.backlash": {"backlash": 1e-4},
    "output.backlash": {"backlash": 1e-4},
    "output.cubic_stiffness": {"stiffness": 1e10},
}
STEPS = 60
FEW = slice(3, 9)


def machines(block: str) -> list[tuple[Machine, OperatingPoint]]:
    """One block of lanes. Without edges: every effect that needs none. With edges: every effect and contact law, and
    joints with play and two stiffnesses."""
    model, edged = block.removesuffix(EDGED), block.endswith(EDGED)
    base = Joint(stiffness=3e6, damping=2000.0)
    smooth = dataclasses.replace(load_machine("smooth"), model=model, base_joint=base)
    items = []
    for n in range(layout.LANES - 1):
        machine = dataclasses.replace(smooth, contact_law=CONTACT_LAWS[n % 3])
        if edged:
            play, ratio = (1e-5, 0.0, 1e-4, 3e-6)[n // 3 % 4], (0.9, 0.6)[n % 2]
            joints = {
                joint: dataclasses.replace(getattr(smooth, joint), backlash=play, stiffness_ratio=ratio)
                for joint in ("input_joint", "output_joint", "base_joint")
            }
            machine = dataclasses.replace(machine, **joints)
        items.append(machine)
    effects = [
        make_effect(name, parameters)
        for name, parameters in SIZES.items()
        if model in EFFECTS[name].models and (edged or name not in NEED_EDGES)
    ]
    items[: len(effects)] = [machine.with_effects(effect) for machine, effect in zip(items, effects, strict=False)]
    inertias = np.random.default_rng(1).uniform(3.0, 7.0, len(items))
    items = [dataclasses.replace(item, table_inertia=float(J_t)) for item, J_t in zip(items, inertias, strict=True)]
    # mid-motion, where all forces act; some lanes cross the law's last junction, or the end of the cam turn
    starts = (1.57, 3.1, 2.5, 6.25, -0.01)
    points = [OperatingPoint(load_torque=(2.0, -40.0)[n % 2], start_angle=starts[n % 5]) for n in range(len(items))]
    return list(zip(items, points, strict=True))


def run_block(block: str, lanes: slice = slice(None)) -> np.ndarray:
    """Outputs (lanes, recorded rows, steps) of some of a block's lanes, all families of effects on for all of them."""
    items, points = zip(*machines(block), strict=True)
    rows = [coefficients(machine, point) for machine, point in zip(items, points, strict=True)]
    features = 0
    for row in rows:
        features |= row.features
    if block.endswith(EDGED):
        joints_with_edges = {row.features & ~layout.USES_ANY_EFFECT for row in rows}
        assert len(joints_with_edges) == 1, "a lane without edges in a block that has them"
    rows, points = rows[lanes], points[lanes]
    packed = pack([dataclasses.replace(row, features=features) for row in rows], points)
    count = len(rows)
    recorded = [layout.LANES * row for row in range(layout.STATE_ROWS)]
    recorded += [
        layout.CAM_ACC, layout.TABLE_ACC, layout.HOUSING_ACC, layout.MOTOR_ACC,
        layout.TORQUE_1, layout.TORQUE_2, layout.TORQUE_3, layout.DEFLECTION_2, layout.DEFLECTION_RATE_2,
    ]  # fmt: skip
    out, status, _ = advance(
        packed, np.full(count, STEPS), np.full(count, 0.15e-3), np.full(count, 0.1e-3),
        every=1, rows=np.array(recorded), samples=STEPS + 1,
    )  # fmt: skip
    assert (status == layout.RUNNING).all(), status
    return out


def digest(values: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()


def digests() -> dict[str, str]:
    """Of each block, and of a few of its lanes, which are stepped one by one."""
    return {f"{block} {lanes}": digest(run_block(block, lanes)) for block in BLOCKS for lanes in (slice(None), FEW)}


@pytest.fixture(scope="module")
def blocks() -> dict[str, np.ndarray]:
    return {block: run_block(block) for block in BLOCKS}


def test_compiled_and_plain_python_agree_to_the_last_bit():
    """This process runs as it was started, a child process the other way round."""
    plain = bool(numba.config.DISABLE_JIT)
    root = Path(__file__).parents[2]
    environment = os.environ | {"NUMBA_DISABLE_JIT": "0" if plain else "1", "PYTHONPATH": str(root)}
    child = subprocess.run([sys.executable, __file__], env=environment, capture_output=True, text=True, check=False)
    assert child.returncode == 0, child.stderr
    answer = json.loads(child.stdout)
    assert answer["plain"] is not plain
    assert answer["digests"] == digests()


@pytest.mark.parametrize("block", BLOCKS)
def test_the_blocks_go_through_all_branches(blocks, block):
    """Or their agreement would say little: all regions of all joints, junctions of the law, a cam turn's end."""
    values = blocks[block]
    rows = dict(zip(layout.STATE_NAMES, values.swapaxes(0, 1), strict=False))
    model = block.removesuffix(EDGED)
    for joint in {"A": (2,), "B": (1, 2), "B_on_base": (1, 2, 3)}[model]:
        assert set(np.unique(rows[f"region_{joint}"])) == ({-1.0, 0.0, 1.0} if block != model else {1.0})
    assert (np.diff(rows["piece"]) != 0.0).any() and set(np.unique(rows["cam_turn"])) == {-1.0, 0.0, 1.0}
    assert np.isfinite(values).all()
    assert len({row.tobytes() for row in values}) == len(values)


@pytest.mark.parametrize("block", ["A with edges", "B with edges", "B_on_base with edges", "B"])
@pytest.mark.parametrize("lanes", [slice(0, 1), slice(17, 18), FEW, slice(3, 10), slice(20, 31)])
def test_a_lane_s_numbers_are_the_same_in_any_company(blocks, block, lanes):
    """Few lanes are stepped one by one, many as a block."""
    assert run_block(block, lanes).tobytes() == np.ascontiguousarray(blocks[block][lanes]).tobytes()


@pytest.mark.unjitted
def test_the_last_step_may_be_shorter():
    """After the whole steps comes one of its own length: time stands at their sum, and the motor where it should."""
    items, points = zip(*machines("B")[:3], strict=True)
    packed = pack(
        [dataclasses.replace(coefficients(m, p), features=0) for m, p in zip(items, points, strict=True)], points
    )
    before = packed.states.copy()
    steps, last = np.array([0, 3, 5]), np.array([0.1e-3, 0.0, 0.05e-3])
    advance(packed, steps, np.full(3, 0.2e-3), last, every=1, rows=np.array([layout.CAM]), samples=6)
    expected = steps * 0.2e-3 + last
    time = layout.STATE_NAMES.index("time")
    np.testing.assert_allclose(packed.states[:, time], expected, rtol=1e-14)
    motor = layout.STATE_NAMES.index("motor_angle")
    turned = packed.states[:, motor] - before[:, motor]
    np.testing.assert_allclose(turned, expected * points[0].motor_speed, rtol=1e-9)


@pytest.mark.unjitted
@pytest.mark.parametrize("last", [0.0, 0.5e-3])
def test_the_state_at_an_item_s_end_is_judged_whatever_its_neighbours_do(last):
    """It leaves the range in its last step, where no sample is due; its neighbour runs on."""
    item, point = coefficients(load_machine("smooth"), OperatingPoint()), OperatingPoint()
    place = layout.STATE_NAMES.index
    for count in (1, 2):
        packed = pack([item] * count, [point] * count)
        packed.states[:, place("region_1")] = 1.0
        packed.states[:, place("region_2")] = 1.0
        packed.states[:, place("region_3")] = 1.0
        packed.states[0, place("table_angle")], packed.states[0, place("table_rate")] = 0.49, 25.0
        _, status, when = advance(
            packed, np.array([0 if last else 1, 9][:count]), np.full(count, 0.5e-3), np.full(count, last),
            every=4, rows=np.array([layout.TABLE]), samples=3,
        )  # fmt: skip
        assert status[0] == layout.OUT_OF_RANGE and when[0] == pytest.approx(0.5e-3)
        assert (status[1:] == layout.RUNNING).all()


if __name__ == "__main__":
    print(json.dumps({"plain": bool(numba.config.DISABLE_JIT), "digests": digests()}))
