"""From blocks to turns, sizes and alarms; a fault of the sensor is a state and never a diagnosis."""

from dataclasses import replace

import numpy as np
import pytest

from monitor.analysis.baseline import octave_levels
from monitor.intake.blocks import NANO
from monitor.pipeline import Pipeline
from monitor.plan import CHANGE
from monitor.store.codec import pack, unpack
from tests.monitor.fakes import FAST, PLAN, RATE, SLOW, START_NS, FakeDiagnoser, block, samples


@pytest.fixture
def pipeline():
    return Pipeline("m", FakeDiagnoser(), PLAN)


def feed(pipeline, first, last, step=50, **more):
    turns, events = [], []
    for place in range(first, last, step):
        outcome = pipeline.take(block(place, step, **more))
        if outcome is not None:
            turns += outcome.turns
            events += outcome.events
    return turns, events


def starts(turns):
    return [round((turn.cut.start_ns - START_NS) / NANO, 3) for turn in turns]


@pytest.mark.parametrize("step", [10, 50, 70, 350])
def test_turns_follow_each_other_by_the_period_however_they_are_cut(pipeline, step):
    turns, _ = feed(pipeline, 0, 700, step)
    assert starts(turns) == [0, 1, 2, 3, 4, 5, 6]
    assert [turn.number for turn in turns] == [1, 2, 3, 4, 5, 6, 7]
    assert turns[3].sizes["backlash_deg"].value == pytest.approx(1.0, rel=1e-3)


def test_a_pulse_marks_the_turns(pipeline):
    turns, _ = feed(pipeline, 30, 780, pulse=True)
    assert [round(start, 1) for start in starts(turns)] == [1, 2, 3, 4, 5, 6]


def test_a_turn_belongs_to_the_mode_whose_duration_it_has():
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    edges = np.cumsum([0, 100, 100, 125, 125, 125, 170, 100, 100])
    place = np.arange(edges[-1] + 40)
    pulse = (np.min(np.where(place[:, None] >= edges, place[:, None] - edges, 1000), axis=1) < 5).astype(float)
    turns = []
    for first in range(0, len(place), 40):
        count = min(40, len(place) - first)
        one = replace(block(first, count), pulse=pulse[first : first + count])
        turns += pipeline.take(one).turns
    told = [(turn.cut.mode.name, turn.problem[0] if turn.problem else None) for turn in turns]
    expected = [("60 rpm", None), *[("48 rpm", None)] * 3, ("60 rpm", "other_speed"), ("60 rpm", None)]
    assert told == expected


def test_without_a_pulse_the_stated_speed_chooses_the_mode():
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    turns, _ = feed(pipeline, 0, 500, motor_speed=8.0)
    assert {turn.cut.mode.name for turn in turns} == {"48 rpm"} and len(turns) == 4
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    feed(pipeline, 0, 100)
    assert "not_comparable" in pipeline.states.active


def test_a_gap_starts_a_new_turn_and_is_told(pipeline):
    feed(pipeline, 0, 250)
    turns = []
    for place in range(330, 900, 50):
        turns += pipeline.take(block(place)).turns
    assert starts(turns)[0] == pytest.approx(3.3) and "gap" in pipeline.states.active


def test_a_fault_that_grows_raises_its_levels_one_after_the_other(pipeline):
    events = []
    for second in range(30):
        events += feed(pipeline, 100 * second, 100 * second + 100, level=0.5 + 0.5 * second)[1]
    told = [(event.quantity, event.level) for event in events if event.quantity != CHANGE]
    assert told == [("backlash_deg", "alert"), ("backlash_deg", "alarm"), ("backlash_deg", "danger")]
    summary = pipeline.summary()
    assert summary["level"] == "danger" and summary["worst"] == "backlash_deg"


