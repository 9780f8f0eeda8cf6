"""The state machine of an alarm: each rule fails its test when it is switched off."""

import pytest

from indexer_env.errors import ParameterError
from monitor.alarms import Condition, Limits, Rules
from monitor.alarms.condition import HOUR_NS
from monitor.analysis.finding import Size

LIMITS = Limits(3.0, 6.0, 12.0, deadband=0.2)
RULES = Rules(on_delay=3, off_delay=4, re_alarm_h=10.0)


def run(condition, *values, start=0, step_ns=1, mode="1500 rpm"):
    events = []
    for place, value in enumerate(values):
        size = value if isinstance(value, Size) else Size(value, 0.9 * value, 1.1 * value)
        events += condition.judge(start + place * step_ns, size, LIMITS, mode)
    return [(event.kind, event.level) for event in events]


@pytest.fixture
def condition():
    return Condition("backlash_deg", RULES)


def test_a_level_needs_its_turns_in_a_row(condition):
    assert run(condition, 4, 4, 1, 4, 4) == []
    assert run(condition, 4) == [("raised", "alert")]
    assert condition.active and not condition.acknowledged and condition.retained


def test_a_higher_level_raises_again_and_at_once_to_the_level_it_has(condition):
    assert run(condition, 4, 4, 4, 7, 7, 7) == [("raised", "alert"), ("raised", "alarm")]
    fresh = Condition("backlash_deg", RULES)
    assert run(fresh, 20, 20, 20) == [("raised", "danger")]


def test_a_value_on_its_way_up_is_raised_to_the_level_that_held_throughout(condition):
    assert run(condition, 4, 7, 13) == [("raised", "alert")]


def test_within_the_deadband_a_level_stays(condition):
    run(condition, 4, 4, 4)
    assert run(condition, *[2.5] * 20) == [] and condition.active


def test_below_the_deadband_it_ends_after_its_turns(condition):
    run(condition, 4, 4, 4)
    assert run(condition, 1, 1, 1, 4, 1, 1, 1) == []
    assert run(condition, 1) == [("ended", "normal")]
    assert not condition.active and condition.retained, "nobody has acknowledged it"
    condition.acknowledge(9, "eve")
    assert not condition.retained


def test_it_is_lowered_to_the_level_that_is_left(condition):
    run(condition, 13, 13, 13)
    assert run(condition, 5, 5, 5, 5) == [("lowered", "alarm")], "5 lies in the deadband of 6"
    assert run(condition, 4, 4, 4, 4) == [("lowered", "alert")]


def test_it_falls_no_further_than_to_the_highest_level_of_its_turns(condition):
    run(condition, 13, 13, 13)
    assert run(condition, 7, 7, 7, 0) == [("lowered", "alarm")], "the alarm's level was left in one turn alone"
    assert run(condition, 0, 0, 4) == [("lowered", "alert")], "in four turns in a row, of which the last was an alert"
    again = Condition("backlash_deg", RULES, condition.to_dict())
    assert run(again, 0, 0, 0) == [] and run(again, 0) == [("ended", "normal")]


def test_a_size_that_may_be_nothing_raises_nothing(condition):
    assert run(condition, *[Size(5.0, 0.0, 10.0)] * 10) == []


def test_acknowledged_it_asks_again_after_its_time_and_not_before(condition):
    run(condition, 4, 4, 4)
    assert run(condition, *[4] * 30, start=HOUR_NS, step_ns=HOUR_NS) == [], "nobody has acknowledged it"
    condition.acknowledge(31 * HOUR_NS, "eve", "seen")
    assert run(condition, *[4] * 10, start=31 * HOUR_NS, step_ns=HOUR_NS) == []
    assert run(condition, 4, start=41 * HOUR_NS) == [("again", "alert")]
    assert not condition.acknowledged


def test_a_shelved_alarm_goes_on_but_tells_nobody(condition):
    condition.shelve(0, 1.0, "eve")
    size = Size(4.0, 3.0, 5.0)
    events = [event for place in range(3) for event in condition.judge(place, size, LIMITS, "1500 rpm")]
    assert [(event.kind, event.told) for event in events] == [("raised", False)]
    (event,) = condition.judge(HOUR_NS, size, LIMITS, "1500 rpm")
    assert (event.kind, event.told) == ("unshelved", True)


