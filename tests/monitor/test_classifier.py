"""What a classifier's diagnosis means to the monitor."""

from types import SimpleNamespace

import numpy as np
import pytest

from indexer_env.signal import Signal
from indexer_records.conditions import RecordConditions
from monitor.analysis.classifier import ClassifierDiagnoser
from tests.monitor.fakes import FAST, RATE


@pytest.mark.parametrize(("novel", "probability"), [(False, 0.9), (True, None)])
def test_none_of_the_classes_has_no_probability(monkeypatch, novel, probability):
    """That of the model is of the class that would be named."""
    sizes = {"crack": 0.3, "crack_low": 0.2, "crack_high": 0.4}
    told = SimpleNamespace(
        verdict="none of the classes it was taught" if novel else "crack", is_novel=novel, code="010", bands=(),
        assessment={"probability": 0.9, "novelty": 3.0 if novel else 0.5, **sizes}, class_name="crack",
        second_name="intact", margin=0.5,
    )  # fmt: skip
    monkeypatch.setattr("monitor.analysis.classifier.diagnose_turn", lambda *_: told)
    diagnoser = object.__new__(ClassifierDiagnoser)
    diagnoser.modes, diagnoser.quantities = (FAST,), ("crack",)
    diagnoser._models = {FAST.name: SimpleNamespace(conditions=SimpleNamespace(check=lambda *_: None))}
    found = diagnoser.diagnose_turn(Signal(np.ones(100), RATE, unit="m/s^2"), RecordConditions())
    assert found.probability == probability and found.verdict == told.verdict
    assert found.sizes == {"crack": (0.3, 0.0 if novel else 0.2, 0.4)}, "of what was never taught no size is sure"


@pytest.mark.parametrize(
    ("shown", "stations"),
    [([(5.8, 6.3)], 6), ([(5.8, 6.3), (6.0, 6.1)], 6), ([(5.9, 6.1), (7.9, 8.1)], None), ([None], None)],
)
def test_the_stations_of_a_model_are_the_indexes_that_its_records_show(shown, stations):
    diagnoser = object.__new__(ClassifierDiagnoser)
    models = [SimpleNamespace(conditions=SimpleNamespace(stations=one)) for one in shown]
    diagnoser._models = {str(k): model for k, model in enumerate(models)}  # type: ignore[misc]
    assert diagnoser.stations == stations