def test_a_fault_that_shows_at_one_of_two_speeds_in_turn_raises_its_alarm():
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    events = []
    for place in range(40):
        fast = place % 2 == 0
        count, level, speed = (100, 20.0, FAST.motor_speed) if fast else (125, 0.5, SLOW.motor_speed)
        one = block(1000 * place, count, level=level, motor_speed=speed, begins=True, sequence=place)
        events += pipeline.take(one).events
    told = [(event.kind, event.level) for event in events if event.quantity == "backlash_deg"]
    assert told == [("raised", "danger")]


def test_the_remaining_time_of_an_even_growth_is_told(pipeline):
    for second in range(20):
        outcome = [pipeline.take(block(100 * second, 100, level=0.5 + 0.25 * second))]
    left = outcome[-1].turns[-1].remaining["backlash_deg"]
    assert left.median == pytest.approx(27.0, abs=0.1) and left.low - 0.1 <= 27.0 <= left.high + 0.1


def test_a_dead_sensor_is_a_state_and_no_diagnosis(pipeline):
    feed(pipeline, 0, 500)
    turns, events = feed(pipeline, 500, 800, level=0.0)
    assert all(turn.finding is None and turn.problem[0] == "dead" for turn in turns) and events == []
    assert "dead" in pipeline.states.active
    feed(pipeline, 800, 1000)
    assert "dead" not in pipeline.states.active and pipeline.states.count("dead") == 3


def test_another_sensor_is_told(pipeline):
    feed(pipeline, 0, 200, sensor="a")
    feed(pipeline, 200, 300, sensor="b")
    assert "swapped" in pipeline.states.active


def test_what_a_fault_explains_is_no_unknown_change():
    pipeline = Pipeline("m", Strange(), PLAN)
    _, events = feed(pipeline, 0, 800)
    assert [(event.quantity, event.level) for event in events] == [(CHANGE, "danger")]
    pipeline = Pipeline("m", Strange(), PLAN)
    _, events = feed(pipeline, 0, 1500, level=20.0)
    assert {event.quantity for event in events} == {"backlash_deg"}


def test_samples_that_cannot_be_compared_are_a_state(pipeline):
    one = block(0)
    pipeline.take(replace(one, unit="rad/s^2"))
    assert "not_comparable" in pipeline.states.active


def test_samples_without_any_pulse_are_told_and_not_kept_for_ever():
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    feed(pipeline, 0, 300, pulse=True)
    for place in range(300, 2000, 50):
        pipeline.take(replace(block(place), pulse=np.zeros(50)))
    assert "no_pulse" in pipeline.states.active
    needed = pipeline.first_needed_ns()
    assert needed is not None and needed >= START_NS + round(15.5 * NANO)


def test_a_pulse_that_never_comes_is_told():
    """Its level stays below that of an edge from the first sample on, so that no turn is ever told."""
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    for place in range(0, 700, 50):
        pipeline.take(replace(block(place), pulse=np.zeros(50)))
    assert pipeline.turns == 0 and "no_pulse" in pipeline.states.active


@pytest.mark.parametrize("pulse", [False, True], ids=["period", "pulse"])
def test_what_a_cutter_knows_of_blocks_does_not_grow_with_their_number(pipeline, pulse):
    turns, _ = feed(pipeline, 0, 5000, step=10, pulse=pulse)
    assert len(pipeline._cutter._places) <= 4 * 10 + 2
    assert starts(turns)[-5:] == pytest.approx(np.arange(starts(turns)[-1] - 4, starts(turns)[-1] + 1), abs=0.02)


