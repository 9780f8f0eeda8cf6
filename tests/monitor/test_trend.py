"""Trends keep what matters in bounded length; remaining times hold the truth they should."""

import numpy as np
import pytest

from indexer_cli.json_values import finite
from monitor.analysis.baseline import LEARNED, Baseline, Baselines
from monitor.analysis.finding import Size
from monitor.analysis.remaining import ALIKE, remaining_time
from monitor.analysis.running import Running
from monitor.analysis.trend import POINTS, Trend
from monitor.store.codec import pack, unpack


def test_one_strange_turn_does_not_move_the_trend():
    trend = Trend(5)
    for place, value in enumerate([1.0, 1.1, 50.0, 0.9, 1.0]):
        now = trend.add(place, Size(value, value, value))
    assert now.value == 1.0 and trend.full


def test_a_history_is_bounded_reaches_back_and_keeps_the_mean():
    trend, count = Trend(5), 5000
    for place in range(count):
        trend.add(float(place), Size(place, place - 1.0, place + 1.0))
    history = trend.history
    assert len(history) <= POINTS + 1 and history[0, 0] < 200 and history[-1, 0] > 0.97 * count
    np.testing.assert_allclose(history[:, 1], history[:, 0], rtol=1e-6)
    assert (np.diff(history[:, 0]) > 0).all()


def test_a_trend_comes_back_from_the_store_as_it_was():
    trend, rng = Trend(5), np.random.default_rng(0)
    for place in range(333):
        trend.add(1.8e9 + place / 3, Size(*rng.normal(size=3)))
    again = Trend(5, trend.to_dict())
    for place in range(333, 600):
        size = Size(*rng.normal(size=3))
        assert trend.add(1.8e9 + place / 3, size) == again.add(1.8e9 + place / 3, size)
    np.testing.assert_array_equal(trend.history, again.history)


@pytest.mark.parametrize("kept", [lambda body: unpack(pack(body)), finite], ids=["now", "by an earlier version"])
def test_an_interval_without_end_comes_back_from_the_store(kept):
    trend = Trend(5)
    for place in range(100):
        trend.add(float(place), Size(1.0, 0.5, np.inf))
    again = Trend(5, kept(trend.to_dict()))
    assert again.add(100.0, Size(1.0, 0.5, 2.0)) == Size(1.0, 0.5, np.inf) == trend.add(100.0, Size(1.0, 0.5, 2.0))
    np.testing.assert_array_equal(again.history, trend.history)


def test_what_is_stored_does_not_grow_with_time_and_the_unfinished_point_tells_no_time():
    trend, told = Trend(5), []
    for place in range(40_000):
        trend.add(float(place), Size(place, place - 1.0, place + 1.0))
        if place % 4000 == 1234:
            told.append(len(pack(trend.to_dict())))
            assert len(trend.running) == len(trend.history) - 1
    assert max(told) < 1.1 * told[0] + 200 and len(trend.to_dict()["open"]) <= 1
    assert (np.diff(np.diff(trend.running[:, 0])) == 0.0).all(), "points of equally many turns each"


def test_a_point_that_an_earlier_version_left_open_is_gone_on_with():
    trend = Trend(5)
    for place in range(300):
        trend.add(float(place), Size(1.0 + place, place, 2.0 + place))
    body = trend.to_dict()
    left = 300 - sum(trend.stride for _ in body["points"])
    rows = [[float(p), 1.0 + p, float(p), 2.0 + p, float(p)] for p in range(300 - left, 300)]
    before = {key: value for key, value in body.items() if key != "count"} | {"open": rows}
    np.testing.assert_allclose(Trend(5, before).history, trend.history)


def wear(ratio: float, noise: float, seed: int, seen: float, alike: float = ALIKE) -> tuple[np.ndarray, float]:
    """A history of a life of 1000 s from 0.5 to 12 up to the share `seen`, and the true rest [s]. A share `alike` of
    the errors' variance fades over a quarter of the limit (an Ornstein-Uhlenbeck process along the size)."""
    rng, time = np.random.default_rng(seed), np.linspace(0.0, 1000.0 * seen, 60)
    share = time / 1000.0
    grown = share if ratio == 1.0 else np.expm1(np.log(ratio) * share) / (ratio - 1.0)
    size, slow = 0.5 + 11.5 * grown, rng.standard_normal(60)
    for k in range(1, 60):
        kept = np.exp(-(size[k] - size[k - 1]) / (0.25 * 12.0))
        slow[k] = kept * slow[k - 1] + np.sqrt(1.0 - kept**2) * slow[k]
    value = size + noise * (np.sqrt(alike) * slow + np.sqrt(1.0 - alike) * rng.standard_normal(60))
    return np.stack([time, value, value - 1.645 * noise, value + 1.645 * noise], axis=1), 1000.0 * (1.0 - seen)


def held(count: int = 200) -> float:
    """Share of intervals that hold the truth, at 40 to 85 % of lives whose ratio is drawn log-uniform from 1 to 12."""
    found = 0
    for seed in range(count):
        ratio = 12.0 ** np.random.default_rng([seed, 1]).uniform()
        history, left = wear(ratio, 0.6, seed, 0.4 + 0.5 * (seed % 10) / 10)
        told = remaining_time(history, 12.0, history[-1, 0])
        assert told is not None and told.low <= told.median <= told.high
        found += told.low <= left <= told.high
    return found / count


def test_the_interval_holds_the_truth_as_often_as_it_says():
    assert 0.85 <= held() <= 0.95


def test_without_the_errors_that_neighbouring_sizes_share_it_is_too_narrow(monkeypatch):
    monkeypatch.setattr("monitor.analysis.remaining.ALIKE", 0.0)
    assert held() < 0.80


