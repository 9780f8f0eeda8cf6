"""A model goes on learning on records of another machine."""

import dataclasses
import math

import numpy as np
import pytest

from classifier.codes import CodeBook
from classifier.features import Psd
from classifier.model import load_model, save_model
from classifier.results import markdown
from classifier.train import train
from classifier.trainers.traingdx import TrainGdx
from classifier.transfer import ANEW, AS_IT_IS, FINE_TUNED, Learner, draw, fitted_to, in_turns
from indexer_env.errors import SignalError


@pytest.fixture(scope="module")
def other(dataset):
    """The same tones under other labels and codes, from a machine that hums at 24 Hz."""
    time = np.arange(dataset.records.shape[1]) / dataset.sample_rate
    humming = (dataset.records + 6 * np.sin(2 * np.pi * 24 * time)).astype(np.float32)
    codes = CodeBook((7, 8, 9), tuple(reversed(dataset.codes.names)), ("100", "010", "001"))
    return dataclasses.replace(dataset, records=humming, classes=10 - dataset.classes, codes=codes)


@pytest.fixture(scope="module")
def learner(result, other):
    return Learner.of(result.model, fitted_to(result.model, other), TrainGdx(epochs=200))


def test_classes_are_matched_by_their_names(result, dataset, other):
    fitted = fitted_to(result.model, other)
    assert np.array_equal(fitted.classes, dataset.classes)
    assert fitted.codes == result.model.codes


def test_another_rate_unit_or_class_is_refused(result, other):
    for changes, said in (({"sample_rate": 100.0}, "rate"), ({"unit": "m/s^2"}, "unit")):
        with pytest.raises(SignalError, match=said):
            fitted_to(result.model, dataclasses.replace(other, **changes))
    fitted_to(result.model, dataclasses.replace(other, sample_rate=200.1))
    named = dataclasses.replace(other.codes, names=("rings at 10 Hz", "rings at 20 Hz", "squeals"))
    with pytest.raises(SignalError, match="squeals"):
        fitted_to(result.model, dataclasses.replace(other, codes=named))


def test_classes_without_a_record_are_told_and_count_against_the_model_as_it_is(result, other):
    """Records of two of three classes, the third of which the model still names."""
    kept = other.classes != 7
    (lost,) = [name for label, name in zip(other.codes.classes, other.codes.names, strict=True) if label == 7]
    parts = (other.codes.classes, other.codes.names, other.codes.codes)
    codes = CodeBook(*(tuple(part[place] for place in (1, 2)) for part in parts))
    few = dataclasses.replace(
        other, records=other.records[kept], classes=other.classes[kept], subsets=other.subsets[kept], codes=codes
    )
    learner = Learner.of(result.model, fitted_to(result.model, few), TrainGdx(epochs=20))
    assert lost in learner.tuned(0).left_out["classes"]
    rows = learner.dataset.rows("validation")
    label = result.model.codes.classes[result.model.codes.names.index(lost)]
    always = result.model.codes.targets(np.full(int(rows.sum()), label))
    assert learner.scored(always).misclassified_percent == 100.0


def test_few_records_hold_every_class(dataset):
    rows = in_turns(dataset, np.random.default_rng(0).permutation(72))
    assert sorted(rows) == list(range(72))
    for count in (3, 6, 9):
        assert np.bincount(dataset.classes[rows[:count]])[1:].tolist() == [count // 3] * 3


def test_a_curve_has_every_count_and_learning_helps(learner):
    rows = [*learner.as_it_is(), *learner.curve([3, 18], seed=0, restarts=2)]
    assert {(row.method, row.x) for row in rows} == {
        (AS_IT_IS, 0.0),
        *((m, n) for m in (FINE_TUNED, ANEW) for n in (3, 18)),
    }
    wrong = {(row.method, row.x): row.value for row in rows if row.metric == "misclassified [%]"}
    assert wrong[FINE_TUNED, 18] <= 10 < wrong[AS_IT_IS, 0]
    assert len(draw(rows).axes) == 1


def test_the_network_as_it_is_is_judged_once(learner):
    """Seeds 0 and 1: the same number from each would have an interval of 0, as if it were known for sure."""
    rows = [*learner.as_it_is(), *(row for seed in range(2) for row in learner.curve([6], seed, restarts=1))]
    (line,) = (text for text in markdown(rows, (("misclassified [%]", 2),)).splitlines() if AS_IT_IS in text)
    assert "±" not in line and sum(row.method == AS_IT_IS for row in rows) == 2


def test_a_tuned_model_of_two_channels_is_for_records_of_the_same_length(dataset):
    both = dataclasses.replace(dataset, records=np.stack([dataset.records, dataset.records], axis=1))
    model = train(both, Psd(2.0, 50.0), TrainGdx(epochs=5), hidden=3, restarts=1, parts=()).model
    tuned = Learner.of(model, fitted_to(model, both), TrainGdx(epochs=5)).tuned(0)
    assert (tuned.samples, tuned.channels) == (model.samples, model.channels) == (400, 2)


@dataclasses.dataclass(frozen=True)
class OnRequest:
    kind = "convolution"


def test_parts_that_do_not_come_along_are_told_and_those_not_asked_for_stay_away(result, other):
    left_out = {"range": "not asked for", "novelty": "not available, 3 records"}
    before = dataclasses.replace(result.model, parts=(OnRequest(),), left_out=left_out)
    tuned = Learner.of(before, fitted_to(before, other), TrainGdx(epochs=5)).tuned(0)
    assert tuned.left_out["convolution"] == "not learnt anew" and tuned.left_out["range"] == "not asked for"
    assert {"range", "convolution"}.isdisjoint(part.kind for part in tuned.parts)
    assert "novelty" in {part.kind for part in tuned.parts}


def test_a_second_fine_tuning_does_not_hide_the_first(result, other):
    model = result.model
    for name in ("first", "second", "third"):
        told = dataclasses.replace(other, provenance={"manifest_sha256": name})
        model = Learner.of(model, fitted_to(model, told), TrainGdx(epochs=2)).tuned(0)
        assert model.provenance["fine_tuned_on"] == told.provenance
    assert all(model.items_learnt(name) == math.inf for name in ("first", "second", "third"))
    assert model.items_learnt("another") == 0


def test_the_items_of_another_length_of_the_same_rows_are_learnt_up_to_its_count(result):
    told = {"data": {"manifest_sha256": "one", "rows_sha256": "rows", "count": 30}, "fine_tuned_on": {"count": 90}}
    model = dataclasses.replace(result.model, provenance=told)
    assert (model.items_learnt("other", "rows"), model.items_learnt("other", "others")) == (30, 0)
    assert model.items_learnt("other", None) == 0 and model.items_learnt("one", "rows") == math.inf


def test_the_tuned_model_is_stored_and_says_on_what_it_learnt(learner, tmp_path):
    model = learner.tuned(0)
    save_model(model, tmp_path)
    again = load_model(tmp_path)
    records = learner.dataset.records[learner.dataset.rows("validation")]
    assert np.array_equal(again.outputs(records), model.outputs(records))
    assert again.provenance["fine_tuned_on"] == learner.dataset.provenance
    assert "fine_tuned_before" not in again.provenance
    assert again.metrics["validation"]["misclassified_percent"] < 10
    assert "confidence" in {part.kind for part in again.parts}
    assert set(again.left_out) >= {"indexing", "sign"} and again.left_out == model.left_out