@pytest.mark.parametrize("pulse", [False, True], ids=["period", "pulse"])
@pytest.mark.parametrize("cut", range(1, 22, 3))
def test_a_restart_anywhere_gives_the_turns_of_an_unbroken_run(pulse, cut):
    """The store keeps what the pipeline says of itself and the blocks from `first_needed_ns` on; nothing more."""
    blocks = [block(7 + 37 * place, 37, level=1 + place / 10, pulse=pulse) for place in range(40)]
    whole = Pipeline("m", FakeDiagnoser(), PLAN)
    expected = [turn for one in blocks for turn in whole.take(one).turns]

    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    turns = [turn for one in blocks[:cut] for turn in pipeline.take(one).turns]
    needed = pipeline.first_needed_ns() or 0
    again = Pipeline("m", FakeDiagnoser(), PLAN, pipeline.to_dict())
    restored = again.restore([one for one in blocks[:cut] if one.end_ns >= needed])
    assert restored.turns == []
    turns += [turn for one in blocks[cut:] if (got := again.take(one)) for turn in got.turns]
    assert [turn.number for turn in turns] == [turn.number for turn in expected]
    np.testing.assert_allclose(starts(turns), starts(expected), atol=1e-6)
    for one, other in zip(turns, expected, strict=True):
        np.testing.assert_allclose(one.cut.turn.record, other.cut.turn.record, atol=1e-5)
        assert one.sizes["backlash_deg"].value == pytest.approx(other.sizes["backlash_deg"].value, rel=1e-5)
    assert again.states.active == []


def restarted(pipeline, blocks):
    """As from the store, which keeps the blocks from `first_needed_ns` on."""
    again = Pipeline("m", FakeDiagnoser(), PLAN, unpack(pack(pipeline.to_dict())))
    again.restore([one for one in blocks if one.end_ns >= (pipeline.first_needed_ns() or 0)])
    return again


def test_recordings_that_come_twice_after_a_restart_are_counted_once(pipeline):
    hourly = [block(360_000 * hour, 100, begins=True, sequence=hour) for hour in range(9)]
    for one in hourly[:8]:
        pipeline.take(one)
    again = restarted(pipeline, hourly[:8])
    assert [again.take(one) for one in hourly[5:8]] == [None] * 3 and again.states.count("double") == 3
    again.take(hourly[8])
    again.finish()
    assert again.turns == 9


def test_a_clock_that_was_set_back_while_the_monitor_was_off_costs_two_blocks(pipeline):
    before = [block(50 * place) for place in range(40)]
    for one in before:
        pipeline.take(one)
    again = restarted(pipeline, before)
    after = [replace(block(50 * place), start_ns=block(50 * place - 360_000).start_ns) for place in range(40, 80)]
    taken = [again.take(one) for one in after]
    assert taken[:2] == [None] * 2 and None not in taken[2:]
    assert again.turns == pipeline.turns + 19 and again.states.count("clock_step") == 1


def test_samples_of_a_tone_are_those_of_the_tone():
    assert np.sqrt(np.mean(samples(2.0, 0, int(RATE)) ** 2)) == pytest.approx(2.0)


def test_samples_before_and_after_a_refused_block_are_not_glued_together():
    """A tenth of a second at a speed that was not taught; its samples would be missing within a turn."""
    pipeline, turns = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN), []
    for number, first in enumerate(range(0, 600, 10)):
        speed = 10.3 if first == 310 else FAST.motor_speed
        turns += pipeline.take(block(first, 10, motor_speed=speed, sequence=number)).turns
    assert starts(turns) == pytest.approx([0, 1, 2, 3.2, 4.2], abs=1e-6)
    for turn, start in zip(turns, starts(turns), strict=True):
        np.testing.assert_allclose(turn.cut.turn.record, samples(1.0, round(100 * start), 100), atol=1e-5)


class Asked(FakeDiagnoser):
    """Keeps the cam angles at which turns begin."""

    def __init__(self):
        super().__init__()
        self.angles = set()

    def diagnose_turn(self, signal, conditions, start_angle=None):
        self.angles.add(start_angle)
        return super().diagnose_turn(signal, conditions)


@pytest.mark.parametrize(("pulse", "angle"), [(True, 0.3), (False, None)])
def test_only_turns_that_a_pulse_cut_begin_at_its_angle(pulse, angle):
    diagnoser = Asked()
    feed(Pipeline("m", diagnoser, replace(PLAN, pulse_angle=0.3)), 0, 500, pulse=pulse)
    assert diagnoser.angles == {angle}


class Strange(FakeDiagnoser):
    """Turns as strange as `novelty` says."""

    novelty = 9.0

    def diagnose_turn(self, signal, conditions, start_angle=None):
        return replace(super().diagnose_turn(signal, conditions), novelty=self.novelty)


