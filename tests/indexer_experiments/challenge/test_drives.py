"""The challenge's drives: cases that their seed alone decides, sizes that are what is said of them."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from discrepancy.criteria import Criteria
from discrepancy.drives.effects.friction import dahl
from indexer_experiments.challenge.drives.draw import VERSION, draw
from indexer_experiments.challenge.drives.laws import HIDDEN, TUNED, UNKNOWN
from indexer_experiments.challenge.drives.motions import KINDS, reference
from indexer_experiments.challenge.drives.plant import FIELDS, simulate_plant
from indexer_experiments.challenge.drives.score import LIKE
from indexer_experiments.challenge.drives.sizes import RATE, SECONDS, sized, sizes_of


def test_a_drive_that_its_controller_loses_is_drawn_again() -> None:
    """Case 144 of seed 67 was lost to 1e82 m when first drawn."""
    assert all(np.ptp(record.rows["q"]) < 20.0 * 3.0 for record in draw(67, 144).records)


def test_a_case_is_a_function_of_seed_and_number() -> None:
    one, again, other = draw(3, 5), draw(3, 5), draw(3, 6)
    assert (one.hidden, one.unknown) == (again.hidden, again.unknown)
    np.testing.assert_array_equal(one.records[0].rows["force"], again.records[0].rows["force"])
    assert one.records[0].rows["force"].shape != other.records[0].rows["force"].shape or not np.array_equal(
        one.records[0].rows["force"], other.records[0].rows["force"]
    )


def test_cases_are_those_of_their_version() -> None:
    """Cases of seed 3; where this fails although nothing is wrong, raise VERSION: kept cases are then not mixed."""
    golden = [
        (("spring.linear",), ("cable",), 0.128240), (("play.contact",), (), 0.562091), (("end_stop",), (), 10.877663),
    ]  # fmt: skip
    assert VERSION == 2
    for number, (hidden, unknown, size) in enumerate(golden):
        case = draw(3, number)
        assert (case.hidden, case.unknown) == (hidden, unknown)
        assert np.std(case.records[0].rows["force"]) == pytest.approx(size, rel=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_references_have_the_stroke_of_one(kind: str) -> None:
    row = reference(kind, 4000, 4.0, np.random.default_rng(2))
    assert (row.min(), row.max()) == pytest.approx((-0.5, 0.5))


def small_drive(kind: str, stroke: float, coulomb: float) -> tuple[dict[str, float], list[np.ndarray]]:
    """A drive of 2 kg with dry friction of this share of its inertia's force, and its motion. Seed 3."""
    motion = stroke * reference(kind, round(SECONDS * RATE), 4.0, np.random.default_rng(3))
    speed = np.gradient(motion, 1.0 / RATE)
    force = 2.0 * float(np.std(np.gradient(speed, 1.0 / RATE)))
    return {"mass": 2.0, "viscous": 0.4 * force / float(np.std(speed)), "coulomb": coulomb * force}, [motion]


def force_of(values: dict[str, float], motion: np.ndarray) -> np.ndarray:
    return simulate_plant(values, motion, RATE, (2.0 * 3600.0, 2.0 * 96.0), steps=25).force


@pytest.mark.parametrize("stroke", [0.01, 3.0])
@pytest.mark.parametrize(("kind", "coulomb"), [("point_to_point", 0.3), ("point_to_point", 0.0), ("sines", 0.3)])
def test_every_disturbance_does_what_was_asked(kind: str, coulomb: float, stroke: float) -> None:
    """0.02 of the rms force, with and without dry friction. Seed 4."""
    base, motions = small_drive(kind, stroke, coulomb)
    sizes, plain = sizes_of(base, motions), force_of(base, motions[0])
    for name, law in UNKNOWN.items():
        values = sized(law, base, sizes, (0.02, 0.02), motions, np.random.default_rng(4))
        assert values is not None and set(values) <= set(FIELDS), name
        moved = force_of({**base, **values}, motions[0]) - plain
        assert 0.25 < np.sqrt(np.mean(moved**2)) / (0.02 * np.sqrt(np.mean(plain**2))) < 4.0, name


OF_THE_PLANT = [name for name in HIDDEN if not name.startswith(("sensor.", "play", "delay", "loop_lag"))]


@pytest.mark.parametrize("name", OF_THE_PLANT)
def test_a_hidden_effect_changes_the_force_by_what_is_said(name: str) -> None:
    """0.1 to 0.5 of the rms force. Seed 5."""
    base, motions = small_drive("sines", 0.8, 0.0 if name == "friction.coulomb" else 0.3)
    values = sized(HIDDEN[name], base, sizes_of(base, motions), (0.1, 0.5), motions, np.random.default_rng(5))
    plain = force_of(base, motions[0])
    assert values is not None
    moved = force_of({**base, **values}, motions[0]) - plain
    assert 0.09 < np.sqrt(np.mean(moved**2) / np.mean(plain**2)) < 0.55


def test_a_law_is_asked_for_no_more_than_it_can_do() -> None:
    """Friction that differs between directions cannot exceed the friction that is there: at 0.05 of the force it never
    reaches 0.1, at 0.3 it gets a size below that. Seeds 6 to 9."""
    asked = (HIDDEN["friction.asymmetric"], (0.1, 0.5))
    for seed in range(6, 10):
        for coulomb in (0.05, 0.3):
            base, motions = small_drive("sines", 0.8, coulomb)
            law, span = asked
            values = sized(law, base, sizes_of(base, motions), span, motions, np.random.default_rng(seed))
            assert values is None if coulomb == 0.05 else values is not None
            assert values is None or 0.0 < values["asymmetric"] <= base["coulomb"]


def test_disturbances_that_may_be_tuned_on_are_some_of_all() -> None:
    assert len(UNKNOWN) >= 8 and set(TUNED) < set(UNKNOWN) and not set(HIDDEN) & set(UNKNOWN)


def test_laws_that_describe_a_disturbance_leave_less_than_a_law_may() -> None:
    """The disturbances over a path of two sines, and the best of these laws."""
    t = np.linspace(0.0, 60.0, 20001)
    x = 0.7 * np.sin(t) + 0.3 * np.sin(2.31 * t + 1.0)
    bouc_wen, w = np.zeros_like(x), 0.0
    for k, d in enumerate(np.diff(x)):
        w += (d - 0.5 * abs(d) * w * abs(w) - 0.5 * d * w * w) / 0.2
        bouc_wen[k + 1] = w
    root, v = np.sqrt(np.abs(x)) * np.sign(x), np.gradient(x, t)
    tried = {
        ("cable", "spring.bilinear"): (np.maximum(x, 0.0) ** 3, lambda p: p[0] * np.maximum(x - p[1], 0.0)),
        ("hysteresis", "friction.presliding"): (bouc_wen, lambda p: p[0] * dahl(x, abs(p[1]))),
        ("thickening", "friction.quadratic"): (v * np.sqrt(np.abs(v)), lambda p: p[0] * v * np.abs(v)),
        ("sag", "load.imbalance"): (root, lambda p: p[0] * np.sin(x + p[1])),
        ("sag", "ripple"): (root, lambda p: p[0] * np.sin(2.0 * x + p[1])),
        ("sag", "spring.linear"): (root, lambda p: p[0] * x),
        ("sag", "spring.cubic"): (root, lambda p: p[0] * x + p[1] * x**3),
    }
    assert set(tried) == {(one, name) for one, names in LIKE.items() for name in names}
    for force, law in tried.values():
        left = least_squares(lambda p, force=force, law=law: law(p) - force, (1.0, 0.2)).fun
        assert left @ left < Criteria().law * (force @ force)
