"""Which of several causes is said to be where a remainder comes from."""

from collections.abc import Sequence

import numpy as np

from discrepancy.origin import Form, Origin, Residue, origin_of
from discrepancy.origin.choose import _PARTS
from indexer_env.effects import EFFECTS
from tests.discrepancy.origin.test_residue import laid

SHAPE = (10, 320)


def rows(seed: int) -> np.ndarray:
    """Readings (w, n, 2) of a cause: slow waves, each window with its own phases."""
    rng = np.random.default_rng(seed)
    turns = rng.uniform(1.0, 6.0, (SHAPE[0], 1, 2)) * np.linspace(0.0, 1.0, SHAPE[1])[:, None]
    return np.sin(2.0 * np.pi * (turns + rng.uniform(0.0, 1.0, (SHAPE[0], 1, 2))))


def form(name: str, columns: np.ndarray, price: float = 0.0) -> Form:
    joint, kind = name.split(".")
    return Form(joint, kind, name, columns, price)


def asked(
    residual: np.ndarray, causes: dict[str, np.ndarray], free: Sequence[tuple[str, float]] = (), **price
) -> Origin | None:
    """Where a residual comes from, of causes by "joint.kind"."""
    residue = Residue(laid(residual))
    forms = [form(name, residue.clean(x), price.get(name.split(".")[0], 0.0)) for name, x in causes.items()]
    at_any_time = [(form(name, np.zeros((0, 0))), won) for name, won in free]
    return origin_of(residue, forms, lambda left: (), at_any_time)


CAUSES = {"input.phase": rows(1), "output.station": rows(2), "sensor.time": rows(3)}
NOISE = np.random.default_rng(9).standard_normal(SHAPE)


def test_the_cause_that_acts_is_found_and_its_share() -> None:
    found = asked(NOISE + 0.7 * CAUSES["sensor.time"].sum(axis=2), CAUSES)
    assert found is not None and (found.first.joint, found.first.kind) == ("sensor", "time")
    assert found.first.probability > 0.95 and 0.8 < found.share <= 1.0 and not found.alike and not found.beside


def test_noise_comes_from_nowhere() -> None:
    assert asked(NOISE, CAUSES) is None


def test_of_several_causes_the_largest_is_first_and_the_others_are_told() -> None:
    small, large = CAUSES["input.phase"].sum(axis=2), CAUSES["output.station"].sum(axis=2)
    found = asked(NOISE + 0.3 * small + 0.6 * large, CAUSES)
    assert found is not None and found.first.kind == "station"
    assert [place.name for place in found.beside] == ["input.phase"]
    assert 0.6 < found.share < 0.95


def test_share_and_company_are_those_of_the_cause_that_is_named() -> None:
    """The base explains most, and the output joint, which holds most of the same, is more probable beforehand."""
    base, other = rows(4), CAUSES["sensor.time"]
    causes = {"base.time": base, "output.time": base + 0.2 * rows(8), "sensor.time": other}
    residual = NOISE + 0.5 * base.sum(axis=2) + 0.3 * other.sum(axis=2)
    found, alone = asked(residual, causes), asked(residual, {name: causes[name] for name in causes if name[0] != "b"})
    assert found is not None and alone is not None
    assert found.first.name == alone.first.name == "output.time"
    assert abs(found.share - alone.share) < 1e-3 and found.beside == alone.beside


def test_where_two_joints_look_alike_the_one_with_more_parts_is_said_and_the_other_told() -> None:
    same = rows(4)
    found = asked(NOISE + 0.5 * same.sum(axis=2), {"base.time": same, "input.time": same, "output.time": same})
    assert found is not None and found.first.joint == "output"
    assert 0.4 < found.first.probability < 0.8
    close = asked(NOISE + 0.5 * same.sum(axis=2), {"input.time": same, "sensor.time": same})
    assert close is not None and [place.joint for place in close.alike] == ["sensor"]


def test_a_form_that_was_chosen_among_many_pays_for_that() -> None:
    """Seed 5: two rows that are the same, the output's of a price that outweighs its parts."""
    same = rows(5)
    causes = {"input.phase": same, "output.phase": same}
    residual = NOISE + 0.15 * same.sum(axis=2)
    free, paid = asked(residual, causes), asked(residual, causes, output=20.0)
    assert free is not None and free.first.joint == "output"
    assert paid is not None and paid.first.joint == "input"


def test_a_torque_free_over_time_wins_where_nothing_orders_the_remainder() -> None:
    residual = NOISE + 0.2 * CAUSES["input.phase"].sum(axis=2)
    unordered = asked(residual, CAUSES, [("output.time", 1000.0)])
    assert unordered is not None and (unordered.first.joint, unordered.first.kind) == ("output", "time")
    ordered = asked(residual, CAUSES, [("output.time", 5.0)])
    assert ordered is not None and ordered.first.kind == "phase"


def test_two_causes_that_cancel_explain_much_and_are_needed_less() -> None:
    """Seeds 6 and 7: the input's is the output's and a little more, so that their difference is large in each and
    small in sum."""
    other = CAUSES["sensor.time"]
    one = rows(6)
    twin = one + 0.1 * rows(7)
    residual = NOISE + 0.6 * other.sum(axis=2) + 0.3 * one.sum(axis=2) + 4.0 * (twin - one).sum(axis=2)
    found = asked(residual, {"sensor.time": other, "output.station": one, "input.phase": twin})
    assert found is not None and (found.first.joint, found.first.kind) == ("sensor", "time")
    assert {place.name for place in found.beside} == {"output.station", "input.phase"}


def test_a_cause_that_comes_to_light_beside_another_one_may_be_the_first() -> None:
    early, late = CAUSES["input.phase"], CAUSES["output.station"]
    residue = Residue(laid(NOISE + 0.3 * early.sum(axis=2) + 0.6 * late.sum(axis=2)))

    def scan(left: Residue) -> list[Form]:
        return [] if left is residue else [form("output.station", residue.clean(late))]

    found = origin_of(residue, [form("input.phase", residue.clean(early))], scan, ())
    assert found is not None and found.first.name == "output.station"
    assert [place.name for place in found.beside] == ["input.phase"]


def test_a_joint_is_as_probable_as_it_has_effects() -> None:
    of_quantity = {
        "the motor's speed through the torque of joint 1": "input", "drive side of joint 1": "input",
        "torque of joint 1": "input", "motion law": "output", "torque of joint 2": "output", "table torque": "output",
        "joint 3": "base", "sensor": "sensor",
    }  # fmt: skip
    joints = [of_quantity[effect.enters] for effect in EFFECTS.values()]
    assert {joint: joints.count(joint) for joint in joints} == _PARTS


def test_a_place_has_the_name_of_the_cause_that_speaks_for_it() -> None:
    """Two causes of one joint and kind: alone the first explains more, as it holds a part of the third one, too; beside
    that one the second explains all that is left."""
    second, third = rows(5), CAUSES["sensor.time"]
    both = 2.0 * second.sum(axis=2, keepdims=True) + third.sum(axis=2, keepdims=True)
    residue = Residue(laid(NOISE + both[..., 0]))
    forms = [
        Form("input", "phase", "the first", residue.clean(both + rows(6).sum(axis=2, keepdims=True))),
        Form("input", "phase", "the second", residue.clean(second)),
        Form("sensor", "time", "the third", residue.clean(third)),
    ]
    alone = {form.name: residue.evidence(form.columns)[0] for form in forms}
    assert alone["the first"] > alone["the second"]
    found = origin_of(residue, forms, lambda left: (), ())
    assert found is not None and found.first.name == "the second"