def test_a_change_stays_beside_a_fault_of_a_lower_level():
    """It ended with the value 0 by the first small fault."""
    diagnoser = Strange()
    pipeline = Pipeline("m", diagnoser, PLAN)
    feed(pipeline, 0, 800)
    _, events = feed(pipeline, 800, 2400, level=4.0)
    assert [(event.quantity, event.level) for event in events] == [("backlash_deg", "alert")]
    assert pipeline.conditions[CHANGE].level == 3
    feed(pipeline, 2400, 4000, level=20.0)
    diagnoser.novelty = 0.0
    assert feed(pipeline, 4000, 6000, level=20.0)[1] == [], "what a fault explains now is not judged"
    _, events = feed(pipeline, 6000, 9000, level=1.0)
    assert [(event.quantity, event.kind) for event in events][-1] == (CHANGE, "ended")
    assert events[-1].value == pytest.approx(0.0, abs=1.0)


class Broken(FakeDiagnoser):
    """A turn of a level above 3 meets a fault of the software."""

    def diagnose_turn(self, signal, conditions, start_angle=None):
        finding = super().diagnose_turn(signal, conditions)
        if finding.level > 3.0:
            raise MemoryError("no more")
        return finding


def test_a_turn_that_nobody_foresaw_is_left_out_and_the_watch_goes_on(caplog):
    pipeline = Pipeline("m", Broken(), PLAN)
    feed(pipeline, 0, 800)
    turns, _ = feed(pipeline, 800, 1600, level=5.0)
    told = "not_comparable", "a turn that could not be diagnosed (MemoryError: no more)"
    assert told in [turn.problem for turn in turns] and "could not be diagnosed" in caplog.text
    turns, _ = feed(pipeline, 1600, 2400)
    assert turns[-1].finding is not None


def test_trends_of_another_model_are_not_gone_on_with(caplog):
    pipeline = Pipeline("m", FakeDiagnoser(), PLAN)
    feed(pipeline, 0, 800)
    body = unpack(pack(pipeline.to_dict()))
    same, other = FakeDiagnoser(), FakeDiagnoser()
    other.origins = {FAST.name: "another"}
    assert Pipeline("m", same, PLAN, body).watch.trends.keys() == {FAST.name} and not caplog.text
    again = Pipeline("m", other, PLAN, body)
    assert again.watch.trends == {} and again.summary()["last"]["sizes"] == {}
    assert "another model or twin diagnoses at 60 rpm than before" in caplog.text
    # a store of an earlier version says nothing of who diagnosed
    del body["origins"]
    assert Pipeline("m", other, PLAN, body).watch.trends.keys() == {FAST.name}


def test_a_remaining_time_of_another_speed_runs_on():
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    pipeline.watch.last = {"modes": {FAST.name: {
        "time_ns": START_NS, "ran_s": 0.0, "sizes": {"backlash_deg": [5.0, 4.0, 6.0]},
        "remaining": {"backlash_deg": [3600.0, 1800.0, 7200.0]},
    }}}  # fmt: skip
    pipeline.watch.running.turn(0.0)
    pipeline.watch.running.turn(3000.0)
    assert pipeline.watch.shown()["remaining"]["backlash_deg"] == [600.0, 0.0, 4200.0]


def test_an_alarm_of_what_is_watched_no_longer_ends_once_with_a_note(pipeline):
    feed(pipeline, 0, 800, level=5.0)
    fewer = replace(PLAN, limits={CHANGE: PLAN.limits[CHANGE]})
    again = Pipeline("m", FakeDiagnoser(), fewer, unpack(pack(pipeline.to_dict())))
    assert "backlash_deg" in again.to_dict()["conditions"], "until it is told"
    (event,) = again.watch.at(START_NS)
    assert (event.quantity, event.kind, event.level, event.told) == ("backlash_deg", "ended", "normal", True)
    assert "not watched" in event.note and again.watch.at(START_NS) == []
    once_more = Pipeline("m", FakeDiagnoser(), PLAN, again.to_dict())
    assert not once_more.conditions["backlash_deg"].active


