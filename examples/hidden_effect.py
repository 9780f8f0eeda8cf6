"""Makes a folder of measured records whose machine hides an effect, as an engineer would bring them.

`python examples/hidden_effect.py OUT [turns]` writes three CSV files, one at each of three conditions, and
records.csv, which says what was known when they were taken. The machine differs from the nominal one by up to 10 % in
its joints' stiffness and damping and three inertias, and its fourth station stands off its place.
docs/tutorials/missing_effect.md finds both out.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from indexer_env import Machine, OperatingPoint, Run, load_machine, make_effect, simulate
from indexer_env.units import RPM

Accelerated = Callable[[Machine, OperatingPoint, int], np.ndarray]
Row = tuple[str, np.ndarray, float, float, float, str]
"""File, record (n,) [rad/s²], motor speed [rpm], load torque [N m], cam angle at the start [rad], held out or not."""

SEED = 7
CONDITIONS = ((1500.0, 2.0, "no"), (1200.0, 2.0, "no"), (1350.0, 20.0, "yes"))
"""Motor speed [rpm], load torque [N m], held out or not."""

HIDDEN = make_effect("cam.station_spacing", error=0.012, station=3)
NOISE = 0.1
"""Standard deviation of the measuring noise [rad/s²]: 1.5 % of the signal."""


def real_machine(rng: np.random.Generator, spread: float = 0.1) -> Machine:
    """The nominal machine, each parameter off by up to this share."""
    nominal = load_machine("reference")

    def off(value: float) -> float:
        return value * (1.0 + spread * rng.uniform(-1.0, 1.0))

    joints = {
        name: dataclasses.replace(joint, stiffness=off(joint.stiffness), damping=off(joint.damping))
        for name, joint in (("input_joint", nominal.input_joint), ("output_joint", nominal.output_joint))
    }
    inertias = {name: off(getattr(nominal, name)) for name in ("table_inertia", "cam_inertia", "follower_inertia")}
    return dataclasses.replace(nominal, **joints, **inertias)


def with_hidden_effect(machine: Machine, point: OperatingPoint, samples: int) -> np.ndarray:
    """Acceleration (samples,) at 1 kHz of the machine with what it hides."""
    return simulate(machine.with_effects(HIDDEN), point, Run(step=0.0625e-3, samples=samples)).table_acceleration


def write(folder: Path, rows: list[Row], rate: float) -> None:
    """CSV files of records at this rate [Hz], and records.csv with what was known when they were taken."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "records.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["file", "motor_speed_rpm", "load_torque", "start_angle_deg", "held_out"])
        for name, values, rpm, load, start, held_out in rows:
            table = np.column_stack([np.arange(len(values)) / rate, values])
            header = "time [s],acceleration [rad/s^2]"
            np.savetxt(folder / name, table, delimiter=",", fmt=("%.3f", "%.5f"), header=header, comments="")
            writer.writerow([name, f"{rpm:g}", f"{load:g}", f"{math.degrees(start):.2f}", held_out])


def make_records(folder: Path, turns: float = 2.0, accelerated: Accelerated = with_hidden_effect) -> None:
    """Write the records, each of so many table turns, and the table that describes them."""
    rng = np.random.default_rng(SEED)
    machine = real_machine(rng)
    rows = []
    for rpm, load, held_out in CONDITIONS:
        point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
        samples = int(turns * machine.turn_duration(point) * 1000.0)
        clean = accelerated(machine, point, samples)
        noisy = clean + NOISE * rng.standard_normal(samples)
        rows.append((f"{rpm:.0f}rpm_{load:.0f}Nm.csv", noisy, rpm, load, point.start_angle, held_out))
    write(folder, rows, 1000.0)


def typed(usage: str) -> tuple[Path, float]:
    """The folder, made, and the number of turns that were typed; a mistake ends the program with one sentence."""
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(f"error: the folder to write is missing; {usage}")
    folder, turns = Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "2"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        sys.exit(f"error: OUT must be a folder that can be made, got {folder} ({error.strerror}); choose another.")
    if not turns.replace(".", "", 1).isdecimal() or float(turns) <= 0.0:
        sys.exit(f"error: turns must be a number of table turns > 0, got {turns!r}; {usage}")
    return folder, float(turns)


if __name__ == "__main__":
    make_records(*typed("python examples/hidden_effect.py OUT [turns]"))
