"""A clock that is set loses no turn and doubles none, not even where the monitor is started anew just then."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from monitor.intake.blocks import NANO
from monitor.pipeline import Pipeline
from monitor.store import Store
from monitor.store.codec import pack, unpack
from monitor.store.store import drop_blocks, write_block
from tests.monitor.fakes import PLAN, FakeDiagnoser, block

HOUR_NS = 3600 * NANO
STEPS = [-HOUR_NS, -round(2.3 * NANO), HOUR_NS]
PULSE = pytest.mark.parametrize("pulse", [False, True], ids=["period", "pulse"])


def blocks_over(step_ns, pulse=False, count=37, places=60, numbered=True):
    """Blocks of which the last forty have their times by a clock that was set within a turn."""
    blocks = [block(7 + count * k, count, pulse=pulse, sequence=k if numbered else None) for k in range(places)]
    return [*blocks[:20], *(replace(one, start_ns=one.start_ns + step_ns) for one in blocks[20:])]


def fed(pipeline, blocks):
    return [turn for one in blocks if (got := pipeline.take(one)) for turn in got.turns]


@PULSE
@pytest.mark.parametrize("step_ns", STEPS)
@pytest.mark.parametrize("count", [10, 37, 250], ids=["short", "middling", "longer than a turn"])
def test_a_clock_that_is_set_within_a_turn_loses_none(pulse, step_ns, count):
    expected = fed(Pipeline("m", FakeDiagnoser(), PLAN), blocks_over(0, pulse, count))
    turns = fed(Pipeline("m", FakeDiagnoser(), PLAN), blocks_over(step_ns, pulse, count))
    assert len(turns) == len(expected) > 3
    starts = np.diff([turn.cut.start_ns for turn in turns]) / NANO
    assert np.sum(np.abs(starts - 1.0) > 0.02) <= 1, "but where the clock was set"
    for one, other in zip(turns, expected, strict=True):
        np.testing.assert_allclose(one.cut.turn.record, other.cut.turn.record, atol=1e-6)


def test_a_turn_that_is_told_after_the_clock_was_set_has_its_time_by_the_new_one():
    """Turns without samples at their ends wait for some; times of the old clock would hide those that follow."""
    turns = fed(Pipeline("m", FakeDiagnoser(), PLAN), blocks_over(-HOUR_NS))
    ends = [turn.cut.end_ns for turn in turns]
    straddling = next(k for k, (one, other) in enumerate(itertools.pairwise(ends)) if other < one)
    assert turns[straddling + 1].cut.start_ns == pytest.approx(ends[straddling] - HOUR_NS, abs=2)


@pytest.mark.parametrize("step_ns", STEPS)
def test_a_pulse_that_has_died_is_told_at_any_clock(step_ns):
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    blocks = blocks_over(step_ns, pulse=True)
    fed(pipeline, blocks[:30])
    assert "no_pulse" not in pipeline.states.active
    fed(pipeline, [replace(one, pulse=np.zeros(37)) for one in blocks[30:]])
    assert "no_pulse" in pipeline.states.active


@PULSE
@pytest.mark.parametrize("step_ns", STEPS[:2])
@pytest.mark.parametrize(("numbered", "cut"), [(True, 21), (True, 26), (False, 23), (False, 26)])
def test_a_restart_after_a_clock_was_set_back_gives_the_turns_of_an_unbroken_run(
    tmp_path, pulse, numbered, step_ns, cut
):
    blocks = blocks_over(step_ns, pulse, numbered=numbered)
    expected = fed(Pipeline("m", FakeDiagnoser(), PLAN), blocks)
    store, pipeline, turns = Store(f"sqlite:///{tmp_path}/monitor.sqlite"), Pipeline("m", FakeDiagnoser(), PLAN), []
    for one in blocks[:cut]:
        outcome = pipeline.take(one)
        with store.transaction() as connection:
            if outcome is not None:
                write_block(connection, one)
                turns += outcome.turns
            if (needed := pipeline.first_needed_ns()) is not None:
                drop_blocks(connection, "m", needed, pipeline.newest_ns)
    again = Pipeline("m", FakeDiagnoser(), PLAN, unpack(pack(pipeline.to_dict())))
    assert again.restore(store.machine("m")[1]).turns == [] and again.newest_ns == pipeline.newest_ns
    turns += fed(again, blocks[cut:])
    store.close()
    assert [turn.number for turn in turns] == [turn.number for turn in expected]
    told = [[(turn.cut.start_ns - block(0).start_ns) / NANO for turn in some] for some in (turns, expected)]
    np.testing.assert_allclose(*told, atol=1e-6)


def test_samples_by_a_clock_that_was_set_back_are_forgotten_with_those_after_it(tmp_path):
    store, pipeline = Store(f"sqlite:///{tmp_path}/monitor.sqlite"), Pipeline("m", FakeDiagnoser(), PLAN)
    for one in blocks_over(-HOUR_NS, places=40):
        pipeline.take(one)
        with store.transaction() as connection:
            write_block(connection, one)
            drop_blocks(connection, "m", pipeline.first_needed_ns(), pipeline.newest_ns)
    kept = store.machine("m")[1]
    store.close()
    assert len(kept) < 12 and max(one.end_ns for one in kept) == pipeline.newest_ns


def test_a_logger_that_begins_at_1970_goes_on_after_a_restart():
    blocks = blocks_over(-block(7 + 37 * 20).start_ns)
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    fed(pipeline, blocks[:23])
    again = Pipeline("m", FakeDiagnoser(), PLAN, pipeline.to_dict())
    again.restore(blocks[15:23])
    fed(again, blocks[23:])
    assert again.turns >= len(fed(Pipeline("m", FakeDiagnoser(), PLAN), blocks_over(0))) - 1


def test_a_state_of_an_earlier_version_that_waits_for_the_old_clock_is_freed():
    blocks = blocks_over(-HOUR_NS)
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    fed(pipeline, blocks[:40])
    body = {**pipeline.to_dict(), "until_ns": pipeline.until_ns + HOUR_NS}
    again = Pipeline("m", FakeDiagnoser(), PLAN, body)
    again.restore(blocks[30:40])
    assert len(fed(again, blocks[40:])) >= 6


def test_a_clock_that_is_set_back_moves_all_times_that_are_kept(step_h=24 * 365):
    """A shelf of eight hours lasted a year, in which nobody was told of a danger; a state of an hour, too."""
    pipeline, events = Pipeline("m", FakeDiagnoser(), PLAN), []

    def send(seconds, level, ahead_h=0):
        for second in seconds:
            one = block(100 * second, 100, level=level, sequence=second)
            outcome = pipeline.take(replace(one, start_ns=one.start_ns + ahead_h * HOUR_NS))
            events.extend(outcome.events if outcome else [])

    send(range(8), 4.0, step_h)
    condition, before = pipeline.conditions["backlash_deg"], pipeline.conditions["backlash_deg"].to_dict()
    condition.shelve(pipeline.newest_ns, 8.0, "eve")
    pipeline.states.note("broken_payload", pipeline.newest_ns, "no JSON")
    send(range(8, 12), 4.0)
    assert condition.shelved_until_ns - pipeline.newest_ns == pytest.approx(8 * HOUR_NS, abs=HOUR_NS / 60)
    assert condition.since_ns == before["since_ns"] - step_h * HOUR_NS
    assert condition.to_dict()["asked_ns"] == before["asked_ns"] - step_h * HOUR_NS
    states = pipeline.states.to_dict()
    for name in ("broken_payload", "clock_step"):
        assert 0 <= pipeline.newest_ns - states[name]["last_ns"] < HOUR_NS / 60
    send(range(9 * 3600, 9 * 3600 + 8), 20.0)
    assert [(one.kind, one.told) for one in events if one.level == "danger"] == [("raised", True)]
    assert not pipeline.states.to_dict()["broken_payload"]["active"]


def test_blocks_that_were_late_until_a_clock_was_believed_were_so_by_the_new_one():
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    fed(pipeline, blocks_over(-HOUR_NS, numbered=False))
    assert 0 <= pipeline.newest_ns - pipeline.states.to_dict()["late"]["last_ns"] < 60 * NANO


def test_hours_go_by_between_recordings_that_are_numbered_one_after_the_other():
    """A turn every hour without `begins` looks like a clock that is set forward each time."""
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    hourly = [block(360_000 * hour, 150, level=4.0, sequence=hour) for hour in range(14)]
    fed(pipeline, hourly[:4])
    pipeline.conditions["backlash_deg"].shelve(pipeline.newest_ns, 8.0, "eve")
    pipeline.states.note("broken_payload", pipeline.newest_ns, "no JSON")
    fed(pipeline, hourly[4:])
    assert not pipeline.conditions["backlash_deg"].shelved and "broken_payload" not in pipeline.states.active
    history = pipeline.watch.trends["60 rpm"]["backlash_deg"]
    np.testing.assert_array_equal(history.running, history.history)


@pytest.mark.parametrize("numbered", [True, False])
@pytest.mark.parametrize(("back_h", "on_h", "moved_h"), [(24 * 365 * 56, 24 * 365 * 56, 0), (1, 1, 0), (1, 3, -1)])
def test_a_clock_that_is_set_back_and_on_again_ends_no_shelf(numbered, back_h, on_h, moved_h):
    """As of a logger that begins at 1970 until it gets its time; where it goes on by more, hours may have gone by."""
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    blocks = blocks_over(0, places=90, numbered=numbered)
    fed(pipeline, blocks[:20])
    alarm = pipeline.conditions["crack"]
    alarm.shelve(pipeline.newest_ns, 8.0, "me")
    until = alarm.shelved_until_ns
    fed(pipeline, [replace(one, start_ns=one.start_ns - back_h * HOUR_NS) for one in blocks[20:40]])
    fed(pipeline, [replace(one, start_ns=one.start_ns + (on_h - back_h) * HOUR_NS) for one in blocks[40:]])
    # two blocks are left out until a clock without numbers is believed
    assert alarm.shelved_until_ns == pytest.approx(until + moved_h * HOUR_NS, abs=2 * NANO)