def test_what_makes_no_sense_is_refused(condition):
    with pytest.raises(ParameterError, match="acknowledge"):
        condition.acknowledge(0, "eve")
    with pytest.raises(ParameterError, match="unshelve"):
        condition.unshelve(0, "eve")
    with pytest.raises(ParameterError, match="hours"):
        condition.shelve(0, 1e9, "eve")
    with pytest.raises(ParameterError, match="note"):
        condition.note(0, "eve", " ")
    run(condition, 4, 4, 4)
    with pytest.raises(ParameterError, match="note"):
        condition.acknowledge(0, "eve", "x" * 501)
    assert not condition.acknowledged


def test_an_alarm_comes_back_from_the_store_as_it_was(condition):
    run(condition, 4, 4, 4, 7, 7)
    again = Condition("backlash_deg", RULES, condition.to_dict())
    assert again.to_dict() == condition.to_dict()
    assert run(again, 7) == run(condition, 7) == [("raised", "alarm")]


@pytest.mark.parametrize("steps", [(3, 3, 4), (0, 1, 2), (3, 2, 1)])
def test_limits_rise(steps):
    with pytest.raises(ParameterError):
        Limits(*steps)


def test_turns_of_each_mode_count_apart(condition):
    """A fault that shows at one speed alone, with the speeds in turn: neither is it missed nor said to have ended."""
    for value in (20, 20, 20):
        told = [*run(condition, value, mode="fast"), *run(condition, 0.5, mode="slow")]
    assert told == [("raised", "danger")]
    assert run(condition, *[0.5] * 30, mode="slow") == [] and condition.level == 3
    assert run(condition, 5, 5, 5, mode="slow") == [], "another mode already has a worse level"
    condition.acknowledge(9, "eve")
    assert run(condition, 1, 1, 1, 1, mode="fast") == [("lowered", "alert")], "which is that of the slow mode"
    assert run(condition, 1, 1, 1, 1, mode="slow") == [("ended", "normal")]


def test_levels_of_modes_are_those_after_a_restart(condition):
    run(condition, 20, 20, 20, mode="fast"), run(condition, 4, 4, mode="slow")
    again = Condition("backlash_deg", RULES, condition.to_dict(), ["fast", "slow"])
    assert run(again, 0.5, 0.5, 0.5, mode="fast") == [] and run(again, 4, mode="slow") == []
    assert run(again, 0.5, mode="fast") == [("lowered", "alert")]


def test_what_an_earlier_version_has_left_goes_on_with_the_next_turn():
    body = {"level": 3, "acknowledged": True, "since_ns": 1, "rising": [0, 0, 0, 0], "leaving": [0, 3, 3, 3]}
    again = Condition("backlash_deg", RULES, body, ["fast", "slow"])
    assert again.level == 3 and run(again, 0.5, mode="slow") == [("ended", "normal")]
    body = {**body, "level": 0, "leaving": [0, 0, 0, 0], "rising": [0, 2, 2, 2]}
    assert run(Condition("backlash_deg", RULES, body), 20, mode="fast") == [("raised", "danger")]


def test_a_level_of_a_mode_that_is_no_more_goes_on_with_the_next_turn(condition):
    run(condition, 20, 20, 20, mode="fast"), run(condition, 4, 4, 4, mode="slow")
    again = Condition("backlash_deg", RULES, condition.to_dict(), ["slow"])
    assert again.level == 3 and run(again, *[0.5] * 4, mode="slow") == [("ended", "normal")]


def test_hours_pass_without_any_turn(condition):
    """A machine that stands still, or a sensor that is dead."""
    run(condition, 4, 4, 4)
    condition.acknowledge(0, "eve")
    condition.shelve(0, 8.0, "eve")
    assert condition.at(8 * HOUR_NS - 1) == []
    (event,) = condition.at(8 * HOUR_NS)
    assert (event.kind, event.level, event.value, event.told) == ("unshelved", "alert", None, True)
    assert condition.at(10 * HOUR_NS) == [], "it was raised two nanoseconds later"
    assert [event.kind for event in condition.at(10 * HOUR_NS + 2)] == ["again"] and not condition.acknowledged
    assert condition.at(30 * HOUR_NS) == [], "it has asked"


def test_a_part_that_was_repaired_is_seen_to_and_its_level_ends_by_turns(condition):
    run(condition, 4, 4, 4)
    event = condition.repaired(9, "eve", "new rollers")
    assert (event.kind, event.user, event.note) == ("repaired", "eve", "new rollers")
    assert condition.acknowledged and condition.active
    assert run(condition, 0, 0, 0, 0) == [("ended", "normal")]
