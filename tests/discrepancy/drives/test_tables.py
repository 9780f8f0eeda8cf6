"""What remains of a drive as a table: read off, left in a file, taken up by a second look, in both forms."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from discrepancy.chain import run_chain
from discrepancy.criteria import Criteria
from discrepancy.drives.door import subject_of
from discrepancy.drives.effects import EFFECTS, TABLES
from discrepancy.drives.effects.tabulated import counts_of, ends_of
from discrepancy.drives.library import tabulated_row, values_of
from discrepancy.explain import explain
from discrepancy.model import NONE, Hypothesis, together
from discrepancy.report import report_files
from discrepancy.report.content import content
from discrepancy.table import tabulate
from indexer_env.effects.tabulated import grid_names
from indexer_env.errors import ParameterError
from indexer_env.kernels.effects import tabulated
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
    for (place,), value in zip(table.form.places, table.values, strict=True):
        assert value.low - 2.0 <= 900.0 * abs(place) * place <= value.high + 2.0
    told = content(outcome)["table"]
    assert told["what"] == "a table, not a law" and len(told["rows"]) == 9
    files = report_files(outcome)
    assert "a table, not a law" in files["report.html"] and "tabulated" not in files["machine.yaml"]
    assert files["with_table.yaml"].startswith("# tabulated.speed is a table over the speed [m/s], not a law.")

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


PAIR = "tabulated.speed_position"


def _dragging_by_place(t, q, v, a):
    """A drag of 180 N s/m in the middle of the stroke, more on one side and less on the other."""
    return 95.0 * a + (180.0 + 1200.0 * q) * v


def test_a_second_variable_is_added_where_records_held_out_ask_for_it(tmp_path: Path) -> None:
    outcome = run_chain(subject(tmp_path, _dragging_by_place, ONE, noise=2.0), 1)
    table = outcome.table
    assert table is not None and table.form.hypothesis.name == PAIR and table.closes > 0.95
    assert table.form.over == "speed [m/s] and position [m]" and len(table.values) == 25
    q, v = (np.concatenate([getattr(t, name) for t in outcome.subject.model.tracks]) for name in "qv")
    near = [np.hypot((v - x) / np.ptp(v), (q - y) / np.ptp(q)).min() < 0.05 for x, y in table.form.places]
    assert sum(near) > 8, "nothing is said of places that no record passes"
    for (x, y), value, seen in zip(table.form.places, table.values, near, strict=True):
        expected = (180.0 + 1200.0 * y) * x
        assert not seen or value.low - 2.0 <= expected <= value.high + 2.0, (x, y, value)
    told = content(outcome)["table"]
    assert told["what"] == "a table, not a law" and told["rows"][7]["place"] == list(table.form.places[7])
    assert [len(row) for row in told["places"]] == [5, 5]
    files = report_files(outcome)
    page = files["report.html"]
    assert "a table, not a law" in page and "downwards the first variable" in page
    assert files["with_table.yaml"].startswith(
        f"# {PAIR} is a table over the speed [m/s] and position [m], not a law.\n# Its places lie from "
    )

    machine = yaml.safe_load(files["with_table.yaml"])
    second = subject_of(drive(tmp_path, ONE), [record(_dragging_by_place, noise=2.0)], machine)
    again = explain(second.model, second.held_out)
    assert again.before == pytest.approx(table.after, rel=0.05) and again.before < 0.2 * outcome.answer.before


def test_no_second_variable_is_added_that_leaves_more_than_half(tmp_path: Path, monkeypatch) -> None:
    """Nine places follow this force over the speed and five do not, so that a table over speed and position, on which
    a little depends, leaves two thirds of what the one over the speed leaves."""
    given = subject(tmp_path, lambda t, q, v, a: 95.0 * a + 40.0 * np.sin(12.0 * v) + 100.0 * q, ONE, noise=0.5)
    answer = explain(given.model, given.held_out)
    table = tabulate(answer, given.forms())
    assert table is not None and table.form.hypothesis.name == "tabulated.speed"
    monkeypatch.setattr("discrepancy.table._LEFT", 1.0)
    other = tabulate(answer, given.forms())
    assert other is not None and other.form.hypothesis.name == PAIR and other.after < table.after


def _fixed(low: float, high: float, name: str = "tabulated.speed") -> dict[str, float]:
    forces = grid_names("force", counts_of(name))
    ends = {"low": low, "high": high, "low_2": -0.05, "high_2": 0.1}
    own = {end: ends[end] for end in ends_of(name)}
    return {**own, **{force: VALUES[k % len(VALUES)] for k, force in enumerate(forces)}}


@pytest.mark.parametrize("name", ["tabulated.speed", "tabulated.position", PAIR])
def test_the_inverse_form_has_the_spline_of_the_kernels(name: str, tmp_path: Path) -> None:
    """SciPy's splines in one form, the kernel's own in the other."""
    track = subject(tmp_path, _dragging).model.tracks[0]
    p = values_of(Hypothesis(name, (), _fixed(-0.3, 0.2, name)), ())
    over, *row = tabulated_row(name, p)
    assert over == (2.0 if name == "tabulated.position" else 1.0)
    first = track.q if name == "tabulated.position" else track.v
    rows = zip(first[::7], track.q[::7], strict=True)
    expected = [tabulated(np.array(row), np.uint64(0), np.uint64(1), x, y)[0] for x, y in rows]
    np.testing.assert_allclose(TABLES[name].law(track, p, None)[::7], expected, atol=1e-9)


def test_over_two_variables_in_the_forward_form_a_plane_is_a_drag_and_a_spring(tmp_path: Path) -> None:
    given = made(tmp_path, 0.5 + 0.2 * np.sin(3.0 * T), PENDULUM)
    model = given.model
    middle, places = model.scales[0].middle, np.linspace(-9.0, 9.0, 5)
    plane = (0.02 * places[:, None] + 0.3 * places).ravel()
    ends = {"low": -9.0, "high": 9.0, "low_2": middle - 9.0, "high_2": middle + 9.0}
    table = Hypothesis(PAIR, (), {**ends, **dict(zip(grid_names("force", (5, 5)), plane.tolist(), strict=True))})
    both = together(*(model.hypotheses()[law][0] for law in ("friction.viscous", "spring.linear")))
    start, zero = np.array([0.3, 0.0]), np.zeros(len(model.parameters))
    expected = run_plain(model, both, np.concatenate([zero, both.coordinates([0.02, 0.3])]), start)
    np.testing.assert_allclose(run_plain(model, table, zero, start), expected, atol=1e-7)
    assert np.abs(expected - run_plain(model, NONE, zero, start)).max() > 1e-2


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
    assert [form.hypothesis.name for form in given.forms()] == ["tabulated.speed", "tabulated.position", PAIR]


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("tabulated.speed", {"low": 3.0}, "high must be above low, 3"),
        ("tabulated.speed", {"force_10": 1.0}, "force_10"),
        ("tabulated.speed", {"force_9": None}, "force_9"),
        (PAIR, {"low_2": 3.0}, "speed_position.high_2 must be above low_2, 3"),
        (PAIR, {"force_5_6": 1.0}, "force_5_6"),
        (PAIR, {"high_2": None}, "high_2"),
    ],
)
def test_a_broken_table_is_refused(name: str, change: dict, said: str, tmp_path: Path) -> None:
    values = {key: value for key, value in {**_fixed(-0.3, 0.2, name), **change}.items() if value is not None}
    machine = {"drive": "my_drive.py", "effects": {name: values}}
    with pytest.raises(ParameterError, match=said):
        subject_of(drive(tmp_path, ONE), [record(_dragging)], machine)
