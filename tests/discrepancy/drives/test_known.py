"""Effects that a drive has from the start: their values as they are stated, whatever else is looked for."""

from pathlib import Path

import pytest

from discrepancy.drives.door import subject_of
from discrepancy.drives.inverse import InverseModel
from discrepancy.model import Hypothesis
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import FILE, drive, record, subject


def _known(folder: Path, known: dict, more: str = "") -> InverseModel:
    model = subject(folder, lambda t, q, v, a: 95.0 * a, f"{FILE}\nknown = {known}\n{more}").model
    assert isinstance(model, InverseModel)
    return model


def _values(one: Hypothesis) -> list[float]:
    return [p.value(0.0) for p in one.parameters]


def test_a_value_beyond_what_a_search_would_try_is_taken_as_stated(tmp_path: Path) -> None:
    """The range that a search takes from this record begins at some 3 mm/s and ends at twenty times its rms force."""
    made = _known(tmp_path, {"friction.stribeck": {"force": 1e5, "speed": 1e-4}})
    (one,) = made.known
    assert _values(one) == [1e5, 1e-4]
    assert one.parameters[1].low == 1e-4 and one.parameters[1].high > 0.1


@pytest.mark.parametrize(
    ("known", "said"),
    [
        (
            {"friction.stribeck": {"force": -4.0, "speed": 0.01}},
            r"friction.stribeck.force must be a finite number >= 0 N, got -4.0",
        ),
        (
            {"friction.stribeck": {"force": 4.0, "speed": 0.0}},
            r"friction.stribeck.speed must be a finite number > 0 m/s, got 0.0",
        ),
        (
            {"friction.load": {"coefficient": 1.5}},
            r"friction.load.coefficient must be a finite number >= 0 and <= 0.95, got 1.5",
        ),
        ({"inertia": {"inertia": 3.0}}, r"known must be effects that .* do not describe, got 'inertia'; leave it out"),
        ({"friction.coulob": {"force": 3.0}}, r"known must be one of .*'friction.coulob'; did you mean"),
    ],
)
def test_what_cannot_be_is_one_sentence(known: dict, said: str, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said) as raised:
        _known(tmp_path, known)
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")


def test_what_is_known_need_not_be_looked_for(tmp_path: Path) -> None:
    only = 'effects = ("offset",)\n'
    made = _known(tmp_path, {"friction.coulomb": {"force": 20.0}}, only)
    assert [one.name for one in made.known] == ["friction.coulomb"] and _values(made.known[0]) == [20.0]
    assert list(made.hypotheses()) == ["offset"]
    machine = {"drive": "my_drive.py", "effects": {"friction.viscous": {"coefficient": 60.0}}}
    second = subject_of(drive(tmp_path, FILE + only), [record(lambda t, q, v, a: 95.0 * a)], machine)
    assert isinstance(second.model, InverseModel)
    assert [one.name for one in second.model.known] == ["friction.viscous"]
    assert list(second.model.hypotheses()) == ["offset"]
