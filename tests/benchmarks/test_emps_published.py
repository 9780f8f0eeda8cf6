"""A report on the measured drive holds the published physics, or it says which number it does not hold."""

import json
import sys
from pathlib import Path

import pytest

from benchmarks import emps_published
from benchmarks.emps_published import PUBLISHED, against_published


def report(**wrong: tuple[float, float]) -> dict:
    """Both frictions established, the offset in a family with an asymmetric friction; `wrong` intervals by name."""
    intervals = {name: [value - 1.0, value + 1.0] for name, (value, _) in PUBLISHED.items()}
    intervals |= {name: list(ends) for name, ends in wrong.items()}

    def effect(name: str, parameter: str) -> dict:
        interval = intervals.get(f"{name}.{parameter}", [-9.0, 9.0])
        return {"name": name, "parameters": [{"name": parameter, "interval": interval}]}

    return {
        "calibration": {"parameters": [{"name": "mass", "interval": intervals["mass"]}]},
        "findings": [
            {"grade": "established", "effects": [effect("friction.viscous", "coefficient")]},
            {"grade": "established", "effects": [effect("friction.coulomb", "force")]},
            {"grade": "family", "effects": [effect("friction.asymmetric", "force"), effect("offset", "force")]},
        ],
    }


def test_intervals_that_hold_every_number_are_right() -> None:
    assert [ok for *_, ok in against_published(report())] == [True] * 4


@pytest.mark.parametrize("name", list(PUBLISHED))
def test_an_interval_beside_its_number_is_told(name: str) -> None:
    value, _ = PUBLISHED[name]
    for low, high in ((value + 0.1, value + 2.0), (value - 2.0, value - 0.1)):
        assert {row[0] for row in against_published(report(**{name: (low, high)})) if not row[4]} == {name}


def test_a_hint_is_no_finding() -> None:
    told = report()
    told["findings"][1]["grade"] = "stands in"
    rows = {row[0]: row for row in against_published(told)}
    assert rows["friction.coulomb.force"][3:] == ("not found", False)


@pytest.mark.parametrize(("wrong", "code"), [({}, 0), ({"mass": (90.0, 92.0)}, 1)])
def test_the_command_prints_the_table_and_fails_with_it(
    wrong: dict, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    path = tmp_path / "report.json"
    path.write_text(json.dumps(report(**wrong)))
    monkeypatch.setattr(sys, "argv", ["emps_published", str(path)])
    with pytest.raises(SystemExit) as ended:
        emps_published.main()
    assert ended.value.code == code
    assert "| offset.force | -3.2 | -4.2 to -2.2 N | family | yes |" in capsys.readouterr().out
