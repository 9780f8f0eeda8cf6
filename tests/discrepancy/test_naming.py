"""Hidden effects are established on the machine with its healthy play, and nothing is where nothing is hidden."""

import pytest

from discrepancy.explain import explain
from indexer_env import make_effect

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("seed", "name", "parameters"),
    [
        (11, "friction.viscous", {"coefficient": 80.0}),
        (12, "roller.crack", {"stiffness_loss": 0.3}),
        (13, "drive.transmission_error", {"amplitude": 1e-3, "phase": 0.7}),
        (14, "sensor.gain", {"error": 0.1}),
    ],
)
def test_a_hidden_effect_is_established(records, seed: int, name: str, parameters: dict) -> None:
    model, held_out, _ = records(seed, effect=make_effect(name, parameters))
    answer = explain(model, held_out)
    assert [(f.name, f.grade) for f in answer.findings] == [(name, "established")]
    assert answer.closed_share > 0.9
    size = next(iter(parameters))
    found = next(e.value for e in answer.findings[0].effects[0].parameters if e.name == size)
    assert found == pytest.approx(parameters[size], rel=0.15)


def test_where_nothing_is_hidden_nothing_is_missing(records) -> None:
    model, held_out, _ = records(15)
    assert explain(model, held_out).verdict == "nothing missing"