def test_the_size_beside_an_alarm_is_that_of_the_speed_that_holds_its_level():
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    for place in range(20):
        fast = place % 2 == 0
        count, level, speed = (100, 20.0, FAST.motor_speed) if fast else (125, 0.5, SLOW.motor_speed)
        pipeline.take(block(1000 * place, count, level=level, motor_speed=speed, begins=True, sequence=place))
    last = pipeline.summary()["last"]
    assert (last["mode"], last["size_mode"]["backlash_deg"]) == ("48 rpm", "60 rpm")
    assert last["sizes"]["backlash_deg"][0] == pytest.approx(20.0, rel=1e-3)
    assert last["modes"]["48 rpm"]["sizes"]["backlash_deg"][0] == pytest.approx(0.5, rel=1e-3)
    assert pipeline.conditions["backlash_deg"].mode == "60 rpm" and last["size_mode"]["crack"] == "48 rpm"


def test_a_turn_that_is_not_diagnosed_leaves_the_time_of_the_last_sizes(pipeline):
    feed(pipeline, 0, 500)
    feed(pipeline, 500, 1000, level=0.0)
    last = pipeline.summary()["last"]
    assert last["time_ns"] == last["modes"]["60 rpm"]["time_ns"] == START_NS + 5 * NANO
    assert (last["problem"], last["problem_ns"], last["problem_mode"]) == ("it is dead", START_NS + 10 * NANO, "60 rpm")
    feed(pipeline, 1000, 1200)
    assert pipeline.summary()["last"]["time_ns"] > last["problem_ns"] and not pipeline.summary()["last"]["problem"]


def test_after_a_repair_the_remaining_time_is_that_of_the_new_life(pipeline):
    """Two lives of equal wear, 0.05 a turn: with both in one trend the second seems to have far more time."""

    def life(first, turns):
        for turn in range(turns):
            outcome = pipeline.take(block(100 * (first + turn), 100, level=1.0 + 0.05 * turn))
        return outcome.turns[-1].remaining.get("backlash_deg")

    life(0, 200)
    pipeline.watch.references["60 rpm"] = 1
    event = pipeline.watch.repair("backlash_deg", pipeline.newest_ns, "eve", "new reducer")
    assert event.kind == "repaired" and pipeline.watch.baselines.to_dict() == {}
    assert pipeline.watch.references == {}
    shown = pipeline.summary()["last"]
    assert (
        "backlash_deg" not in shown["sizes"] and "crack" in shown["sizes"] and "backlash_deg" not in shown["remaining"]
    )
    left = life(200, 100)
    assert left.low - 2 <= (12.0 - 5.95) / 0.05 <= left.high + 2
    assert pipeline.watch.trends["60 rpm"]["backlash_deg"].history[0, 0] >= START_NS / NANO + 200


def test_a_stop_of_weeks_is_no_time_without_wear(pipeline):
    """Growth of 0.05 a turn, before and after three weeks: what is left counts in running time."""
    for turn in range(160):
        start = 100 * turn + (0 if turn < 80 else 100 * 86400 * 21)
        outcome = pipeline.take(block(start, 100, level=1.0 + 0.05 * turn, begins=True, sequence=turn))
    left = outcome.turns[-1].remaining["backlash_deg"]
    assert left.median < 3 * 86400, "a day of the stop counts"
    assert pipeline.watch.trends["60 rpm"]["backlash_deg"].history[-1, 0] > START_NS / NANO + 86400 * 21
    again = restarted(pipeline, [])
    assert again.watch.to_dict() == pipeline.watch.to_dict()


