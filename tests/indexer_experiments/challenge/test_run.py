"""A challenge is resumed case by case, and its short version gives the right answers."""

import json
import os

import pyarrow.parquet
import pytest
import yaml

import indexer_experiments.challenge.case as case_module
from indexer_cli.places.base import StoreError
from indexer_env.errors import ParameterError, SimulationError
from indexer_experiments.challenge import run
from indexer_experiments.challenge.case import solve_case
from indexer_experiments.challenge.draw import HIDDEN, Order
from indexer_experiments.challenge.records import write_records
from indexer_experiments.challenge.score import summary


def answered(order: Order, number: int) -> dict:
    """A case as it would come out, without the search."""
    hidden = [{"name": "friction.viscous"}] if order.kind == "single" else []
    return {
        "case": number, "kind": order.kind, "play": order.play, "hidden": hidden, "verdict": "none", "names": [],
        "outcome": "right", "gap": 1.0, "closed_share": None, "cpu_s": 1.0, "wall_s": 1.0, "truth_s": 1.0,
        "intervals": [], "found": [],
    }  # fmt: skip


def test_only_cases_without_a_file_are_solved(tmp_path, monkeypatch) -> None:
    solved = []

    def solve(order: Order, number: int) -> dict:
        solved.append(number)
        return answered(order, number)

    monkeypatch.setattr(run, "solve_case", solve)
    run.run_challenge([Order(2, 5, "none")], tmp_path)
    table = run.run_challenge([Order(4, 5, "none")], tmp_path)
    assert solved == [0, 1, 2, 3]
    assert "| none | healthy | all | 4 | 4 (100 %) |" in table
    assert (tmp_path / "table.md").read_text() == table
    assert pyarrow.parquet.read_table(tmp_path / "cases.parquet").num_rows == 4
    assert len(list((tmp_path / "cases").glob("*.json"))) == 4
    assert json.loads(next(iter((tmp_path / "cases").glob("*0003.json"))).read_text())["case"] == 3


def test_other_sizes_are_other_cases(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(run, "solve_case", answered)
    run.run_challenge([Order(1, 5, gap=(1.0, 3.0))], tmp_path)
    run.run_challenge([Order(1, 5, gap=(3.0, 10.0))], tmp_path)
    assert len(list((tmp_path / "cases").glob("*.json"))) == 2


def test_other_lengths_are_other_cases(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(run, "solve_case", answered)
    for turns in (1.2, 5.0):
        run.run_challenge([Order(1, 5, turns=turns)], tmp_path)
    assert len(list((tmp_path / "cases").glob("*.json"))) == 2


@pytest.mark.parametrize("text", ["{}", "[]", "", '{"kind": "single"}'])
def test_a_file_that_is_no_answer_is_named_before_any_work(tmp_path, monkeypatch, text: str) -> None:
    monkeypatch.setattr(run, "solve_case", None)
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "x.json").write_text(text)
    for orders in ([Order(1, 5)], []):
        with pytest.raises(ParameterError, match=r"are answers of a challenge, got '.*x\.json'; take that file out"):
            run.run_challenge(orders, tmp_path)


def test_a_folder_of_something_else_is_left_alone(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(run, "solve_case", None)
    (tmp_path / "table.md").write_text("mine")
    with pytest.raises(ParameterError, match=r"must be a new folder, or one of a challenge, got .*; it holds other"):
        run.run_challenge([Order(1, 5)], tmp_path)
    with pytest.raises(StoreError, match=r"out must be a folder, got .*table\.md"):
        run.run_challenge([Order(1, 5)], tmp_path / "table.md")
    assert (tmp_path / "table.md").read_text() == "mine"


def test_a_case_that_cannot_be_made_keeps_no_other_from_its_answer(tmp_path, monkeypatch) -> None:
    def solve(order: Order, number: int) -> dict:
        if number == 1:
            raise SimulationError("reference left the physical range.")
        return answered(order, number)

    monkeypatch.setattr(run, "solve_case", solve)
    with pytest.raises(SimulationError, match=r"^1 of 3 cases have no answer, the first by this: Case 1 .* range\.$"):
        run.run_challenge([Order(3, 5, "none")], tmp_path)
    assert "| none | healthy | all | 2 | 2 (100 %) |" in (tmp_path / "table.md").read_text()


def test_the_reason_is_told_where_no_case_could_be_made(tmp_path, monkeypatch) -> None:
    def failing(order: Order, number: int) -> dict:
        raise SimulationError("Case 0 leaves its range.")

    monkeypatch.setattr(run, "solve_case", failing)
    with pytest.raises(SimulationError, match=r"^1 of 1 cases have no answer, the first by this: Case 0"):
        run.run_challenge((Order(1, 3),), tmp_path)


def test_the_table_of_a_folder_without_cases_is_refused(tmp_path) -> None:
    with pytest.raises(ParameterError, match=r"challenge\.out must be a folder with solved cases, got"):
        run.run_challenge([], tmp_path / "nothing")
    assert not (tmp_path / "nothing").exists()


def test_records_that_the_checks_refuse_are_an_answer(monkeypatch) -> None:
    """Seed 3: records whose stated speed is 5 % off are refused by the command's own checks, and counted so."""

    def written(drawn, turns, folder) -> None:
        write_records(drawn, turns, folder)
        table = folder / "records.yaml"
        rows = yaml.safe_load(table.read_text())
        table.write_text(yaml.safe_dump([{**r, "motor_speed_rpm": 1.05 * r["motor_speed_rpm"]} for r in rows]))

    monkeypatch.setattr(case_module, "write_records", written)
    case = solve_case(Order(1, 3, turns=0.7), 0)
    assert (case["outcome"], case["verdict"], case["names"]) == ("refused", "turned away", [])
    assert "record_0.csv: the motor speed must be that of the record" in case["reason"]
    assert "1 | 0 (0 %)" in summary([case])


def test_an_address_without_a_cluster_is_refused(tmp_path) -> None:
    with pytest.raises(ParameterError, match=r"challenge\.address must be left out with executor=local"):
        run.run_challenge([Order(1, 5)], tmp_path, address="local")


def test_a_number_of_processes_for_a_cluster_is_refused(tmp_path) -> None:
    with pytest.raises(ParameterError, match=r"challenge\.processes must be 1 with executor=ray, got 4"):
        run.run_challenge([Order(1, 5)], tmp_path, "ray", 4)


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        pytest.param("none", 0, id="none", marks=pytest.mark.slow),
        pytest.param("single", list(HIDDEN).index("sensor.gain"), id="sensor.gain"),
    ],
)
def test_short_challenge(kind: str, number: int) -> None:
    """Seed 3, 0.7 table turns a record, a gap of about 5: records through files, searched, scored, with intervals."""
    case = solve_case(Order(30, 3, kind, gap=(5.0, 5.0), turns=0.7), number)
    assert case["outcome"] == "right", case["reason"]
    if kind == "single":
        (name, truth, value, low, high), *_ = case["intervals"]
        assert name == "sensor.gain.error"
        assert value == pytest.approx(truth, rel=0.2)
        assert low < value < high


