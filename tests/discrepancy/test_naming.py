"""Hidden effects are named on the machine with its healthy play, and nothing is named where nothing is hidden."""

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
def test_a_hidden_effect_is_named(records, seed: int, name: str, parameters: dict) -> None:
    model, held_out, _ = records(seed, effect=make_effect(name, parameters))
    answer = explain(model, held_out)
    assert (answer.verdict, answer.names) == ("named", (name,))
    assert answer.closed_share > 0.9
    size, value = next(iter(parameters.items()))
    place = answer.rounds[0].candidates[0].place
    found = model.values(place.hypothesis, place.z)[f"{name}.{size}"]
    assert found == pytest.approx(value, rel=0.15)


def test_nothing_hidden_is_named_none(records) -> None:
    model, held_out, _ = records(15)
    assert explain(model, held_out).verdict == "none"
