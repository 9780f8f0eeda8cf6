"""Each row of the rule table decides a case of its own, which gets another grade or sentence without that row."""

import dataclasses

import pytest

from discrepancy import grades
from discrepancy.criteria import Criteria
from discrepancy.grades import DISMISSED, ESTABLISHED, FAMILY, GRADES, RULES, STANDS_IN, Evidence, graded
from indexer_env.errors import ParameterError

CLEAR = Evidence(0.95, 3.0, 1.0, "size 3 N, 2.9 to 3.1", False, "", ())
CASES = {
    "size zero": ({"zero": True}, DISMISSED, "The interval of its size (size 3 N, 2.9 to 3.1) holds zero."),
    "closes nothing": (
        {"closes": 0.05}, DISMISSED, "It closes 5 % of the gap on records held out; a hint needs 10 %.",
    ),
    "size unknown": ({"untold": True}, STANDS_IN, "With it the least step of a parameter leads to another motion"),
    "at a bound": ({"bound": "size 9 N"}, STANDS_IN, "Held at the bound of what is possible: size 9 N. So"),
    "closes a part": ({"closes": 0.5}, STANDS_IN, "It closes 50 % of the gap on records held out, where a name needs"),
    "gap too small": ({"unsure": 0.65}, STANDS_IN, "The gap that it closes is so small that chance may make 65 %"),
    "not steady": ({"better": 0.4}, STANDS_IN, "In one record 40 % of what it changes becomes better, "),
    "slight": (
        {"share": 0.002, "largest": "beat"}, STANDS_IN, "It closes 0.2 % of what beat closes (mean squares), where",
    ),
    "another law": (
        {"missed": 0.2, "over": "speed [m/s]"}, STANDS_IN, "Its law leaves 20 % of what a table over the speed [m/s]",
    ),
    "another cause": (
        {"closes": 0.9, "elsewhere": "a torque at the cam"}, STANDS_IN, "Without it a torque at the cam explains",
    ),
    "size vague": (
        {"span": 4.0, "size": "height 2 rad, 1 to 4"}, STANDS_IN, "Its size (height 2 rad, 1 to 4) is known within a",
    ),
    "family": ({"alike": ("twin", "echo")}, FAMILY, "These records cannot tell it from twin or echo."),
    "established": ({}, ESTABLISHED, "It closes 95 % of the gap on records to which its size was not fitted."),
}  # fmt: skip


def test_every_row_has_a_case() -> None:
    assert list(CASES) == [rule.name for rule in RULES]
    assert {rule.grade for rule in RULES} == set(GRADES)


@pytest.mark.parametrize("name", CASES)
def test_a_row_decides_its_case(name: str, monkeypatch) -> None:
    changes, grade, said = CASES[name]
    evidence = dataclasses.replace(CLEAR, **changes)
    found = graded(evidence, Criteria())
    assert found[0] == grade and found[1].startswith(said)
    monkeypatch.setattr(grades, "RULES", tuple(rule for rule in RULES if rule.name != name))
    if name == "established":
        with pytest.raises(StopIteration):
            graded(evidence, Criteria())
    else:
        assert graded(evidence, Criteria()) != found, "the row is what decides"


def test_what_eases_the_pull_on_what_was_stated_of_a_record_is_not_slight() -> None:
    evidence = dataclasses.replace(CLEAR, share=0.002, largest="beat", eases=4.9)
    assert graded(evidence, Criteria())[0] == STANDS_IN
    assert graded(dataclasses.replace(evidence, eases=5.1), Criteria())[0] == ESTABLISHED


@pytest.mark.parametrize(("changes", "grade"), [({"closes": 0.5}, STANDS_IN), ({"better": 0.4}, ESTABLISHED)])
def test_at_the_noise_single_turns_say_little_and_the_gap_as_much_as_ever(changes: dict, grade: str) -> None:
    evidence = dataclasses.replace(CLEAR, remains=1.05, **changes)
    assert graded(evidence, Criteria())[0] == grade


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"closes": 1.5}, r"Criteria\.closes must be .* 1"),
        ({"margin": 0.0}, r"Criteria\.margin must be .* > 0"),
        ({"most": 0}, r"Criteria\.most must be a whole number >= 1"),
        ({"seconds": -1.0}, r"Criteria\.seconds must be .* > 0"),
    ],
)
def test_criteria_that_cannot_be_are_refused(changes: dict, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        Criteria(**changes)