@pytest.mark.slow
@pytest.mark.parametrize(
    ("play", "number", "name", "alike"),
    [
        ("none", 9, "cam.profile_error", ["cam.profile_error"]),
        ("5", 7, "drive.transmission_error", ["drive.speed_ripple", "drive.transmission_error"]),
    ],
)
def test_what_the_first_look_misses_is_found(play: str, number: int, name: str, alike: list[str]) -> None:
    """Seed 900. The height of a profile error looks alike with the other sign beside it; a transmission error shakes
    the cam in its play, so the linearisation ranks it last but five, and a ripple of its order is the same motion."""
    case = solve_case(Order(88, 900, "single", play, gap=(3.0, 10.0)), number)
    # of equal motions either may be told first
    assert len(case["names"]) == 1 and case["names"][0] in (name, *alike) and case["alike"] == alike, case["reason"]
    assert case["outcome"] == ("ambiguous" if len(alike) > 1 else "right")


def test_processes_give_every_answer() -> None:
    assert sorted(run.side_by_side(2, abs, [-3, -2, -1])) == [1, 2, 3]


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="the system does not let a process choose its core")
def test_each_process_keeps_to_one_core() -> None:
    assert set(run.side_by_side(2, core_count, [0, 1, 2])) == {1}


def core_count(_: int) -> int:
    return len(os.sched_getaffinity(0))


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_cases_on_a_cluster_get_the_same_answers(tmp_path) -> None:
    """Seed 3, two cases with nothing hidden, on a cluster of one core: all but the times is as in this process."""
    ray = pytest.importorskip("ray", reason="needs the extra [ray]")
    order = Order(2, 3, "none", turns=0.7)
    ray.init("local", num_cpus=1, include_dashboard=False, log_to_driver=False)
    try:
        run.run_challenge([order], tmp_path / "ray", "ray")
    finally:
        ray.shutdown()
    run.run_challenge([order], tmp_path / "local")
    there, here = (
        [json.loads(path.read_text()) for path in sorted((tmp_path / where / "cases").glob("*.json"))]
        for where in ("ray", "local")
    )
    assert len(there) == 2
    for case in (*there, *here):
        for name in ("truth_s", "cpu_s", "wall_s"):
            assert case.pop(name) > 0.0
    assert there == here
