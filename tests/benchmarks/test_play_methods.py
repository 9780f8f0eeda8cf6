"""The methods compared on play: what they average and fit, what their table says, and a case that they name."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from benchmarks import play_methods
from benchmarks.cam_averages import BINS, CamAverages
from benchmarks.play_methods import Case, Outcome
from benchmarks.whole_record import WholeRecordModel
from discrepancy import NONE
from discrepancy.indexer import IndexerModel
from discrepancy.problem import Problem


@pytest.fixture(scope="module")
def smooth() -> Case:
    """An imbalance hidden in a machine without play (seed 500 of the challenge)."""
    return play_methods.made(500, "none", "load.imbalance")


def test_whole_records_hold_the_samples_of_all_their_windows(smooth):
    whole, parts = smooth.models(WholeRecordModel)[0], smooth.models(IndexerModel)[0]
    assert len(whole.counts) == 2 and whole.groups.tolist() == [0, 1]
    assert whole.counts.tolist() == [parts.counts[parts.groups == r].sum() for r in range(2)]
    first, record = (_at_nominal(model)[0] for model in (parts, whole))
    n = parts.counts[0]
    assert record[:n] == pytest.approx(first[:n], abs=1e-9)
    assert np.ptp(record[n:]) > 1.0


def _at_nominal(model: IndexerModel) -> np.ndarray:
    """Residuals (w, samples) of the nominal machine, every window from rest."""
    states = np.zeros((1, len(model.counts), model.local_count(NONE)))
    return Problem(model, NONE).residuals(np.zeros((1, len(model.parameters))), states)[0]


@pytest.mark.parametrize(("by_station", "turns"), [(False, 1), (True, 8)])
def test_averages_of_what_repeats_are_what_repeats(smooth, by_station, turns):
    model = smooth.models(WholeRecordModel)[0]
    averages = CamAverages(model, np.random.default_rng(0), by_station=by_station)
    for k, averaging in enumerate(averages.averaging):
        experiment = model.experiments[k]
        point, rate = experiment.operating_point, experiment.signal.sample_rate
        sample = model.windows.first[k] + np.arange(model.counts.max())
        angle = point.start_angle + model.machine.reduction * point.motor_speed * sample / rate
        place = averaging @ np.mod(angle / turns, 2.0 * math.pi)
        assert averaging @ np.cos(angle / turns) == pytest.approx(np.cos(place), abs=2e-3)
        cells = place * turns * BINS / (2.0 * math.pi)
        assert 0.6 * turns * BINS < len(np.unique(cells.astype(int))) == len(cells) <= turns * BINS
        assert averaging @ np.ones(len(sample)) == pytest.approx(np.ones(len(place)))


@pytest.mark.slow
def test_without_play_the_averages_name_an_imbalance(smooth):
    """It turns with the table, so that most of it is gone from the mean of all stations."""
    found = {by: play_methods.by_averages(smooth, by_station=by) for by in (False, True)}
    gain = {}
    for by, candidates in found.items():
        assert [c.score for c in candidates] == sorted(c.score for c in candidates)
        gain[by] = next(c.score for c in candidates if c.hypothesis is NONE) - candidates[0].score
    assert found[True][0].hypothesis.name == "load.imbalance"
    assert gain[True] > 10.0 * gain[False]


def outcome(**changes) -> Outcome:
    right = Outcome("windows", "5", "load.imbalance", "load.imbalance", 900.0, math.sqrt(5.0), math.sqrt(2.0), 3.0)
    return dataclasses.replace(right, **changes)


def test_the_closed_share_is_that_of_the_mean_square_above_the_noise():
    assert outcome().closed == pytest.approx(0.75)
    assert outcome(after=1.0).closed == pytest.approx(1.0)
    assert outcome(after=3.0).closed == pytest.approx(-1.0)


def test_the_table_counts_right_and_wrong_names():
    slips = [outcome(first="drive.slip"), outcome(first="drive.slip", margin=29.0)]
    empty = [dataclasses.replace(slip, hidden="none") for slip in slips]
    rows = play_methods.summary([outcome(), *slips, outcome(first="none", margin=0.0), *empty]).splitlines()
    assert rows[2:] == ["| 5° | windows | 1 of 4 | 1 | 75.0 % | 1 of 2 | 3.0 |"]


@pytest.mark.slow
def test_without_play_every_method_names_what_is_hidden_and_nothing_else(capsys, monkeypatch):
    """Seed 501; the table has a row for each method and a line goes before it for each case and method."""
    chosen = ["--seed", "501", "--plays", "none", "--hidden", "load.imbalance", "none"]
    monkeypatch.setattr("sys.argv", ["play_methods", *chosen])
    play_methods.main()
    lines = capsys.readouterr().out.splitlines()
    methods = list(play_methods.METHODS)
    assert len(lines) == 2 * len(methods) + 2 + len(methods)
    for method, row in zip(methods, lines[-len(methods) :], strict=True):
        assert row.startswith(f"| none | {method} | 1 of 1 | 0 | ")
        assert " | 0 of 1 | " in row
