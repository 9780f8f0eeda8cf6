"""A drive made up with known friction is told from nothing but its inertia. (The measured one: benchmarks/emps.py.)"""

import numpy as np
import pytest

from discrepancy.emps import EmpsModel, Motion
from discrepancy.explain import explain


@pytest.fixture(scope="module")
def drives() -> tuple[EmpsModel, EmpsModel]:
    """Seed 2: two motions of 12 s at 1 kHz, 95 kg, 200 N s/m, 20 N of dry friction, 0.3 N of noise."""
    rng = np.random.default_rng(2)
    time = np.arange(12000) * 1e-3
    made = []
    for shift in (0.0, 0.7):
        position = 0.1 * np.sin(1.3 * time + shift) + 0.03 * np.sin(4.1 * time)
        rate = np.gradient(position, 1e-3)
        motion = Motion(position, rate, np.gradient(rate, 1e-3), 1e-3)
        force = 95.0 * motion.acceleration + 200.0 * rate + 20.0 * motion.sign
        made.append(EmpsModel(motion, force + 0.3 * 3.0 * rng.standard_normal(len(time)), 0.3))
    return made[0], made[1]


def test_both_frictions_are_found_one_after_the_other(drives) -> None:
    answer = explain(*drives)
    assert answer.verdict == "named"
    assert set(answer.names) == {"friction.coulomb", "friction.viscous"}
    place = answer.best.place
    values = [p.value(z) for p, z in zip(answer.model.parameters, place.z, strict=True)]
    found = dict(zip((p.name for p in answer.model.parameters), values, strict=True))
    assert found["mass"] == pytest.approx(95.0, rel=0.02)
    assert found["friction.viscous.coefficient"] == pytest.approx(200.0, rel=0.02)
    assert found["friction.coulomb.force"] == pytest.approx(20.0, rel=0.02)
    assert answer.closed_share > 0.98


def test_with_both_frictions_known_nothing_is_missing(drives) -> None:
    model, held_out = drives
    for name in ("friction.coulomb", "friction.viscous"):
        hypothesis = model.hypotheses()[name][0]
        model, held_out = model.extended(hypothesis), held_out.extended(hypothesis)
    assert explain(model, held_out).verdict == "none"