def test_what_an_earlier_version_kept_of_the_last_turn_is_shown(pipeline):
    """A dead sensor came after it, so that no further turn is diagnosed."""
    feed(pipeline, 0, 500)
    last = pipeline.summary()["last"]
    former = {name: value for name, value in last.items() if name not in ("modes", "size_mode")}
    again = Pipeline("m", FakeDiagnoser(), PLAN, {**pipeline.to_dict(), "last": {**former, "problem": "it is dead"}})
    for one in last["modes"].values():
        del one["ran_s"]  # of which it knew nothing
    assert again.summary()["last"] == {**last, "problem": "it is dead"}
    assert Pipeline("m", FakeDiagnoser(), PLAN).summary()["last"] == {"sizes": {}, "remaining": {}, "size_mode": {}}


def test_a_change_beyond_a_fault_is_raised_beside_it():
    """A small fault hid whatever else went wrong."""
    diagnoser = Strange()
    diagnoser.novelty = 0.0
    pipeline = Pipeline("m", diagnoser, PLAN)
    feed(pipeline, 0, 800, level=4.0)
    diagnoser.novelty = 2.0
    assert feed(pipeline, 800, 1600, level=4.0)[1] == [], "an alert explains an alert"
    diagnoser.novelty = 9.0
    _, events = feed(pipeline, 1600, 2400, level=4.0)
    assert [(event.quantity, event.kind, event.level) for event in events] == [(CHANGE, "raised", "danger")]


@pytest.mark.parametrize("pulse", [False, True])
@pytest.mark.parametrize("off", [9e-4, -9e-4])
def test_turns_have_their_times_also_where_the_senders_rate_is_not_quite_the_models(off, pulse):
    """Half an hour of samples at a rate within a thousandth of the one that was taught."""
    pipeline, rate = Pipeline("m", FakeDiagnoser(), PLAN), RATE * (1.0 + off)
    turns = []
    for first in range(0, 180_000, 500):
        start = START_NS + round(first / rate * NANO)
        turns += pipeline.take(replace(block(first, 500, pulse=pulse), start_ns=start, rate=rate)).turns
    due = 100 * len(turns) / rate
    assert (turns[-1].cut.end_ns - START_NS) / NANO == pytest.approx(due, abs=1.1)
    assert turns[-1].cut.end_ns <= pipeline.newest_ns + 0.01 * NANO


def test_turns_that_are_found_as_stored_samples_are_taken_in_again_are_told(pipeline):
    first = Pipeline("m", FakeDiagnoser(), PLAN)
    pipeline.restored = first.restore([block(place) for place in range(0, 250, 50)])
    assert len(pipeline.restored.turns) == 2
    told = pipeline.take(block(250))
    assert told is not None and len(told.turns) == 2 and len(pipeline.take(block(300)).turns) == 1


def test_a_speed_that_was_not_taught_is_told_in_rpm(pipeline):
    pipeline = Pipeline("m", FakeDiagnoser(FAST, SLOW), PLAN)
    pipeline.take(replace(block(0), motor_speed=20.0))
    assert pipeline.states.active == ["other_speed"]
    assert "must be one that was taught (60 rpm, 48 rpm), got 190.99 rpm" in str(pipeline.states.to_dict())


def test_a_healthy_turn_of_another_model_or_sensor_is_none_to_compare_with(pipeline):
    feed(pipeline, 0, 300, sensor="A")
    pipeline.watch.references["60 rpm"] = 1
    body = pipeline.to_dict()
    assert Pipeline("m", FakeDiagnoser(), PLAN, body).watch.references == {"60 rpm": 1}
    other = FakeDiagnoser()
    other.origins = {"60 rpm": "another"}
    assert Pipeline("m", other, PLAN, body).watch.references == {}
    feed(pipeline, 300, 400, sensor="B")
    assert pipeline.watch.references == {}


def test_octaves_do_not_depend_on_how_often_a_motion_is_sampled():
    """Another model of the same speed may have another rate; a gain of a half was told of the sensor."""
    levels = [octave_levels(np.sin(2 * np.pi * 7.3 * np.arange(n) / n * 8.0), n / 8.0)[:4] for n in (8000, 4000)]
    np.testing.assert_allclose(levels[0], levels[1], atol=0.01)
