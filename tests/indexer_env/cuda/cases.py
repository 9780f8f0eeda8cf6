"""Small runs on a device of one's choice; as a program, in numba's CUDA simulator: `python cases.py RESULT.npz`."""

from __future__ import annotations

import dataclasses
import sys
from typing import Any

import numpy as np

from indexer_env import Faults, Machine, OperatingPoint, Run, Sensor, load_machine, make_effect, simulate_batch
from indexer_env.device import on_host
from indexer_env.effects import TABLES
from indexer_env.motion_law import motion_law
from indexer_env.vector_env import IndexerVectorEnv

IN_INDEX = OperatingPoint(start_angle=0.4)

BEFORE_DWELL = OperatingPoint(start_angle=3.1)
"""The dwell of the reference machine begins at π."""

EVERYTHING = Run(samples=30, warmup_turns=0, channels=("table_acceleration", "cam_angle", "region_1", "region_2"))

TURNS = Run(sample_rate=250.0, samples=60, warmup_turns=3, warmup_tolerance=0.03)
"""Longer than a turn of `quick`, so a settled record is run in one piece from its turn's start."""

PERIODS = 4


def with_effects(machine: Machine, **effects: dict[str, Any]) -> Machine:
    more = tuple(make_effect(name.replace("__", "."), parameters) for name, parameters in effects.items())
    return dataclasses.replace(machine, effects=(*machine.effects, *more))


def _values(table: str, size: float) -> dict[str, float]:
    """Of a table, of no shape."""
    return {name: size * ((7 * k) % 5 - 2.0) for k, name in enumerate(TABLES[table].grid)}


def machines() -> list[Machine]:
    """One of each model, with play, with effects, some of which go with strides, with a motor that slips, and
    with tables."""
    reference = load_machine("reference")
    worn = Faults(backlash=np.radians(8.0), roller_crack=0.3).applied_to(reference)
    return [
        with_effects(worn, friction__coulomb={"torque": 8.0}, drive__speed_ripple={"depth": 0.02}),
        Faults(screw_looseness=0.5).applied_to(reference),
        with_effects(worn, drive__slip={"compliance": 0.5}),
        dataclasses.replace(reference, model="A"),
        worn,
        with_effects(worn, load__imbalance={"torque": 30.0}, drive__transmission_error={"amplitude": 1e-4}),
        with_effects(worn, tabulated__speed_cam={**_values("tabulated.speed_cam", 20.0), "low": -0.2, "high": 1.5}),
        with_effects(reference, tabulated__profile=_values("tabulated.profile", 1e-4)),
    ]


def quick() -> list[Machine]:
    """Machines that turn their table in a fifth of a second, so that warm-up can be seen in a simulator."""
    machine = load_machine("smooth")
    joint = dataclasses.replace(machine.output_joint, damping=0.1 * machine.output_joint.damping)
    fast = dataclasses.replace(
        machine, reduction_ratio=2.5, stations=2, motion_share=0.8, table_inertia=0.05, follower_inertia=0.01,
        output_joint=joint,
    )  # fmt: skip
    return [fast, dataclasses.replace(fast, cam_inertia=1.1 * fast.cam_inertia)]


def batches(device: str) -> dict[str, np.ndarray]:
    """Channels of all machines from the index and into the dwell; warm-up of the quick ones."""
    found = {}
    for name, point in (("index", IN_INDEX), ("dwell", BEFORE_DWELL)):
        batch = simulate_batch(machines(), point, EVERYTHING, device=device)
        assert not batch.rejected
        found |= {f"{name} {channel}": on_host(values) for channel, values in batch.channels.items()}
    sunk: dict[int, np.ndarray] = {}

    def sink(items: np.ndarray, channels: dict[str, Any]) -> None:
        sunk.update(zip(items.tolist(), on_host(channels["table_acceleration"]), strict=True))

    batch = simulate_batch(quick(), None, TURNS, device=device, sink=sink)
    found["quick"] = np.stack([sunk[0], sunk[1]])
    warmed = (batch.warmup_turns, batch.settled, batch.warmup_difference)
    return found | {f"quick {k}": values for k, values in enumerate(warmed)}


