"""answer.html: verdict, place, size, evidence and what to do stand on it."""

from __future__ import annotations

import dataclasses
import math

import pytest

from tests.twin.builders import MACHINE, Fixed
from tests.twin.test_answer import MATTERS, network, physics
from tests.twin.test_judge import twin as made
from twin.answer import answer_of
from twin.diagnosis import FAULTY, HEALTHY, NOT_COMPARABLE, UNKNOWN
from twin.faults import FAULTS, number_of
from twin.report.answer import PLACES, advice_of, answer_page
from twin.twin import Twin


def twin(trusted: bool = True) -> Twin:
    found = made(Fixed(1.0, [0.0] * len(FAULTS)))
    check = {"trusted": trusted, "reason": "Not to be trusted: two of two turns."}
    return dataclasses.replace(found, about={**found.about, "check": check})


def page(seen, found=None, trusted: bool = True) -> str:
    answer = answer_of(seen, found, MACHINE, MATTERS)
    return answer_page(answer, [("today.csv", seen)], twin(trusted))


def test_a_fault_stands_with_its_place_size_evidence_and_what_to_do():
    said = page(network(FAULTY, "friction"), physics(FAULTY, ("crack", 0.5), level=3.0))
    for words in ("cracked rollers", "turret, all rollers", "30 % of stiffness lost (27 to 33)", "today.csv"):
        assert words in said
    assert "Inspect the rollers" in said and "5.0 times the noise" in said and "3.0 times" in said
    assert "By the networks alone: growing friction" in said and "Caution" not in said
    assert 'style="left: 50.0%"' in said


def test_each_size_says_at_which_level_its_interval_holds():
    sizes = {"probabilities": {"friction": 0.9}, "severities": {"friction": (1.0, 0.5, 1.5)}}
    said = page(dataclasses.replace(network(FAULTY, "friction"), **sizes))
    assert "90 % interval</span>" in said and "95 % interval" not in said and "were it there (90 % interval)" in said
    said = page(network(HEALTHY), physics(FAULTY, ("crack", 0.5)))
    assert "95 % interval</span>" in said and "90 % interval</span>" not in said


def test_why_physics_says_nothing_is_told():
    answer = answer_of(network(HEALTHY), None, MACHINE, MATTERS)
    assert "None. It was not asked for (physics=false)." in answer_page(answer, [], twin())
    short = dataclasses.replace(answer, no_physics="The records must hold 4 whole cam turns, got 3.")
    said = answer_page(short, [], twin())
    assert "None. The records must hold 4 whole cam turns, got 3." in said and "not asked" not in said


@pytest.mark.parametrize(
    ("verdict", "advice"),
    [(HEALTHY, "Nothing: go on"), (UNKNOWN, "look at the machine"), (NOT_COMPARABLE, "state what was different")],
)
def test_every_verdict_says_what_to_do(verdict, advice):
    assert advice in page(network(verdict))


def test_a_twin_that_is_not_to_be_trusted_says_so_on_every_answer():
    assert "<b>Caution:</b> Not to be trusted" in page(network(HEALTHY), trusted=False)


def test_every_fault_of_the_table_has_a_place_and_advice():
    assert set(PLACES) == set(FAULTS)


def test_a_sensor_is_mended_before_the_machine():
    seen = network(FAULTY, "crack", "sensor_loose")
    answer = answer_of(seen, None, MACHINE, {})
    assert advice_of(answer)[0].startswith("Fasten the sensor")


def test_a_slight_fault_is_watched():
    answer = answer_of(network(FAULTY, "friction", matters=False), None, MACHINE, MATTERS)
    assert any(one.startswith("Keep an eye on growing friction") for one in advice_of(answer))


def test_what_is_without_limit_is_told_as_a_number_of_the_shop():
    assert number_of(math.inf) == "over 1000" and number_of(0.12345) == "0.123" and number_of(-3.0) == "-3"
