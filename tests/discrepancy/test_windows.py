"""Records, their noise and their windows."""

import dataclasses
import math

import numpy as np
import pytest

from discrepancy.criteria import Criteria
from discrepancy.indexer.model import IndexerModel
from discrepancy.indexer.windows import START_PHASE, Experiment, check_rest, covering, cut, windows_of
from indexer_env import OperatingPoint, Signal, load_machine
from indexer_env.errors import ParameterError


def test_windows_begin_in_the_dwell_and_hold_one_cam_turn_each() -> None:
    step, start = 2.0 * math.pi / 1000.0, 1.0
    windows = cut([4200], [step], [start])
    phases = (start + step * windows.first) / (2.0 * math.pi) % 1.0
    assert np.all((phases >= START_PHASE) & (phases < START_PHASE + 1.01e-3))
    assert windows.turn.tolist() == [1, 2, 3]  # the record ends too early in the fourth
    assert windows.count.tolist() == [1000, 1000, 1000]


def test_a_record_without_a_whole_index_gives_no_window() -> None:
    assert len(cut([300], [2.0 * math.pi / 1000.0], [1.0]).first) == 0


def test_a_noise_of_zero_is_refused() -> None:
    signal = Signal(np.sin(np.arange(100.0)), 1000.0, unit="rad/s^2")
    with pytest.raises(ParameterError, match=r"Experiment\.noise must be .* > 0 rad/s\^2, got 0\.0"):
        Experiment(signal, OperatingPoint(), noise=0.0)


def test_a_cam_that_moves_where_windows_begin_is_refused() -> None:
    late = dataclasses.replace(load_machine("smooth"), motion_share=0.98)
    rule = r"Machine\.motion_law must be at rest from cam phase 0\.97 to 1, got 0\.98; a record of such a cam"
    with pytest.raises(ParameterError, match=rule):
        check_rest(late)
    with pytest.raises(ParameterError, match=rule):
        IndexerModel(late, [])
    check_rest(dataclasses.replace(late, motion_share=0.97))


@pytest.mark.parametrize(("rate", "every"), [(700.0, 1), (995.0, 2), (1280.0, 3), (2000.0, 5), (5000.0, 12)])
def test_a_search_takes_one_sample_for_each_step_of_the_integrator(rate: float, every: int) -> None:
    """Seed 1. All cam turns are kept; each begins at a sample of its own, and the noise is that of the whole record."""
    values = np.random.default_rng(1).standard_normal(round(10.0 * rate))
    whole = IndexerModel(
        load_machine("reference"), [Experiment(Signal(values, rate, unit="rad/s^2"), OperatingPoint())]
    )
    part = whole.part(12)
    assert part.sample_rate == rate / every and len(part.counts) == len(whole.counts) == 9
    assert np.all(np.abs(part.counts * every - whole.counts) <= every)
    (one,), (other,) = part.experiments, whole.experiments
    assert np.array_equal(one.signal.values, values[::every]) and one.noise_level == other.noise_level
    assert (part is whole) == (every == 1)
    assert part.with_all_samples() is whole


def test_a_search_knows_its_windows_among_all() -> None:
    signal = Signal(np.sin(0.15 * np.arange(8200)), 1000.0, unit="rad/s^2")
    whole = IndexerModel(load_machine("reference"), [Experiment(signal, OperatingPoint(motor_speed=150.0))] * 2)
    part = whole.part(4)
    assert len(part.counts) < len(whole.counts)
    assert [whole.windows.turns[k] for k in part.among(whole)] == part.windows.turns
    assert whole.among(whole).tolist() == list(range(len(whole.counts)))


