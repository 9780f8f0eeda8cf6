"""What the twin's table counts."""

from __future__ import annotations

import json

import numpy as np

from benchmarks.twin import records
from benchmarks.twin.judging import misnamed
from benchmarks.twin.records import drawn, records_of
from benchmarks.twin.table import Judged, markdown, summary
from benchmarks.twin.truth import Truth
from indexer_env import load_machine

CRACK, BOTH, NONE = frozenset({"crack"}), frozenset({"crack", "loose_base"}), frozenset()


def test_a_slight_false_name_counts_among_all_records_but_not_in_the_headline():
    found = summary([Judged(CRACK, BOTH, CRACK, False, True), Judged(CRACK, CRACK, CRACK, False, True)])
    assert found["misnamed"] == 0.5 and found["misnamed above"] == 0.0
    refused = summary([Judged(CRACK, CRACK, CRACK, True, True)])
    assert refused["misnamed"] == refused["misnamed above"] == 1.0


def test_a_healthy_record_with_a_slight_false_name_is_named_but_not_called_faulty():
    rows = [Judged(NONE, CRACK, NONE, False, True), Judged(NONE, CRACK, CRACK, False, True)]
    found = summary([*rows, Judged(NONE, NONE, NONE, True, True), Judged(NONE, NONE, NONE, False, True)])
    assert found["healthy called faulty"] == 0.5 and found["healthy named"] == 0.75


def test_physics_is_asked_about_what_is_misnamed_but_not_about_strangers():
    none = Judged(NONE, CRACK, CRACK, False, True)
    rows = [none, Judged(CRACK, CRACK, CRACK, False, True), Judged(NONE, CRACK, CRACK, False, True, left_out=True)]
    assert misnamed(["a", "b", "c"], rows) == ["a"]  # type: ignore[list-item, comparison-overlap]


def test_intervals_are_counted_in_both_groups():
    rows = [Judged(CRACK, CRACK, CRACK, False, True, (True,)), Judged(BOTH, BOTH, BOTH, False, True, (True, False))]
    found = summary(rows)
    assert (found["alone"], found["beside others"]) == (1.0, 0.5)


def test_records_of_the_stated_size_and_strangers_have_rows_of_their_own():
    rows = [
        Judged(CRACK, NONE, NONE, False, True, at_size=True), Judged(CRACK, NONE, NONE, False, True, at_size=False),
        Judged(NONE, NONE, NONE, True, True, left_out=True), Judged(NONE, NONE, NONE, False, True),
    ]  # fmt: skip
    found = summary(rows)
    assert found["detected at the stated size"] == 0.5 and found["left out refused"] == 1.0
    assert found["misnamed"] == 0.0 and found["healthy called faulty"] == 0.0
    assert "| twin | as modelled | 1 |" in markdown({("twin", "as modelled"): [rows]})


def test_strangers_are_faults_of_no_table_and_tables_of_another_make():
    truth = Truth(load_machine("reference"), "as modelled", 0.1, 1.0)
    rng = np.random.default_rng(0)
    strangers = [row for row in (drawn(truth, rng) for _ in range(300)) if row[3]]
    makes = {type(real.machine.motion_law).__name__ for real, _, effects, _ in strangers if not effects}
    assert 10 < len(strangers) < 60 and len(makes) >= 2
    assert any(effects and effects[0].name == "cam.profile_error" for _, _, effects, _ in strangers)


def test_records_are_solved_once_and_come_back_as_they_were(tmp_path, monkeypatch):
    truth, file = Truth(load_machine("reference"), "as modelled", 0.1, 1.05), tmp_path / "records.npz"
    made = records_of(truth, 2, 7, file)
    monkeypatch.setattr(records, "taken", None)
    again = records_of(truth, 2, 7, file)
    for one, other in zip(made, again, strict=True):
        np.testing.assert_array_equal(one.signal.values, other.signal.values)
        assert (one.stated, one.sizes, one.stranger) == (other.stated, other.sizes, other.stranger)
    assert len(records_of(truth, 1, 7, file)) == 1


def test_a_judged_record_comes_back_from_a_file():
    row = Judged(BOTH, CRACK, CRACK, False, True, (True, False), sizes={"crack": 0.2, "loose_base": 0.1}, cpu=0.3)
    assert Judged.restore(json.loads(json.dumps(row.plain()))) == row
