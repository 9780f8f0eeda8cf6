"""The score of the drives' challenge: one finding per hidden effect, what is left over is wrong."""

import dataclasses

import pytest

from indexer_experiments.challenge.drives.score import Judged, table

Names = tuple[str, ...]


def said(hidden: Names, *named: Names, unknown: Names = ()) -> Judged:
    return Judged(0, hidden, unknown, named, (), 9.0, 1.0, 1.0, 2.0)


def test_a_family_and_another_name_of_the_same_physics_are_right() -> None:
    assert said(("delay",), ("loop_lag", "compliance")).right == ("delay",)
    assert said(("delay",), ("loop_lag", "compliance")).wrong == ()
    assert said(("delay",), ("cogging",)).right == ()
    assert said(("delay",), ("cogging",)).wrong == (("cogging",),)


def test_one_finding_is_one_of_two_effects() -> None:
    family = said(("friction.coulomb", "friction.stribeck"), ("friction.coulomb", "friction.stribeck"))
    assert len(family.right) == 1 and family.wrong == ()


def test_a_second_finding_for_one_effect_is_wrong() -> None:
    twice = said(("delay",), ("loop_lag",), ("delay",))
    assert twice.right == ("delay",) and len(twice.wrong) == 1 and twice.unlisted == twice.wrong


def test_findings_are_matched_so_that_the_most_effects_are_named() -> None:
    """The family fits both, the other finding one alone, in either order."""
    family, alone = ("offset", "spring.linear"), ("offset",)
    for named in ((family, alone), (alone, family)):
        both = said(("offset", "spring.linear"), *named)
        assert both.right == ("offset", "spring.linear") and both.wrong == ()


@pytest.mark.parametrize(
    ("hidden", "unknown"), [(("play.contact",), ()), ((), ("bending",)), (("offset",), ("bending",))]
)
def test_what_comes_with_something_is_neither_right_nor_wrong(hidden: Names, unknown: Names) -> None:
    case = said(hidden, ("friction.coulomb",), unknown=unknown)
    assert case.right == () and case.wrong == () and case.unlisted == ()
    again = dataclasses.replace(case, named=(("friction.coulomb",), ("friction.coulomb", "cogging")))
    assert len(again.wrong) == 1, "once"


def test_a_law_that_describes_a_disturbance_is_counted_apart() -> None:
    hinge = said((), ("spring.bilinear",), unknown=("cable",))
    assert hinge.wrong == () and hinge.unlisted == hinge.named
    twice = dataclasses.replace(hinge, named=(("spring.bilinear",), ("spring.bilinear", "end_stop")))
    assert len(twice.wrong) == 1 and len(twice.unlisted) == 2
    assert "nothing hidden: 0 of 1 (0 %); with the names of laws that describe a disturbance to 95 %: 1" in table(
        [hinge]
    )


def test_the_table_counts_right_and_wrong() -> None:
    cases = [said(("delay",), ("loop_lag", "compliance")), said(("delay",), ("cogging",)), said((), ("cogging",))]
    text = table(cases)
    assert "hidden effects named: 1 of 2 (50 %); in a family with other names: 1" in text
    assert "something hidden: 1 of 2" in text and "nothing hidden: 1 of 1" in text
    assert "cases 0: 0 with nothing hidden" in table([])
