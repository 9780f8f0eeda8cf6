"""Probabilities of classes and bits, and their temperature."""

import dataclasses

import numpy as np
import pytest

from classifier.codes import CodeBook
from classifier.evaluate import reliability
from classifier.tasks.confidence import Confidence, class_logits, fit_temperature, softmax
from classifier.tasks.need import NotAvailable
from indexer_env.errors import ParameterError
from tests.classifier.tasks.turns import turned

FAULTS = CodeBook((1, 2, 3, 4), ("intact", "loose", "cracked", "both"), ("00", "01", "10", "11"))


def test_outputs_of_independent_bits_are_their_own_probabilities_at_temperature_1():
    outputs = np.array([[0.2, 0.7], [0.99, 0.5]])
    told = Confidence(1.0, FAULTS.matrix).assess(np.empty((2, 0)), outputs, np.empty((2, 0)))
    assert told["bit_probability"] == pytest.approx(outputs)
    assert told["class_probability"][0] == pytest.approx([0.8 * 0.3, 0.8 * 0.7, 0.2 * 0.3, 0.2 * 0.7])
    assert told["class_probability"].sum(axis=1) == pytest.approx(1)


def test_the_probability_is_that_of_the_class_that_is_named():
    rng = np.random.default_rng(3)
    codes = CodeBook(
        (1, 2, 3), ("a", "b", "c"), ("0111", "1000", "1110")
    )  # not all codes: nearest may not be likeliest
    outputs = rng.uniform(size=(500, 4))
    told = Confidence(2.0, codes.matrix).assess(np.empty((500, 0)), outputs, np.empty((500, 0)))
    named = codes.decode(outputs)
    assert np.array_equal(told["probability"], told["class_probability"][np.arange(500), named])


def test_a_temperature_undoes_overconfidence():
    """Logits made 4 times too large for labels drawn from their true probabilities."""
    rng = np.random.default_rng(0)
    logits = rng.normal(0, 2, (4000, 3))
    positions = (softmax(logits).cumsum(axis=1) < rng.uniform(size=(4000, 1))).sum(axis=1)
    assert fit_temperature(4 * logits, positions) == pytest.approx(4, rel=0.1)
    before, after = (softmax(4 * logits, t) for t in (1.0, fit_temperature(4 * logits, positions)))
    right = logits.argmax(axis=1) == positions
    assert reliability(after.max(axis=1), right).error < 0.03 < reliability(before.max(axis=1), right).error


def test_a_faultless_subset_does_not_make_the_network_certain():
    outputs = np.repeat(FAULTS.matrix, 10, axis=0)
    part = Confidence.of_control(FAULTS, outputs, np.repeat(FAULTS.classes, 10))
    told = part.assess(np.empty((40, 0)), outputs, np.empty((40, 0)))
    assert told["probability"] == pytest.approx(41 / 42, abs=0.01)


def test_turns_of_one_file_make_the_network_no_surer():
    """Twenty files of fifty turns each are told as sure as one turn of each."""
    rng = np.random.default_rng(0)
    logits = rng.normal(0, 2, (20, 3))
    positions = logits.argmax(axis=1)
    turns = np.repeat(logits, 50, axis=0), np.repeat(positions, 50), np.repeat(np.arange(20), 50)
    assert fit_temperature(*turns) == pytest.approx(fit_temperature(logits, positions), rel=1e-3)


def test_the_control_subset_counts_by_its_files(known):
    dataset, features = known
    outputs = np.clip(dataset.codes.targets(dataset.classes), 0.1, 0.9)
    once = Confidence.fit(dataset, features, outputs, 0)
    rows = np.concatenate(
        [np.flatnonzero(~dataset.rows("control")), np.repeat(np.flatnonzero(dataset.rows("control")), 9)]
    )
    drawn, more = turned(dataset, features, rows, seed=0)
    assert Confidence.fit(drawn, more, outputs[rows], 0).temperature == pytest.approx(once.temperature, rel=1e-3)


def test_too_few_control_records_make_no_probabilities(known):
    dataset, features = known
    outputs = np.tile(FAULTS.matrix[:1], (len(features), 1))
    for kept, enough in ((20, True), (19, False)):
        subsets = dataset.subsets.copy()
        subsets[np.flatnonzero(dataset.rows("control"))[kept:]] = "validation"
        few = dataclasses.replace(dataset, subsets=subsets)
        if enough:
            Confidence.fit(few, features, outputs, 0)
        else:
            with pytest.raises(NotAvailable, match="19 independent control records, 20 needed"):
                Confidence.fit(few, features, outputs, 0)


def test_outputs_beyond_0_and_1_are_no_error():
    assert np.isfinite(class_logits(FAULTS.matrix, np.array([[-0.3, 1.4]]))).all()


def test_a_temperature_of_zero_is_refused():
    with pytest.raises(ParameterError, match="temperature"):
        Confidence(0.0, FAULTS.matrix)
