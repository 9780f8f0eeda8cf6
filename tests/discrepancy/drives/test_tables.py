"""What remains of a drive as a table: read off, left in a file, taken up by a second look, in both forms."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from discrepancy.chain import run_chain
from discrepancy.criteria import Criteria
from discrepancy.drives.door import subject_of
from discrepancy.drives.effects import EFFECTS, TABLES
from discrepancy.drives.library import values_of
from discrepancy.explain import explain
from discrepancy.model import NONE, Hypothesis
from discrepancy.report import report_files
from discrepancy.report.content import content
from discrepancy.table import tabulate
from indexer_env import load_machine, make_effect
from indexer_env.errors import ParameterError
from indexer_env.operating_point import OperatingPoint
from tests.discrepancy.drives.made import FILE, drive, record, run_plain, subject
from tests.discrepancy.drives.test_forward import FILE as PENDULUM
from tests.discrepancy.drives.test_forward import T, made

ONE = FILE.replace('"f"}', '"f"}\neffects = ("friction.load",)')
"""A library of one effect that is not the one missing."""

VALUES = (3.0, -8.0, 5.0, 20.0, -4.0, 9.0, 14.0, -11.0, 6.0)


def _dragging(t, q, v, a):
    return 95.0 * a + 900.0 * np.abs(v) * v


def test_a_table_closes_what_no_law_explains_and_is_no_law(tmp_path: Path) -> None:
    """Seed 3 of the records."""
    given = subject(tmp_path, _dragging, ONE, noise=2.0)
    outcome = run_chain(given, 1)
    table = outcome.table
    assert outcome.answer.names == () and table is not None
    assert table.form.hypothesis.name == "tabulated.speed" and table.closes > 0.95
    for place, value in zip(table.form.places, table.values, strict=True):
        assert value.low - 2.0 <= 900.0 * abs(place) * place <= value.high + 2.0
    told = content(outcome)["table"]
    assert told["what"] == "a table, not a law" and len(told["rows"]) == 9
    files = report_files(outcome)
    assert "a table, not a law" in files["report.html"] and "tabulated" not in files["machine.yaml"]
    assert files["with_table.yaml"].startswith("# tabulated.speed is a table, not a law")

    machine = yaml.safe_load(files["with_table.yaml"])
    second = subject_of(drive(tmp_path, ONE), [record(_dragging, noise=2.0)], machine)
    again = explain(second.model, second.held_out)
    assert again.before == pytest.approx(table.after, rel=0.05) and again.before < 0.2 * outcome.answer.before
    assert second.forms() == (), "a second table would take up the first one"


def test_where_nothing_remains_there_is_no_table(tmp_path: Path) -> None:
    given = subject(tmp_path, lambda t, q, v, a: 95.0 * a, ONE)
    answer = explain(given.model, given.held_out)
    assert tabulate(answer, given.forms()) is None


def test_a_search_that_ran_out_of_time_is_not_gone_on_with(tmp_path: Path) -> None:
    given = subject(tmp_path, _dragging, ONE)
    answer = explain(given.model, given.held_out, Criteria(seconds=1e-9))
    assert not answer.selection.complete and tabulate(answer, given.forms()) is None


def test_no_search_proposes_a_table(tmp_path: Path) -> None:
    assert not set(TABLES) & {*EFFECTS, *subject(tmp_path, _dragging).model.hypotheses()}


def _fixed(low: float, high: float) -> dict[str, float]:
    return {"low": low, "high": high, **{f"force_{k}": value for k, value in enumerate(VALUES, start=1)}}


def test_it_is_the_same_spline_as_the_indexing_machine_has(tmp_path: Path) -> None:
    from indexer_env.coefficients import coefficients
    from indexer_env.kernels.effects import knot_weight, spline_place

    torques = {f"torque_{k}": value for k, value in enumerate(VALUES, start=1)}
    machine = load_machine("smooth").with_effects(make_effect("tabulated.speed", low=-0.3, high=0.2, **torques))
    item = coefficients(machine, OperatingPoint())
    given = subject(tmp_path, _dragging)
    track = given.model.tracks[0]
    p = values_of(Hypothesis("tabulated.speed", (), _fixed(-0.3, 0.2)), ())
    found = TABLES["tabulated.speed"].law(track, p, None)
    places = [spline_place(v, item["tabulated_first"], item["tabulated_per"], 0.0) for v in track.v]
    expected = [sum(item[f"tabulated_{k}"] * knot_weight(x, float(k), 0.0) for k in range(11)) for x in places]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "law"), [("tabulated.speed", "friction.viscous"), ("tabulated.position", "spring.linear")]
)
def test_a_straight_table_in_the_forward_form_is_a_drag_or_a_spring(name: str, law: str, tmp_path: Path) -> None:
    given = made(tmp_path, 0.5 + 0.2 * np.sin(3.0 * T), PENDULUM)
    model = given.model
    middle = model.scales[0].middle if law == "spring.linear" else 0.0
    line = {f"force_{k}": 0.3 * x for k, x in enumerate(np.linspace(-9.0, 9.0, 9), start=1)}
    table = Hypothesis(name, (), {"low": middle - 9.0, "high": middle + 9.0, **line})
    one, zero = model.hypotheses()[law][0], np.zeros(len(model.parameters))
    expected = run_plain(model, one, np.concatenate([zero, one.coordinates([0.3])]), np.array([0.3, 0.0]))
    np.testing.assert_allclose(run_plain(model, table, zero, np.array([0.3, 0.0])), expected, atol=1e-7)
    assert np.abs(expected - run_plain(model, NONE, zero, np.array([0.3, 0.0]))).max() > 1e-2
    assert [form.hypothesis.name for form in given.forms()] == ["tabulated.speed", "tabulated.position"]


@pytest.mark.parametrize(
    ("change", "said"),
    [({"low": 3.0}, "high must be above low, 3"), ({"force_10": 1.0}, "force_10"), ({"force_9": None}, "force_9")],
)
def test_a_broken_table_is_refused(change: dict, said: str, tmp_path: Path) -> None:
    values = {key: value for key, value in {**_fixed(-0.3, 0.2), **change}.items() if value is not None}
    machine = {"drive": "my_drive.py", "effects": {"tabulated.speed": values}}
    with pytest.raises(ParameterError, match=said):
        subject_of(drive(tmp_path, ONE), [record(_dragging)], machine)
