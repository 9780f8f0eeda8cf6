"""Hidden effects are established on the machine with its healthy play, and nothing is where nothing is hidden."""

import pytest

from discrepancy.explain import explain
from indexer_env import make_effect

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("seed", "name", "parameters", "grade"),
    [
        (11, "friction.viscous", {"coefficient": 80.0}, "established"),
        (12, "roller.crack", {"stiffness_loss": 0.3}, "established"),
        (13, "drive.transmission_error", {"amplitude": 1e-3, "phase": 0.7}, "family"),  # with a ripple of its order
        (14, "sensor.gain", {"error": 0.1}, "established"),
    ],
)
def test_a_hidden_effect_is_established(records, seed: int, name: str, parameters: dict, grade: str) -> None:
    model, held_out, _ = records(seed, effect=make_effect(name, parameters))
    answer = explain(model, held_out)
    (finding,) = answer.findings
    assert finding.grade == grade and name in [effect.name for effect in finding.effects]
    assert answer.closed_share > 0.9
    size = next(iter(parameters))
    (mine,) = [effect for effect in finding.effects if effect.name == name]
    found = next(e.value for e in mine.parameters if e.name == size)
    assert found == pytest.approx(parameters[size], rel=0.15)


def test_where_nothing_is_hidden_nothing_is_missing(records) -> None:
    model, held_out, _ = records(15)
    assert explain(model, held_out).verdict == "nothing missing"
