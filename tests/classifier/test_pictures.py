"""Pictures name what they show, with units."""

from dataclasses import replace

import numpy as np
import pytest

from classifier.diagnose import diagnose
from classifier.diagnose.report import CaseReport
from classifier.pictures import draw_diagnosis, draw_training
from indexer_env.signal import Signal


@pytest.fixture
def signal(dataset):
    row = np.flatnonzero((dataset.classes == 2) & dataset.rows("validation"))[0]
    return Signal(dataset.records[row], dataset.sample_rate, dataset.quantity, dataset.unit, "a record")


def test_pictures_label_their_axes_with_units(result, dataset, signal):
    figures = draw_training(dataset, result)
    assert set(figures) == {"accelerations", "psds", "training", "confusion", "reliability"}
    figures["diagnosis"] = draw_diagnosis(result.model, CaseReport.of("a record", None, diagnose(result.model, signal)))

    def words(figure):
        labels = [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel(), ax.get_title(loc="left"))]
        return " ".join([*labels, figure.get_supxlabel(), figure.get_supylabel()])

    assert "table acceleration [rad/s²]" in words(figures["accelerations"])
    assert "time [s]" in words(figures["accelerations"])
    assert "frequency [Hz]" in words(figures["psds"])
    assert "PSD [(rad/s²)²/Hz]" in words(figures["psds"])
    assert "mean square error [%]" in words(figures["training"])
    assert "validation: 24 records" in words(figures["confusion"])
    assert "confidence in the named class" in words(figures["reliability"])
    assert "turn 0: rings at 20 Hz (nearest class 2: distance" in words(figures["diagnosis"])
    for label in (1, 2, 3):
        assert f"class {label}: rings at {10 * label} Hz" in words(figures["accelerations"])


def test_reliability_is_drawn_as_the_outputs_stand_and_at_the_temperature(result, dataset):
    """With a hand-made disagreement: where all names are wrong, the curves lie at 0 and the error is the confidence."""
    wrong = replace(dataset, classes=dataset.classes % len(dataset.codes.classes) + 1)
    for data, height in ((dataset, 1.0), (wrong, 0.0)):
        figure = draw_training(data, result)["reliability"]
        above, below = figure.axes
        _, raw, calibrated = above.lines
        assert set(raw.get_ydata()) == set(calibrated.get_ydata()) == {height}
        shares = np.array([bar.get_height() for bar in below.containers[0]])
        sure = np.average(raw.get_xdata(), weights=shares[shares > 0])
        (text,) = (text.get_text() for text in figure.legends[0].get_texts() if "stand" in text.get_text())
        assert float(text.split()[-2]) == pytest.approx(100 * abs(height - sure), abs=0.06)


def test_a_picture_of_several_turns_shows_what_each_was_named(result, signal):
    values = np.concatenate([signal.values, np.full(400, 2.0), signal.values])
    long = Signal(values, signal.sample_rate, signal.quantity, signal.unit, "three turns")
    report = CaseReport.of("three turns", None, diagnose(result.model, long))
    ax = draw_diagnosis(result.model, report).axes[-1]
    assert "each turn" in ax.get_title(loc="left")
    assert len(ax.lines) == 2 and len(ax.patches) == 1
