"""Makes a bench of healthy records of a machine that nobody knows, and three records of later days.

`python -m examples.twin_bench OUT` writes OUT/healthy, four CSV files with records.csv beside them, and
OUT/days/monday, tuesday and wednesday, one file each. The machine differs from the drawing by up to 8 % in its
joints' stiffness and damping and three inertias, and its table bearing drags with 5 N m that the drawing lacks; the
reference solver, which shares no code with the simulator of the twin, made the motion. docs/tutorials/twin.md finds
out what came on which day.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from examples.hidden_effect import real_machine, typed, write
from indexer_env import Machine, OperatingPoint, make_effect
from indexer_env.effects import MachineEffect
from indexer_env.reference import simulate_reference
from indexer_env.units import RPM

SEED = 11
RATE = 500.0
"""Hz; enough for a table that rings at 15 Hz."""

HEALTHY = ((1500.0, 2.0, "no"), (1250.0, 2.0, "no"), (1400.0, 20.0, "no"), (1450.0, 10.0, "yes"))
"""Motor speed [rpm], load torque [N m], held out or not."""

DAYS = {
    "monday": (),
    "tuesday": (make_effect("roller.crack", stiffness_loss=0.2),),
    "wednesday": (make_effect("input.backlash", backlash=math.radians(4.0) / 25.625),),
}
"""What is wrong on each day: nothing, 20 % of the rollers' stiffness lost in one sense, 4° more play at the motor."""

NOISE = 0.1
"""Standard deviation of the measuring noise [rad/s²]: 1.5 % of the signal."""


def recorded(
    machine: Machine, rpm: float, load: float, turns: float, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """A record (n,) [rad/s²] of so many table turns and the cam angle of its first sample [rad]."""
    point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
    samples = math.ceil(turns * machine.turn_duration(point) * RATE)
    run = simulate_reference(
        machine, point, sample_rate=RATE, samples=samples, turns_before=1, rtol=1e-7, atol=1e-10, max_step=4e-3
    )
    return run.channels["table_acceleration"] + NOISE * rng.standard_normal(samples), point.start_angle


def make_bench(out: Path) -> None:
    """Write the healthy records and the days."""
    rng = np.random.default_rng(SEED)
    machine = real_machine(rng, 0.08).with_effects(make_effect("friction.coulomb", torque=5.0))
    rows = []
    for rpm, load, held_out in HEALTHY:
        values, start = recorded(machine, rpm, load, 2.1, rng)
        rows.append((f"{rpm:.0f}rpm_{load:.0f}Nm.csv", values, rpm, load, start, held_out))
    write(out / "healthy", rows, RATE)
    for day, effects in DAYS.items():
        changed = machine.with_effects(*(effect for effect in effects if isinstance(effect, MachineEffect)))
        values, start = recorded(changed, 1400.0, 10.0, 1.1, rng)
        write(out / "days" / day, [("today.csv", values, 1400.0, 10.0, start, "no")], RATE)


if __name__ == "__main__":
    make_bench(typed("python -m examples.twin_bench OUT")[0])
