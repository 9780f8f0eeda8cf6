"""Five simulated drives, each with an effect hidden that its file under examples/drives does not have."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from indexer_experiments.challenge.drives.motions import reference
from indexer_experiments.challenge.drives.plant import simulate_plant

Columns = Mapping[str, np.ndarray]

_RATE = 1000.0


def feed_axis(rng: np.random.Generator) -> dict[str, Columns]:
    """A ball screw with 0.5 mm of play moves a slide that its guides hold; motor encoder in m, force in N."""
    truth = {
        "mass": 22.0, "load": 61.0, "stiffness": 8e6, "damping": 6e3, "play": 5e-4, "coulomb": 9.0,
        "load_coulomb": 33.0, "viscous": 160.0,
    }  # fmt: skip
    found = {}
    for name, kind, turns in (("back_and_forth", "point_to_point", 5.0), ("places", "steps", 6.0)):
        run = simulate_plant(truth, 0.3 * reference(kind, 12000, turns, rng), _RATE, (3e5, 1e4))
        found[name] = _columns(run.t, run.q, run.force, 2e-6, 0.6, rng, ("position [m]", "force [N]"))
    return found


def robot_joint(rng: np.random.Generator) -> dict[str, Columns]:
    """A geared joint lifts an arm; its bearings' friction builds up over 0.02 rad. Angle in rad, torque in N m."""
    truth = {
        "mass": 2.1, "viscous": 3.2, "gravity": 38.0, "presliding": 11.0, "presliding_distance": 0.02,
    }  # fmt: skip
    found = {}
    for name, kind, turns in (("sines", "sines", 6.0), ("back_and_forth", "point_to_point", 5.0)):
        run = simulate_plant(truth, 1.2 * reference(kind, 15000, turns, rng), _RATE, (9e3, 4e2))
        found[name] = _columns(run.t, run.q, run.force, 2e-6, 0.1, rng, ("angle [rad]", "torque [N m]"))
    return found


def pick_and_place(rng: np.random.Generator) -> dict[str, Columns]:
    """A head presses on its tray from one place of the stroke on. Position in m, force in N."""
    truth = {"mass": 3.4, "viscous": 21.0, "coulomb": 4.0, "offset": 33.4, "bilinear": 5200.0, "bilinear_place": 0.02}
    found = {}
    for name, kind, turns in (("places", "steps", 8.0), ("back_and_forth", "point_to_point", 7.0)):
        run = simulate_plant(truth, 0.08 * reference(kind, 10000, turns, rng), _RATE, (4e4, 9e2))
        found[name] = _columns(run.t, run.q, run.force, 1e-6, 0.15, rng, ("position [m]", "force [N]"))
    return found


def pendulum(rng: np.random.Generator) -> dict[str, Columns]:
    """A pendulum whose motor acts 40 ms after it is asked; a coarse encoder of 2048 steps a turn. Solved by DOP853."""
    from scipy.integrate import solve_ivp

    t = np.arange(5000) / 200.0
    found = {}
    for name, one, other in (("slow", 0.21, 0.63), ("fast", 0.37, 0.92)):
        a, b = rng.uniform(0.0, 2.0 * math.pi, 2)

        def asked(time: np.ndarray | float, one=one, other=other, a=a, b=b) -> np.ndarray:
            return 0.3 * np.sin(2.0 * math.pi * one * time + a) + 0.2 * np.sin(2.0 * math.pi * other * time + b)

        def rates(time: float, y: np.ndarray, asked=asked) -> list[float]:
            return [y[1], (float(asked(time - 0.04)) - 1.04 * math.sin(y[0]) - 0.021 * y[1]) / 0.049]

        y = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], method="DOP853", t_eval=t, rtol=1e-9, atol=1e-10).y
        step = 2.0 * math.pi / 2048
        angle = step * np.round((y[0] + 1e-4 * rng.standard_normal(len(t))) / step)
        found[name] = {"time [s]": t, "angle [rad]": angle, "torque [N m]": asked(t)}
    return found


def cam_indexer(rng: np.random.Generator) -> dict[str, Columns]:
    """A cycloidal cam indexes a table on a springy shaft; its bearing has 22 N m of dry friction. Solved by LSODA."""
    from scipy.integrate import solve_ivp

    found = {}
    for name, speed in (("slow", 4.9), ("fast", 6.3)):
        t = np.arange(4000) / 500.0
        begin = rng.uniform(0.0, 2.0 * math.pi)

        def law(cam: float) -> tuple[float, float]:
            turn = cam / (2.0 * math.pi)
            s = min(2.0 * (turn - math.floor(turn)), 1.0)
            rise = math.floor(turn) + s - math.sin(2.0 * math.pi * s) / (2.0 * math.pi)
            slope = (1.0 - math.cos(2.0 * math.pi * s)) / math.pi if s < 1.0 else 0.0  # per rad of the cam
            return math.pi / 4.0 * rise, math.pi / 4.0 * slope

        def rates(time: float, y: np.ndarray, begin=begin, speed=speed, law=law) -> list[float]:
            angle, slope = law(begin + speed * time)
            torque = 44000.0 * (angle - y[0]) + 29.0 * (slope * speed - y[1])
            return [y[1], (torque - 22.0 * math.tanh(y[1] / 5e-4) - 2.0) / 5.1]

        start = [law(begin)[0], law(begin)[1] * speed]
        y = solve_ivp(rates, (0.0, t[-1]), start, method="LSODA", t_eval=t, rtol=1e-8, atol=1e-10, max_step=1e-3).y
        angle = y[0] + 2e-6 * rng.standard_normal(len(t))
        found[name] = {
            "time [s]": t,
            "table [rad]": angle,
            "cam [rad]": begin + speed * t,
            "cam_rate [rad/s]": speed + 0.0 * t,
        }
    return found


GALLERY: dict[str, tuple[Callable[[np.random.Generator], dict[str, Columns]], tuple[str, ...]]] = {
    "feed_axis": (feed_axis, ("play.contact", "play")),
    "robot_joint": (robot_joint, ("friction.presliding",)),
    "pick_and_place": (pick_and_place, ("spring.bilinear", "end_stop")),
    "pendulum": (pendulum, ("delay",)),
    "cam_indexer": (cam_indexer, ("friction.coulomb",)),
}
"""Each drive's records and the effects that would be right answers."""


def _columns(
    t: np.ndarray, q: np.ndarray, force: np.ndarray, step: float, noise: float, rng: np.random.Generator,
    names: tuple[str, str],
) -> Columns:  # fmt: skip
    """Time, position by an encoder of this step, force with this noise."""
    return {
        "time [s]": t, names[0]: step * np.round(q / step),
        names[1]: force + noise * rng.standard_normal(len(t)),
    }  # fmt: skip


def write(name: str, folder: Path, seed: int = 0) -> None:
    """Write a drive's records as CSV files and the table beside them, the second record held out."""
    made = GALLERY[name][0](np.random.default_rng(seed))
    folder.mkdir(parents=True, exist_ok=True)
    for file, columns in made.items():
        table, header = np.column_stack(list(columns.values())), ",".join(columns)
        np.savetxt(folder / f"{file}.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
    rows = [f"{file}.csv,{file},{'yes' if k else 'no'}" for k, file in enumerate(made)]
    (folder / "records.csv").write_text("\n".join(["file,motion,held_out", *rows]) + "\n", encoding="utf-8")
