"""Blocks come out in their order, and what was wrong with it is a state."""

from dataclasses import replace

import pytest

from monitor.intake.blocks import NANO
from monitor.intake.order import HOLD, SET_BACK, Order
from monitor.intake.states import States
from tests.monitor.fakes import block


@pytest.fixture
def states():
    return States()


@pytest.fixture
def order(states):
    return Order(states, jitter=0.02)


def numbered(place: int, **more):
    return block(50 * place, sequence=place, **more)


def firsts(placed):
    return [(one.block.start_ns - block(0).start_ns) * 100 // NANO for one in placed]


@pytest.mark.parametrize("make", [numbered, lambda place: block(50 * place)], ids=["numbered", "by time"])
class TestWithAndWithoutNumbers:
    def test_blocks_in_their_order_pass(self, order, states, make):
        placed = [one for place in range(4) for one in order.offer(make(place))]
        assert firsts(placed) == [0, 50, 100, 150]
        assert [one.restart for one in placed] == [True, False, False, False]
        assert states.active == []

    def test_one_that_comes_twice_is_used_once(self, order, states, make):
        order.offer(make(0))
        order.offer(make(1))
        assert order.offer(make(1)) is None and order.offer(make(0)) is None
        assert states.count("double") == 2

    def test_two_that_changed_places_are_sorted(self, order, states, make):
        order.offer(make(0))
        assert order.offer(make(2)) == []
        assert firsts(order.offer(make(1))) == [50, 100]
        assert states.active == ["reordered"]

    def test_a_missing_one_is_a_gap_after_some_blocks(self, order, states, make):
        order.offer(make(0))
        for place in range(2, 1 + HOLD):
            assert order.offer(make(place)) == []
        placed = order.offer(make(1 + HOLD))
        assert firsts(placed) == [50 * place for place in range(2, 2 + HOLD)]
        assert [one.restart for one in placed] == [True, *[False] * (HOLD - 1)]
        assert states.active == ["gap"]

    def test_a_missing_one_is_a_gap_when_waiting_ends(self, order, states, make):
        order.offer(make(0))
        order.offer(make(2))
        assert firsts(order.flush()) == [100] and states.count("gap") == 1

    def test_one_that_comes_after_the_gap_is_late(self, order, states, make):
        order.offer(make(0))
        order.offer(make(2))
        order.flush()
        assert order.offer(make(1)) is None
        assert "late" in states.active


def test_a_clock_that_was_set_loses_nothing_where_blocks_are_numbered(order, states):
    order.offer(numbered(0))
    moved = replace(numbered(1), start_ns=numbered(1).start_ns - 3600 * NANO)
    (placed,) = order.offer(moved)
    assert not placed.restart and placed.shift_ns == -3600 * NANO and states.active == ["clock_step"]


def test_a_clock_that_was_set_back_is_believed_after_three_blocks(order, states):
    for place in range(3):
        order.offer(block(50 * place))
    back = [block(50 * place, start_ns=block(50 * place).start_ns - 100 * NANO) for place in range(3, 6)]
    assert order.offer(back[0]) is None and order.offer(back[1]) is None
    (placed,) = order.offer(back[2])
    assert placed.restart and placed.shift_ns < -98 * NANO and "clock_step" in states.active


def test_a_sender_that_counts_from_0_again_goes_on(order):
    order.offer(numbered(7))
    (placed,) = order.offer(replace(numbered(8), sequence=0))
    assert placed.block.sequence == 0


def test_a_sender_that_counts_from_0_again_with_its_clock_set_back_goes_on(order, states):
    for place in range(20):
        order.offer(numbered(place))
    back = [numbered(place, start_ns=numbered(place).start_ns - 3600 * NANO) for place in range(60)]
    told = [order.offer(one) for one in back]
    assert told[: SET_BACK - 1] == [None] * (SET_BACK - 1) and all(len(one or []) == 1 for one in told[SET_BACK - 1 :])
    assert states.count("clock_step") == 1 and states.count("gap") == 0


def test_what_waited_when_a_numbered_clock_was_set_back_is_used_first(order):
    for place in (0, 1, 2, 3, 5):
        order.offer(numbered(place))
    back = [numbered(place, start_ns=numbered(place).start_ns - 3600 * NANO) for place in range(SET_BACK)]
    assert order.offer(back[0]) is None and order.offer(back[1]) is None
    assert [one.block.sequence for one in order.offer(back[2])] == [5, 2] and not order.waiting


def test_numbers_tell_blocks_that_come_too_late_from_a_clock_that_was_set_back(order, states):
    for place in (0, *range(4, 4 + HOLD)):
        order.offer(numbered(place))
    assert [order.offer(numbered(place)) for place in (1, 2, 3)] == [None] * 3
    assert states.count("late") == 3 and "clock_step" not in states.active


def test_a_recording_that_begins_is_no_gap(order, states):
    order.offer(block(0, begins=True))
    (placed,) = order.offer(block(5000, begins=True))
    assert placed.restart and states.active == []


def test_a_wrong_rate_is_told_and_a_right_one_is_not(states):
    for share, told in ((1.0, []), (1.0005, []), (1.004, ["rate_error"])):
        order, states = Order(states := States(), jitter=0.02), states
        for place in range(400):
            start = block(0).start_ns + round(place * 0.5 * share * NANO)
            order.offer(block(50 * place, start_ns=start))
        assert states.active == told


def test_jitter_is_no_gap(order, states):
    for place in range(20):
        off = (-1) ** place * 8_000_000
        assert len(order.offer(block(50 * place, start_ns=block(50 * place).start_ns + off))) == 1
    assert states.active == []


@pytest.mark.parametrize("more", [{}, {"begins": True}], ids=["follows", "begins"])
def test_what_was_seen_before_a_restart_comes_twice_and_not_late(order, states, more):
    for place in range(5):
        order.offer(numbered(place, **more))
    again = Order(states, jitter=0.02)
    again.offer(numbered(4, **more))
    again.seen = order.seen
    assert again.offer(numbered(3, **more)) is None and again.offer(numbered(4, **more)) is None
    assert states.active == ["double"] and states.count("double") == 2
    assert firsts(again.offer(numbered(5, **more))) == [250]


def test_what_was_used_before_a_restart_comes_twice(states):
    order = Order(states, jitter=0.02, used_until_ns=block(100).start_ns)
    assert order.offer(block(50)) is None and states.active == ["double"]
    assert firsts(order.offer(block(100))) == [100]


@pytest.mark.parametrize("lost", [0, 1])
def test_a_clock_that_was_set_back_is_told_though_a_block_was_lost_there(order, states, lost):
    """Numbers go on an hour earlier; turns that end later than the new time must not be taken for told."""
    order.offer(numbered(0))
    back = [replace(numbered(k), start_ns=numbered(k).start_ns - 3600 * NANO) for k in range(1 + lost, 6 + lost)]
    placed = [one for one_block in back for one in order.offer(one_block) or []] + order.flush()
    shifts = [one.shift_ns for one in placed if one.shift_ns]
    assert len(placed) == 5 and "clock_step" in states.active
    assert shifts == [-3600 * NANO + lost * back[0].end_ns - lost * back[0].start_ns]


def test_a_recording_that_begins_earlier_than_the_last_one_ended_is_used(order, states):
    order.offer(numbered(10))
    (placed,) = order.offer(replace(block(0), begins=True))
    assert placed.restart and placed.shift_ns < 0 and states.active == ["clock_step"]


def test_samples_that_were_lost_are_no_clock_that_was_set_forward(order, states):
    order.offer(block(0))
    order.offer(block(5000))
    (placed,) = order.flush()
    assert placed.restart and placed.shift_ns == 0 and states.active == ["gap"]


def test_a_counter_that_begins_anew_at_its_end_is_no_gap(order, states):
    """Sixteen bits: 65535, then 0, also where a block before it was lost."""
    for place in range(6):
        (placed,) = order.offer(block(50 * place, sequence=(65533 + place) % 65536))
        assert placed.restart == (place == 0)
    assert states.active == []
    assert order.offer(block(350, sequence=65535)) == []
    assert [one.restart for one in order.offer(block(400, sequence=0))] == [True, False]
    assert states.count("gap") == 1