def test_a_line_above_half_the_rate_of_the_search_is_told_by_all_samples() -> None:
    """Seed 3, 1 kHz: the search takes every second sample, in which order 14 of the motor looks like order 6.9."""
    angle, noise = np.arange(8200) * 0.15, 0.1 * np.random.default_rng(3).standard_normal(8200)
    signal = Signal(np.sin(14.0 * angle) + noise, 1000.0, unit="rad/s^2")
    experiment = Experiment(signal, OperatingPoint(motor_speed=150.0))
    part = IndexerModel(load_machine("reference"), [experiment]).part(4)
    full = part.with_all_samples()
    assert part.sample_rate == 500.0 and full.windows.turns == part.windows.turns
    left = np.zeros((len(full.counts), int(full.counts.max())))
    for row, first, count in zip(left, full.windows.first, full.counts, strict=True):
        row[:count] = signal.values[first : first + count]
    assert 14.0 in {h.fixed["order"] for h in part.hypotheses(left)["drive.speed_ripple"]}


def test_a_record_whose_last_cam_turn_would_be_lost_keeps_all_its_samples() -> None:
    """At 5 kHz the last of four cam turns is just long enough to be kept, with one sample in twelve it is not."""
    machine = load_machine("reference")
    length = next(n for n in range(20000, 25000) if len(windows_of([flat(n)], machine.reduction).first) == 4)
    model = IndexerModel(machine, [flat(length)])
    assert model.part(12) is model
    assert IndexerModel(machine, [flat(length + 50)]).part(12).sample_rate < 500.0


def flat(length: int) -> Experiment:
    return Experiment(Signal(np.zeros(length), 5000.0, unit="rad/s^2"), OperatingPoint(), noise=1.0)


@pytest.mark.parametrize("lengths", [(20000, 6700), (6700, 20000), (3000, 40000), (1000, 2000, 30000)])
def test_what_a_short_record_lacks_the_others_show(lengths: tuple[int, ...]) -> None:
    """12 stations, 1000 samples to a cam turn; all records begin at one station."""
    windows = cut(list(lengths), [2.0 * math.pi / 1000.0] * len(lengths), [1.0] * len(lengths))
    chosen = covering(windows, 12, 12)
    assert {turn % 12 for _, turn in chosen} == {turn % 12 for _, turn in windows.turns}
    assert len(chosen) >= 12 and chosen == sorted(chosen)


@pytest.mark.parametrize("records", [2, 3])
@pytest.mark.parametrize("stations", [4, 8, 10, 12, 16])
def test_the_search_sees_every_station(stations: int, records: int) -> None:
    """Records of 1.2 turns: a roller that is cracked shows at one station alone, so none may be left out."""
    length = round(1.2 * stations * 1000.0)
    windows = cut([length] * records, [2.0 * math.pi / 1000.0] * records, [1.0] * records)
    chosen = covering(windows, stations, Criteria().searched)
    seen = np.bincount([turn % stations for _, turn in chosen], minlength=stations)
    assert seen.min() >= 1 and seen.max() - seen.min() <= 2
    for record in range(records):
        turns = [turn for own, turn in chosen if own == record]
        assert turns == list(range(turns[0], turns[0] + len(turns)))


def test_a_record_gives_the_windows_that_another_one_lacks() -> None:
    """12 stations: nine windows from station 4 on, and nine from station 2 on. Station 0 is in the first one alone."""
    windows = cut([9750, 9750], [2.0 * math.pi / 1000.0] * 2, [2.0 * math.pi * 3.5, 2.0 * math.pi * 13.5])
    assert [turn % 12 for record, turn in windows.turns if record == 0] == [*range(4, 12), 0]
    chosen = covering(windows, 12, 8)
    assert len(chosen) == 12
    assert {turn % 12 for _, turn in chosen} == {turn % 12 for _, turn in windows.turns}


def test_records_show_more_windows_until_every_station_is_seen() -> None:
    """Eight stations, three short records: eight windows show seven."""
    windows = cut([1824, 11049, 6778], [2.0 * math.pi / 1000.0] * 3, [2.0 * math.pi * s for s in (5.39, 7.57, 0.25)])
    chosen = covering(windows, 8, 8)
    assert {turn % 8 for _, turn in chosen} == {turn % 8 for _, turn in windows.turns}
    assert len(chosen) == 9
