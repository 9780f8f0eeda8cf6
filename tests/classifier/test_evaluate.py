"""Metrics against scikit-learn's and by hand."""

import numpy as np
import pytest
from sklearn.metrics import confusion_matrix, f1_score, roc_auc_score

from classifier.codes import CodeBook
from classifier.evaluate import auroc, confusion_of, macro_f1, mean_auroc, reliability, score


@pytest.fixture(scope="module")
def named():
    rng = np.random.default_rng(4)
    true = rng.integers(0, 4, 300)
    return true, np.where(rng.uniform(size=300) < 0.7, true, rng.integers(0, 4, 300))


def test_confusion_and_macro_f1_are_scikit_learn_s(named):
    confusion = confusion_of(*named, 4)
    assert np.array_equal(confusion, confusion_matrix(*named))
    assert macro_f1(confusion) == pytest.approx(f1_score(*named, average="macro"))


def test_a_class_that_is_neither_true_nor_named_does_not_count(named):
    assert macro_f1(confusion_of(*named, 6)) == pytest.approx(macro_f1(confusion_of(*named, 4)))


def test_auroc_is_scikit_learn_s_with_ties(named):
    rng = np.random.default_rng(5)
    positive = named[0] == 1
    scores = np.round(positive + rng.normal(0, 1, 300), 1)
    assert len(np.unique(scores)) < 300
    assert auroc(scores, positive) == pytest.approx(roc_auc_score(positive, scores))


def test_auroc_of_one_side_alone_is_not_defined_and_not_counted():
    assert np.isnan(auroc(np.array([1.0, 2.0]), np.array([True, True])))
    outputs, targets = np.array([[0.1, 0.3], [0.9, 0.4]]), np.array([[0, 1], [1, 1]])
    assert mean_auroc(outputs, targets) == 1.0
    assert np.isnan(mean_auroc(outputs, np.ones((2, 2))))


def test_reliability_by_hand():
    confidence = np.array([0.95, 1.0, 0.55, 0.55])
    found = reliability(confidence, np.array([True, False, True, False]))
    assert found.share[[5, 9]] == pytest.approx([0.5, 0.5])
    assert found.confidence[[5, 9]] == pytest.approx([0.55, 0.975])
    assert found.right[[5, 9]] == pytest.approx([0.5, 0.5])
    assert found.error == pytest.approx(0.5 * 0.05 + 0.5 * 0.475)
    assert np.isnan(found.right[0])


def test_a_score_holds_them_all():
    codes = CodeBook((1, 2), ("a", "b"), ("0", "1"))
    found = score(codes, np.array([[0.1], [0.8], [0.4]]), np.array([1, 2, 2]))
    assert found.confusion == ((1, 0), (1, 1))
    assert found.misclassified_percent == pytest.approx(100 / 3)
    assert found.macro_f1 == pytest.approx(2 / 3)
    assert found.auroc == 1.0