def test_a_mean_of_many_turns_has_no_less_of_the_error_that_they_share():
    history, _ = wear(2.0, 0.3, 0, 0.6)
    one, many = (remaining_time(history, 12.0, history[-1, 0], turns) for turns in (1, 50))
    assert one is not None and many is not None and many.high - many.low > one.high - one.low


def test_of_sizes_that_fall_nothing_is_told():
    """By a tenth in 60 turns, with the scatter of a diagnosis; in some of these few draws of many still grow."""
    for seed in range(15, 30):
        value = np.linspace(5.0, 4.5, 60) + 0.3 * np.random.default_rng(seed).standard_normal(60)
        history = np.column_stack([86400.0 * np.arange(60), value, value - 0.5, value + 0.5])
        assert remaining_time(history, 12.0, history[-1, 0]) is None


def test_without_growth_nothing_is_told():
    rng = np.random.default_rng(3)
    flat = np.stack([np.arange(60.0), 1.0 + 0.2 * rng.standard_normal(60), np.full(60, 0.5), np.full(60, 1.5)], axis=1)
    told = remaining_time(flat, 12.0, 59.0)
    assert told is None or told.median > 5 * 59.0
    assert remaining_time(flat[:5], 12.0, 4.0) is None


@pytest.mark.parametrize("stamp", [400 * 86400.0, -27 * 365 * 86400.0])
def test_a_point_of_a_clock_that_jumped_and_came_back_is_left_out(stamp):
    history, _ = wear(2.0, 0.3, 0, 0.6)
    plain = remaining_time(history, 12.0, history[-1, 0])
    history[30:32, 0] += stamp
    told = remaining_time(history, 12.0, history[-1, 0])
    assert plain is not None and told is not None
    assert (told.low, told.median, told.high) == pytest.approx((plain.low, plain.median, plain.high), rel=0.05)


def test_a_limit_that_is_behind_leaves_no_time():
    history, _ = wear(2.0, 0.1, 0, 0.9)
    told = remaining_time(history, 5.0, history[-1, 0])
    assert told is not None and told.high == 0.0


def test_a_baseline_tells_deviations_in_scatters_once_it_has_learned():
    rng, baseline = np.random.default_rng(1), Baseline()
    for _ in range(LEARNED):
        assert baseline.add(np.array([0.0, 5.0]) + 0.1 * rng.standard_normal(2)) is None
    away = baseline.add(np.array([0.0, 6.0]))
    assert away is not None and abs(away[0]) < 1.5 and 6.0 < away[1] < 16.0


def test_a_jump_of_gain_is_told_and_a_change_of_shape_is_not():
    rng, time = np.random.default_rng(2), np.arange(8200) / 1000.0
    tones = [np.sin(2 * np.pi * hz * time) for hz in (1.5, 3, 6, 12, 24, 48)]
    baseline, healthy = Baseline(), sum(tones) + 0.01 * rng.standard_normal(8200)
    assert baseline.gain(healthy, 1000.0) is None
    assert baseline.gain(healthy + 0.01 * rng.standard_normal(8200), 1000.0) is None
    assert baseline.gain(1.3 * healthy, 1000.0) == pytest.approx(1.3, rel=0.01)
    assert baseline.gain(1.3 * healthy + 0.6 * tones[3], 1000.0) is None, "one octave alone"


def test_what_is_usual_is_learnt_anew_after_a_jump_of_gain():
    """Without the sensor's name; else all turns from then on were far from the usual."""
    rng, time = np.random.default_rng(3), np.arange(8200) / 1000.0
    tones, baselines = sum(np.sin(2 * np.pi * hz * time) for hz in (1.5, 3, 6, 12, 24, 48)), Baselines()

    def far(gain):
        record = gain * (1.0 + 0.005 * rng.standard_normal()) * tones
        return baselines.far("60 rpm", record, 1000.0, float(record.std()), 8)

    assert [far(1.0)[0] for _ in range(LEARNED + 3)][:LEARNED] == [0.0] * LEARNED
    value, factor = far(1.3)
    assert value == 0.0 and factor == pytest.approx(1.3, rel=0.03)
    told = [far(1.3) for _ in range(2 * LEARNED)]
    assert max(value for value, _ in told) < 1.0 and {factor for _, factor in told} == {None}
    assert far(1.3 * 1.08)[0] > 0.5, "it is known what is usual now"


def test_gaps_count_as_running_up_to_a_day_and_rare_recordings_in_full():
    """Turns every minute, a night and a month's stop; then a recording a week, of which one is lost."""
    day, running = 86400.0, Running()
    begun = running.turn(1.8e9)
    for minute in range(1, 600):
        assert running.turn(1.8e9 + 60 * minute) - begun == 60 * minute
    ran = running.turn(1.8e9 + 60 * 599 + 0.6 * day) - begun
    assert ran == pytest.approx(60 * 599 + 0.6 * day)
    again = Running(running.to_dict())
    assert again.turn(1.8e9 + 60 * 599 + 30.6 * day) - begun == pytest.approx(ran + day)
    again.set_clock(-1e6)
    assert again.turn(1.8e9 + 60 * 600 + 30.6 * day - 1e6) - begun == pytest.approx(ran + day + 60)
    rare = Running()
    assert [rare.turn(7 * day * week) / day for week in (0, 1, 2, 3, 5, 6)] == [0, 7, 14, 21, 35, 42]
    assert rare.turn(7 * day * 100) / day == 63


def test_a_trend_of_an_earlier_version_has_all_time_for_running_time():
    trend = Trend(5)
    for turn in range(200):
        trend.add(60.0 * turn, Size(turn, turn, turn))
    body = {**trend.to_dict(), "points": [row[:4] for row in trend.to_dict()["points"]]}
    np.testing.assert_array_equal(Trend(5, body).running, trend.running)
