"""Start states of windows against what the kernel sees of them: deflections, rates and contact regions."""

import dataclasses
import math

import numpy as np
import pytest

from discrepancy.indexer.states import LOCAL, play_grid, start_states
from discrepancy.indexer.windows import START_PHASE
from indexer_env import EFFECTS, MachineEffect, OperatingPoint, load_machine, make_effect
from indexer_env.coefficients import Pack, coefficients
from indexer_env.effects import Effect
from indexer_env.engine import advance
from indexer_env.kernels import layout
from indexer_env.kernels.joints import region_of
from indexer_env.machine import CONTACT_LAWS, Machine
from tests.indexer_env.conftest import VISIBLE

SCALES = np.array([p.scale for p in LOCAL])
SPEED = 50.0 * math.pi
SEEN = ("DEFLECTION_1", "DEFLECTION_RATE_1", "DEFLECTION_2", "DEFLECTION_RATE_2", "DEFLECTION_3", "DEFLECTION_RATE_3")
REGIONS = ("REGION_1", "REGION_2", "REGION_3")


def seen(machine: Machine, local: np.ndarray, turn: float) -> dict[str, np.ndarray]:
    """What the kernel makes of scaled values (n, 4) or (n, 6) before the first step, by row of its workspace."""
    item, n = coefficients(machine, OperatingPoint(SPEED, 2.0)), len(local)
    rows = np.tile(item.row, (n, 1))
    rows[:, layout.COEFFICIENT_NAMES.index("law_count")] = len(item.law.pieces)
    drive, rate = np.full(n, 2.0 * math.pi * (turn - 1.0 + START_PHASE)), np.full(n, machine.reduction * SPEED)
    states = start_states(rows, drive, rate, np.full(n, turn), local)
    pack = Pack(item.model, item.features, states, rows, item.law.pieces)
    none, names = np.zeros(n), (*SEEN, *REGIONS)
    out, _, _ = advance(pack, none, none, none, every=1, rows=np.array([getattr(layout, n) for n in names]), samples=1)
    return dict(zip(names, out[:, :, 0].T, strict=True))


@pytest.fixture(params=CONTACT_LAWS)
def playing(request, reference) -> Machine:
    """Play of 5 degrees at the motor, play and hardening at the output, a cracked roller where the windows start."""
    effects = {
        "input.backlash": {"backlash": 3e-3},
        "output.backlash": {"backlash": 2e-4},
        "output.cubic_stiffness": {"stiffness": 5e11},
        "roller.crack_single": {"stiffness_loss": 0.4, "station": 2},
    }
    machine = dataclasses.replace(reference, contact_law=request.param)
    return machine.with_effects(*(make_effect(name, values) for name, values in effects.items()))


@pytest.fixture(scope="module")
def reference() -> Machine:
    return load_machine("reference")


def test_the_regions_are_those_of_the_kernel_s_law(playing) -> None:
    """Over the play grid of the input joint and a grid of the same kind over the output's: a flank that pulls back is
    left only where the push is gone, and hardening and a cracked roller count."""
    item = coefficients(playing, OperatingPoint(SPEED, 2.0))
    grid = play_grid(item, SPEED, shaken=True)
    edge = item["edge_2"]
    output = np.stack([np.linspace(-1.5, 3.5, 31).repeat(31) * edge, np.tile(np.linspace(-0.1, 0.1, 31), 31)], axis=1)
    local = np.zeros((len(grid) + len(output), 4))
    local[: len(grid), :2], local[len(grid) :, 2:] = grid, output / SCALES[2:4]
    found = seen(playing, local, 3.0)
    for joint in (1, 2):
        ratio = 0.6 if joint == 2 else 1.0
        law = [item[f"{name}_{joint}"] for name in ("edge", "release", "hardening")]
        deflections, rates = found[f"DEFLECTION_{joint}"], found[f"DEFLECTION_RATE_{joint}"]
        expected = [
            region_of(*state, *law, law[1] / ratio, law[2] / ratio) for state in zip(deflections, rates, strict=True)
        ]
        assert found[f"REGION_{joint}"].tolist() == expected
        assert set(expected) == {-1.0, 0.0, 1.0}
    assert (found["REGION_3"] == 1.0).all()


@pytest.mark.parametrize("turn", [0.0, 1.0, 2.0, 9.0])
@pytest.mark.parametrize("name", ["", *(name for name, kind in EFFECTS.items() if issubclass(kind, MachineEffect))])
def test_the_kernel_sees_the_deflections_that_were_asked_for(reference, name, turn) -> None:
    effect: Effect | None = make_effect(name, VISIBLE[name]) if name else None
    machine = reference.with_effects(effect) if isinstance(effect, MachineEffect) else reference
    local = np.array([[1.0, 2.0, 30.0, 4.0, 5.0, 6.0], [-1.0, -2.0, -30.0, -4.0, -5.0, -6.0]])
    local = local if name == "base.looseness" else local[:, :4]
    found = seen(machine, local, turn)
    wanted = np.zeros((2, 6))
    wanted[:, : local.shape[1]] = local * SCALES[: local.shape[1]]
    got = np.stack([found[row] for row in SEEN], axis=1)
    # the output joint is counted from where the load holds the table, the same for both
    got[:, 2] -= got[:, 2].mean()
    np.testing.assert_allclose(got, wanted, rtol=1e-6, atol=1e-12)
