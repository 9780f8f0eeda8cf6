"""Golden records: the simulator still gives what it gave (tests/golden/README.md). This is no validation.

Run as a script, this file makes the golden records again and prints by how much each one changed.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from indexer_env.effects import make_effect
from indexer_env.faults import Faults
from indexer_env.machine import Joint, Machine
from indexer_env.motion_law import ModifiedTrapezoid
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.simulate import Run, simulate

FILE = Path(__file__).parents[1] / "golden" / "records.npz"
RUN = Run(samples=200, warmup_turns=0, step=0.2e-3)
TOLERANCE = 1e-9
"""Of the record's largest value: compilers and mathematical libraries differ by a few last bits, physics by more."""


def cases() -> dict[str, tuple[Machine, OperatingPoint]]:
    reference, smooth = load_machine("reference"), load_machine("smooth")
    crack = dataclasses.replace(smooth.output_joint, backlash=1e-3, stiffness_ratio=0.6)
    base = Joint(stiffness=1e6, damping=500.0, backlash=1e-4)
    everything = [
        make_effect(name, parameters)
        for name, parameters in {
            "friction.coulomb": {"torque": 5.0}, "friction.viscous": {"coefficient": 3.0},
            "friction.stribeck": {"torque": 4.0}, "load.imbalance": {"torque": 6.0},
            "load.process": {"torque": 20.0, "centre": 0.2}, "drive.slip": {"compliance": 1.0},
            "drive.speed_ripple": {"depth": 0.02}, "drive.transmission_error": {"amplitude": 1e-4},
            "drive.mesh_stiffness": {"depth": 0.1}, "cam.profile_error": {"height": 1e-4},
            "cam.station_spacing": {"error": 1e-3}, "roller.crack_single": {"stiffness_loss": 0.2},
            "output.cubic_stiffness": {"stiffness": 1e8}, "base.looseness": {"compliance": 1e-6},
        }.items()
    ]  # fmt: skip
    here, mid = OperatingPoint(), OperatingPoint(motor_speed=200.0, load_torque=15.0, start_angle=1.2)
    return {
        "smooth": (smooth, here),
        "reference": (reference, here),
        "model A, trapezoid": (dataclasses.replace(smooth, model="A", motion_law=ModifiedTrapezoid()), mid),
        "on its base, damped play": (
            dataclasses.replace(reference, model="B_on_base", base_joint=base, contact_law="damped_play"), mid,
        ),
        "bilinear with play, Kelvin-Voigt": (
            dataclasses.replace(smooth, output_joint=crack, contact_law="kelvin_voigt"), here,
        ),
        "three faults": (Faults(roller_crack=0.4, screw_looseness=0.5, backlash=0.3).applied_to(reference), here),
        "every effect": (reference.with_effects(*everything), mid),
    }  # fmt: skip


def record(machine: Machine, point: OperatingPoint) -> np.ndarray:
    return simulate(machine, point, RUN).table_acceleration


@pytest.mark.parametrize("case", cases())
def test_the_record_is_the_golden_one(case):
    with np.load(FILE) as golden:
        assert set(golden.files) == set(cases())
        expected = golden[case]
    assert expected.dtype == np.float64 and expected.shape == (RUN.samples,)
    found = record(*cases()[case])
    np.testing.assert_allclose(found, expected, rtol=0, atol=TOLERANCE * np.abs(expected).max())


def make_again() -> None:
    before = dict(np.load(FILE)) if FILE.exists() else {}
    after = {case: record(*items) for case, items in cases().items()}
    for case, values in after.items():
        if case not in before:
            print(f"{case}: new")
        elif (change := np.abs(values - before[case])).any():
            first = int(np.argmax(change > TOLERANCE * np.abs(values).max()))
            print(f"{case}: by {change.max():.3g} of {np.abs(values).max():.3g} rad/s² at most, from {first} ms on")
        else:
            print(f"{case}: the same")
    for case in before.keys() - after.keys():
        print(f"{case}: gone")
    np.savez_compressed(FILE, **after)


if __name__ == "__main__":
    make_again()
