"""Samples as they come are diagnosed as the whole signal is, bit for bit."""

import dataclasses
import math

import numpy as np
import pytest

from classifier.conditions import Conditions, RecordConditions
from classifier.diagnose import IncrementalDiagnoser, diagnose
from indexer_env.errors import ParameterError, SignalError
from indexer_env.signal import Signal
from indexer_env.units import RPM
from indexer_records.conditions import Pulse
from indexer_records.turns import pulse_edges


def several_turns(dataset, rate, turns=3.4):
    """A record of a tone that changes from turn to turn, and the pulse that begins each."""
    rng = np.random.default_rng(7)
    time = np.arange(round(2.0 * turns * rate)) / rate
    tone = 10 * (1 + (time // 2.0) % 3)
    pulse = 5.0 * ((time - 0.3) % 2.0 < 0.1) * (time > 0.3)
    return Signal(np.sin(2 * np.pi * tone * time) + 0.3 * rng.standard_normal(time.size), rate), pulse


@pytest.mark.parametrize("with_pulse", [False, True])
@pytest.mark.parametrize("rate", [200.0, 200.1, 517.3])
@pytest.mark.parametrize("piece", [1, 7, 400, 401, 5000])
def test_reports_are_those_of_the_whole_signal(result, dataset, with_pulse, rate, piece):
    signal, pulse = several_turns(dataset, rate)
    wanted = diagnose(result.model, signal, pulse_values=pulse if with_pulse else None)
    running = IncrementalDiagnoser(result.model, rate, "rad/s^2", pulse_range=(0.0, 5.0) if with_pulse else None)
    reports = []
    for first in range(0, signal.values.size, piece):
        part = slice(first, first + piece)
        reports += running.feed(signal.values[part], pulse[part] if with_pulse else None)
    reports += running.finish()
    assert len(wanted) == 3
    assert [report.to_dict() for report in reports] == [report.to_dict() for report in wanted]
    for report, whole in zip(reports, wanted, strict=True):
        assert np.array_equal(report.record, whole.record)


def test_a_turn_is_reported_at_its_last_sample(result, dataset):
    values = dataset.records[0]
    running = IncrementalDiagnoser(result.model, 200.0, "rad/s^2")
    assert running.feed(values[:399]) == []
    (report,) = running.feed(values[399:])
    assert report.diagnosis == diagnose(result.model, Signal(values, 200.0))[0].diagnosis


def test_missing_samples_cost_their_turn_only(result, dataset):
    values = np.concatenate(dataset.records[:3])
    values[500] = np.nan
    reports = IncrementalDiagnoser(result.model, 200.0, "rad/s^2").feed(values)
    assert [report.diagnosis is None for report in reports] == [False, True, False]
    assert reports[1].problem == "must hold finite samples only, got 1 that are none, the first at 2.5 s"


def test_after_a_reset_the_next_sample_is_the_first(result, dataset):
    running = IncrementalDiagnoser(result.model, 200.0, "rad/s^2")
    running.feed(dataset.records[1][:123])
    running.reset()
    (report,) = running.feed(dataset.records[0])
    assert (report.turn, report.start) == (0, 0.0)
    assert report.diagnosis == diagnose(result.model, Signal(dataset.records[0], 200.0))[0].diagnosis


@pytest.fixture
def bench(result):
    return dataclasses.replace(
        result.model, unit="m/s^2", conditions=Conditions((0.4, 0.4), (157.0, 158.0), ("bench",))
    )


def test_a_measurement_of_the_same_kind_is_taken(bench):
    known = RecordConditions(motor_speed=1500 * RPM, sensor_radius=0.4, machine="bench")
    IncrementalDiagnoser(bench, 200.0, "m/s^2", known)


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({}, r"radius of the accelerometer must be known .* give known\.sensor_radius"),
        ({"sensor_radius": 0.5}, r"must be 0\.4 m within 1 % .* got 0\.5 m"),
        (
            {"sensor_radius": 0.4, "motor_speed": 78.5},
            r"must be 1499\.24 to 1508\.79 rpm within 2 % .* got 749\.62 rpm",
        ),
        ({"sensor_radius": 0.4, "machine": "other"}, r"trained on \(bench\), got 'other'"),
    ],
)
def test_a_measurement_of_another_kind_is_refused(bench, known, words):
    with pytest.raises(SignalError, match=words) as caught:
        IncrementalDiagnoser(bench, 200.0, "m/s^2", RecordConditions(**known), source="channel 3")
    assert str(caught.value).startswith("channel 3: ")


def test_numbers_that_are_none_are_refused(result):
    with pytest.raises(ParameterError, match="rate must be a finite number > 0 Hz, got nan"):
        IncrementalDiagnoser(result.model, math.nan, "rad/s^2")
    with pytest.raises(SignalError, match="the signal: the pulse must change"):
        diagnose(result.model, Signal(np.arange(500.0), 200.0), pulse_values=np.zeros(500))
    with pytest.raises(SignalError, match="the signal: the pulse must be as long as the samples, 500, got 3"):
        diagnose(result.model, Signal(np.arange(500.0), 200.0), pulse_values=np.array([0.0, 5.0, 0.0]))


@pytest.mark.parametrize("lobe", [1.0, 1.06, 1.1])
def test_turns_begin_at_the_edges_of_the_ingest(result, dataset, lobe):
    """Of a pick-up that reads both polarities, one lobe larger, with noise between them, and of a pulse with one spike;
    seed 5."""
    signal, pulse = several_turns(dataset, 200.0, 6.4)
    both = pulse - lobe * np.roll(pulse, 20) + 0.05 * np.random.default_rng(5).standard_normal(pulse.size)
    spiked = np.where(np.arange(pulse.size) == 900, 12.0, pulse)
    for one in (both, spiked):
        edges = pulse_edges(one, 200.0, Pulse())
        found = diagnose(result.model, signal, pulse_values=one)
        assert [report.start for report in found] == pytest.approx(edges[:-1].tolist())
        assert sum(not report.problem for report in found) >= 4
