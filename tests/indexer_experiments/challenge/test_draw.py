"""What is hidden: a function of seed and number, taken in turn, refused where it cannot be."""

import pytest

from discrepancy.indexer.parameters import UNCERTAINTY, read
from indexer_env.effects import EFFECTS
from indexer_env.errors import ParameterError
from indexer_experiments.challenge.draw import HIDDEN, KINDS, Order, draw, nominal_machine


def test_every_effect_of_the_library_is_hidden_in_turn() -> None:
    assert set(HIDDEN) == set(EFFECTS)
    order = Order(len(HIDDEN), 3)
    assert {draw(order, k).hidden[0].name for k in range(order.count)} == set(HIDDEN)


@pytest.mark.parametrize("kind", KINDS)
def test_a_case_depends_on_seed_and_number_alone(kind: str) -> None:
    first, again, other = draw(Order(5, 3, kind), 4), draw(Order(50, 3, kind), 4), draw(Order(5, 4, kind), 4)
    assert (first.truth, first.hidden, first.removed) == (again.truth, again.hidden, again.removed)
    assert first.truth != other.truth
    assert len(first.hidden) == {"single": 1, "none": 0, "outside": 1, "two": 2}[kind]
    assert first.removed == (tuple(e.name for e in first.hidden) if kind == "outside" else ())


def test_the_machine_is_drawn_within_a_tenth() -> None:
    drawn = draw(Order(1, 3), 0)
    factors = [read(drawn.truth, name) / read(drawn.nominal, name) for name in UNCERTAINTY]
    assert all(0.9 <= factor <= 1.1 for factor in factors)
    assert len(set(factors)) == len(factors)


def test_play_is_given_at_the_motor_shaft() -> None:
    assert nominal_machine("20").input_joint.backlash == pytest.approx(13.62e-3, rel=1e-3)
    assert nominal_machine("none").input_joint.backlash == 0.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"kind": "singel"}, r"challenge\.kind must be one of .*got 'singel'; did you mean 'single'"),
        ({"play": "6"}, r"challenge\.play must be one of"),
        ({"gap": (3.0, 2.0)}, r"challenge\.gap\[1\] must be .*3.*, got 2\.0"),
        ({"gap": (3.0,)}, r"challenge\.gap must be two numbers"),
        ({"turns": 0.1}, r"challenge\.turns must be"),
        ({"count": 0}, r"challenge\.count must be"),
    ],
)
def test_a_challenge_that_cannot_be_is_refused(arguments: dict, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        Order(**{"count": 1, "seed": 0, **arguments})


@pytest.mark.parametrize(
    ("name", "field", "largest"), [("drive.mesh_stiffness", "depth", 0.35), ("drive.mesh_friction", "loss", 0.45)]
)
def test_the_mesh_neither_shakes_the_machine_to_pieces_nor_locks_itself(name: str, field: str, largest: float) -> None:
    number = list(HIDDEN).index(name)
    (effect,) = draw(Order(23, 4, gap=(10.0, 10.0)), number).hidden
    assert getattr(effect, field) == largest
