"""Turns of a running measurement: the same whatever the pieces, those of the ingest, in bounded memory."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as settings_of_examples
from hypothesis import strategies as st

from datagen.ingest.cut import Seen, cut
from datagen.ingest.settings import Settings
from datagen.ingest.sources import Source
from datagen.ingest.split import labels_of
from indexer_env.errors import ParameterError, SignalError
from indexer_records.conditions import Pulse
from indexer_records.stream import LONGEST_PIECE, TurnStream
from indexer_records.turns import EdgeFinder, pulse_edges

PERIOD = 0.5
SAME, FAST = 1000.0, 2560.0


def measured(rate: float, seconds: float = 3.3, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A sine with noise, and a pulse whose turns last 0.5 s within 1 %, the first edge at 0.2 s."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(seconds * rate)) / rate
    values = np.sin(2 * np.pi * 30 * times) + 0.1 * rng.standard_normal(len(times))
    edges = 0.2 + np.concatenate([[0.0], np.cumsum(PERIOD * (1 + rng.uniform(-0.01, 0.01, 5)))])
    pulse = np.sum(
        [np.clip((times - edge) * 500, 0, 1) - np.clip((times - edge - 0.05) * 500, 0, 1) for edge in edges], 0
    )
    return values, 5 * pulse + 0.1 * rng.standard_normal(len(times))


def settings(**pulse) -> Settings:
    return Settings(1000.0, period=PERIOD, pulse=Pulse(**pulse))


def told(turns):
    plain = [(t.start, t.duration, t.problem, t.clipped_share, t.constant_share) for t in turns]
    return plain, [None if t.record is None else t.record.tobytes() for t in turns]


def whole(rate, values, pulse=None, **changes):
    span = None if pulse is None else (-0.5, 5.5)
    stream = TurnStream(rate, settings(**changes).grid, span)
    return [*stream.feed(values, pulse), *stream.finish()]


@pytest.mark.parametrize("with_pulse", [False, True])
@pytest.mark.parametrize("rate", [SAME, FAST, 1013.7])
@settings_of_examples(max_examples=10)
@given(cuts=st.lists(st.integers(0, 3300), max_size=12))
def test_the_pieces_do_not_matter(with_pulse, rate, cuts):
    values, pulse = measured(rate)
    stream = TurnStream(rate, settings().grid, (-0.5, 5.5) if with_pulse else None)
    pieces = np.split(np.arange(len(values)), sorted(cuts))
    turns = [turn for piece in pieces for turn in stream.feed(values[piece], pulse[piece] if with_pulse else None)]
    turns += stream.finish()
    at_once = whole(rate, values, pulse if with_pulse else None)
    assert len(at_once) == (5 if with_pulse else 6)
    assert told(turns) == told(at_once)


@pytest.mark.parametrize("with_pulse", [False, True])
def test_sample_by_sample_is_the_same_too(with_pulse):
    values, pulse = measured(SAME)
    stream = TurnStream(SAME, settings().grid, (-0.5, 5.5) if with_pulse else None)
    turns = []
    for place in range(len(values)):
        one = slice(place, place + 1)
        turns += stream.feed(values[one], pulse[one] if with_pulse else None)
    assert told([*turns, *stream.finish()]) == told(whole(SAME, values, pulse if with_pulse else None))


@pytest.mark.parametrize("with_pulse", [False, True])
@pytest.mark.parametrize("rate", [SAME, FAST])
def test_turns_and_records_are_those_of_the_ingest(with_pulse, rate, tmp_path):
    """Bit for bit where nothing is resampled, else to the ripple of the filter, 100 dB below the signal, but for the
    ends of the file, beyond which both guess."""
    values, pulse = measured(rate)
    path = tmp_path / "a.csv"
    rows = [f"{k / rate:.9f},{v!r},{p!r}" for k, (v, p) in enumerate(zip(values.tolist(), pulse.tolist(), strict=True))]
    path.write_text("\n".join(["time [s],acc [m/s^2],pulse", *rows]))
    source = Source(path, "a.csv", "one")
    chosen = settings(column="pulse" if with_pulse else None)
    found = cut(source, labels_of([source, Source(path, "b.csv", "two")], chosen.split, 0)[0], chosen, Seen())
    span = (float(pulse.min()), float(pulse.max())) if with_pulse else None
    stream = TurnStream(rate, chosen.grid, span)
    turns = [*stream.feed(values, pulse if with_pulse else None), *stream.finish()]
    assert [(turn.start, turn.duration) for turn in turns] == [
        (row["source_start"], row["source_duration"]) for row in found.rows
    ]
    for turn, row, record in zip(turns, found.rows, found.records, strict=True):
        assert (turn.clipped_share, turn.constant_share) == (row["clipped_share"], row["constant_share"])
        at_an_end = turn in (turns[0], turns[-1])
        close = 0.0 if (rate, with_pulse) == (SAME, False) else 1e-3 if at_an_end else 2e-5
        np.testing.assert_allclose(turn.record, record, atol=close)


@pytest.mark.parametrize("rate", [SAME, 999.6, 1000.4])
def test_after_weeks_and_by_any_clock_the_samples_come_through_as_they_are(rate):
    """Turn 2 · 10^7 of a stream, as if the samples before it had come, and the first one, piece by piece."""
    for before in (0, 2 * 10**7):
        stream = TurnStream(rate, settings().grid)
        stream._turns, stream._count = before, math.ceil(before * PERIOD * rate)
        stream._held = stream._kept
        values = measured(SAME)[0]
        turns = [turn for piece in np.split(values, 10) for turn in stream.feed(piece)]
        assert len(turns) == 6
        for turn in turns:
            begin = round(turn.start * rate) - math.ceil(before * PERIOD * rate)
            np.testing.assert_array_equal(turn.record, values[max(0, begin) :][:500].astype(np.float32))


def test_a_turn_is_reported_with_its_last_sample():
    values, _ = measured(SAME)
    stream = TurnStream(SAME, settings().grid)
    assert stream.feed(values[:499]) == []
    (turn,) = stream.feed(values[499:500])
    assert np.array_equal(turn.record, values[:500].astype(np.float32))


def test_memory_is_bounded_also_where_no_pulse_comes():
    stream = TurnStream(SAME, settings().grid, (0.0, 5.0))
    before = stream._buffer.nbytes
    for _ in range(20):
        assert stream.feed(np.ones(LONGEST_PIECE + 5), np.zeros(LONGEST_PIECE + 5)) == []
    assert stream._buffer.nbytes == before < 3e6
    assert len(stream._edges._index) <= 4


def test_missed_pulses_and_other_speeds_cost_their_turn_only():
    values, pulse = measured(SAME)
    pulse[1150:1300] = 0.0
    turns = whole(SAME, values, pulse)
    assert [bool(turn.problem) for turn in turns] == [False, True, False, False]
    assert "1 pulse was missed" in turns[1].problem and turns[1].record is None


def test_a_pulse_that_hovers_for_longer_than_a_turn_is_named():
    pulse = np.zeros(4000)
    pulse[1000:1010] = pulse[2100:2110] = 5.0
    pulse[1500:2100] = 2.6
    (turn,) = whole(SAME, np.zeros(4000), pulse)
    assert turn.problem == "must end with a pulse that rises within a turn, got a slower"


def test_missing_samples_cost_their_turn_only():
    values, _ = measured(SAME)
    values[[700, 701]] = np.nan, np.inf
    turns = whole(SAME, values)
    assert [turn.problem for turn in turns if turn.problem] == [
        "must hold finite samples only, got 2 that are none, the first at 0.7 s"
    ]
    assert turns[1].record is None
    masked = np.ma.masked_invalid(values)
    assert told(whole(SAME, masked))[1] == told(turns)[1]


def test_a_reset_forgets_all():
    values, pulse = measured(FAST)
    stream = TurnStream(FAST, settings().grid, (-0.5, 5.5))
    stream.feed(values[:3000], pulse[:3000])
    stream.reset()
    assert told([*stream.feed(values, pulse), *stream.finish()]) == told(whole(FAST, values, pulse))
    assert stream.count == 0


def test_edges_piece_by_piece_are_those_of_the_whole():
    _, pulse = measured(SAME)
    for edge in ("rising", "falling"):
        chosen = Pulse(edge=edge)
        finder = EdgeFinder(pulse.min(), pulse.max(), chosen)
        found = np.concatenate([finder.feed(piece)[0] for piece in np.split(pulse, range(1, len(pulse)))])
        assert np.array_equal(found / SAME, pulse_edges(pulse, SAME, chosen))


@pytest.mark.parametrize(
    ("values", "pulse", "words"),
    [
        (np.zeros((2, 5)), None, r"one-dimensional array \(n,\), got shape \(2, 5\)"),
        (np.array(["a"]), None, "must be real numbers"),
        (np.zeros(5, complex), None, "must be real numbers"),
        (np.zeros(5), np.zeros(5), "left out where its range was not given"),
    ],
)
def test_samples_that_are_none_are_refused_and_change_nothing(values, pulse, words):
    stream = TurnStream(SAME, settings().grid)
    with pytest.raises(SignalError, match=words):
        stream.feed(values, pulse)
    assert stream.count == 0


@pytest.mark.parametrize(
    ("pulse", "words"),
    [
        (None, "must be given with all samples"),
        (np.zeros(4), "must be as long as the samples, 5, got 4"),
        (np.array([0, 0, np.nan, 0, 0]), "must be finite, got nan at sample 2"),
    ],
)
def test_a_pulse_that_does_not_go_with_the_samples_is_refused(pulse, words):
    stream = TurnStream(SAME, settings().grid, (0.0, 5.0))
    with pytest.raises(SignalError, match=words):
        stream.feed(np.zeros(5), pulse)
    assert stream.count == 0


def test_a_stream_that_cannot_give_such_records_is_refused():
    with pytest.raises(ParameterError, match=r"TurnStream\.rate must be"):
        TurnStream(0.0, settings().grid)
    with pytest.raises(SignalError, match=r"at most 1\.1 times the rate of the file"):
        TurnStream(500.0, settings().grid)
    with pytest.raises(SignalError, match="the pulse must change"):
        TurnStream(SAME, settings().grid, (1.0, 1.0))
