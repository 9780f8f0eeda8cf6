"""The grid over the play against where a simulated cam really is when the windows start."""

import math

import numpy as np
import pytest

from discrepancy.indexer.parameters import changed
from discrepancy.indexer.states import LOCAL, play_grid
from discrepancy.indexer.windows import START_PHASE
from indexer_env import OperatingPoint, Run, load_machine, simulate
from indexer_env.coefficients import coefficients
from indexer_env.effects import Effect, MachineEffect, make_effect
from indexer_env.machine import Machine

SPEED = 1500.0 * 2.0 * math.pi / 60.0
QUIET = None
SHAKEN = (
    make_effect("drive.transmission_error", {"amplitude": 1.2e-3, "order": 2.0, "phase": 1.0}),
    make_effect("drive.mesh_stiffness", {"depth": 0.35, "order": 2.0, "phase": 1.0}),
)


def machine_with(degrees: float, effect: Effect | None) -> Machine:
    machine = load_machine("reference")
    machine = changed(machine, {"input_joint.backlash": math.radians(degrees) * machine.reduction})
    return machine.with_effects(effect) if isinstance(effect, MachineEffect) else machine


def at_window_starts(machine: Machine) -> np.ndarray:
    """Scaled |δ1|, |δ̇1| (w, 2) over three table turns."""
    point = OperatingPoint(SPEED, 2.0)
    samples = int(3.0 * machine.turn_duration(point) * 1000.0)
    channels = ("deflection_1", "deflection_rate_1")
    motion = simulate(machine, point, Run(step=0.0625e-3, samples=samples, channels=channels)).channels
    turns = machine.reduction * SPEED * np.arange(samples) / 1000.0 / (2.0 * math.pi)
    starts = 1 + np.flatnonzero(np.diff(np.floor(turns - START_PHASE)))
    return np.abs(np.stack([motion[c][starts] for c in channels], axis=1)) / [p.scale for p in LOCAL[:2]]


def reach(machine: Machine, *, shaken: bool) -> np.ndarray:
    return play_grid(coefficients(machine, OperatingPoint()), SPEED, shaken=shaken).max(axis=0)


@pytest.mark.parametrize("degrees", [5.0, 20.0])
@pytest.mark.parametrize("effect", [QUIET, *SHAKEN])
def test_the_cam_starts_within_the_grid(degrees: float, effect: Effect | None) -> None:
    machine = machine_with(degrees, effect)
    found = at_window_starts(machine)
    assert len(found) >= 23
    # a cam that is pressed into its flank at a start stands a little outside; refinement reaches it
    assert (found <= 1.05 * reach(machine, shaken=True)).all()
    # what shakes the drive is what needs the larger grid
    smaller = reach(machine, shaken=False)
    assert (found > smaller).any() if effect is not QUIET else (found <= 1.05 * smaller).all()


def test_the_grid_follows_the_play_and_what_shakes_the_drive() -> None:
    none, little, much, shaken = (
        play_grid(coefficients(machine_with(d, e), OperatingPoint()), SPEED, shaken=True)
        for d, e in ((0.0, QUIET), (2.0 / 60.0, QUIET), (5.0, QUIET), (5.0, SHAKEN[0]))
    )
    assert none.shape == (0, 2)
    assert (len(little), len(much)) == (5 * 5, 13 * 13)
    assert len(much) < len(shaken) <= 37 * 37
    # the play's middle is always looked at
    assert all((np.abs(grid) < 1e-9).all(axis=1).any() for grid in (little, much, shaken))