def episodes(device: str, mode: str, **settings: Any) -> dict[str, np.ndarray]:
    """What some periods of three machines with growing play give, episodes of three periods ended and started anew."""
    import torch

    faults = {"backlash_deg": {"uniform": [2.0, 12.0]}, "backlash_per_joule": 1e-4}
    env = IndexerVectorEnv(
        3, device=device, autoreset_mode=mode, period=0.02, max_episode_steps=3, faults=faults, half_width=0.1,
        brake_torque=20.0, reveal=True, **settings,
    )  # fmt: skip
    found: dict[str, np.ndarray] = {}
    rng = np.random.default_rng(0)
    observations, _ = env.reset(seed=5, options={"start_angle": 6.2})
    found["reset"] = on_host(observations)
    for period in range(PERIODS):
        actions = rng.uniform(-1.0, 1.0, (3, 2))
        observations, *outcome, infos = env.step(torch.from_numpy(actions) if device != "cpu" else actions)
        truth = {name: values for name, values in infos["truth"].items() if not name.startswith("_")}
        given = {"observations": observations, "acceleration": infos["acceleration"], **truth}
        given |= dict(zip(("rewards", "terminated", "truncated"), outcome, strict=True))
        if "final_obs" in infos:
            given["ended"] = infos["_final_obs"]
            given["last"] = infos["final_info"]["acceleration"]
        found |= {f"{period} {name}": on_host(values).copy() for name, values in given.items()}
    return found


def renewed(device: str) -> dict[str, np.ndarray]:
    """Periods in front of and behind resets of one machine of three, which bring another motion law and an effect, and
    then play that wears: the arrays that a period works on are replaced."""
    import torch

    env = IndexerVectorEnv(3, device=device, autoreset_mode="Disabled", period=0.01, max_episode_steps=100)
    env.reset(seed=5, options={"start_angle": 6.2})
    machine = dataclasses.replace(load_machine("reference"), motion_law=motion_law("cycloidal"))
    other = with_effects(machine, friction__viscous={"coefficient": 20.0})
    found: dict[str, np.ndarray] = {}
    for name, brought in {
        "begun": {}, "law": {"machine": other}, "wear": {"faults": {"backlash_deg": 3.0, "backlash_per_joule": 1e-3}},
    }.items():  # fmt: skip
        if brought:
            mask = np.array([False, True, False])
            env.reset(options={**brought, "start_angle": 6.2, "reset_mask": mask})
        for period in range(3):
            actions = np.full((3, 1), 0.5 - 0.2 * period)
            observations, *_, infos = env.step(torch.from_numpy(actions) if device != "cpu" else actions)
            given = {"observations": observations, "acceleration": infos["acceleration"]}
            found |= {f"{name} {period} {key}": on_host(values).copy() for key, values in given.items()}
    return found


CHAIN = Sensor(
    bracket_hz=150.0, lowpass_hz=200.0, offset=0.1, offset_drift=0.05, hum_amplitude=0.2, hum_third=0.1,
    full_scale=100.0, bits=16,
)  # fmt: skip
"""All that a sensor does but noise, whose numbers a GPU draws by itself."""

RUNS = {
    "batches": batches,
    "next step": lambda device: episodes(device, "NextStep"),
    "same step": lambda device: episodes(device, "SameStep"),
    "chain": lambda device: episodes(device, "NextStep", sensor=CHAIN),
    "hum": lambda device: episodes(device, "NextStep", sensor=dataclasses.replace(CHAIN, bits=None)),
    "renewed": renewed,
}


if __name__ == "__main__":
    np.savez(sys.argv[1], **{f"{run}: {name}": values for run in RUNS for name, values in RUNS[run]("cuda").items()})
