"""The mathematics behind the benchmarks' numbers, and one short run; no test asserts a time."""

from __future__ import annotations

import dataclasses
import json
import math
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import torch

from benchmarks import accuracy, cases, data_sets, measures, peers, processes, references, report
from benchmarks.peers import lane_peer, model_b, scipy_peer
from benchmarks.picture import best
from benchmarks.work_precision import Point
from classifier.trainers import TRAINERS
from indexer_env import Joint, OperatingPoint, ParameterError


def test_observed_order_is_the_slope_of_a_power_law() -> None:
    steps = np.array([1e-3, 5e-4, 1e-4])
    assert measures.observed_order(steps, 7.0 * steps**4) == pytest.approx(4.0, abs=1e-9)
    assert measures.observed_order(steps, 0.2 * steps) == pytest.approx(1.0, abs=1e-9)


def test_relative_rms_of_scaled_and_of_equal_records() -> None:
    records = np.random.default_rng(0).normal(size=(2, 50))
    errors = measures.relative_rms(np.stack([1.01 * records[0], records[1]]), records)
    assert errors == pytest.approx([0.01, 0.0], abs=1e-12)


def test_level_difference_of_a_doubled_power_is_3_db() -> None:
    density = np.array([[1.0, 3.0]])
    assert measures.level_difference(2.0 * density, density) == pytest.approx(10.0 * math.log10(2.0))
    assert measures.level_difference(density, 2.0 * density) == pytest.approx(-10.0 * math.log10(2.0))


def test_energies_of_a_state_worked_by_hand() -> None:
    """In the dwell (β' = 0) each term stands alone."""
    machine = dataclasses.replace(
        cases.free(),
        cam_inertia=2.0, follower_inertia=3.0, table_inertia=5.0, housing_inertia=7.0,
        output_joint=Joint(11.0, 0.0), base_joint=Joint(13.0, 0.0),
    )  # fmt: skip
    channels = {
        "cam_angle": 1.5 * math.pi, "cam_rate": 2.0, "table_rate": 0.5, "housing_rate": 0.1,
        "deflection_1": 0.0, "deflection_2": 0.2, "deflection_3": 0.3, "region_1": 0.0,
    }  # fmt: skip
    total, cam = measures.energies(machine, {name: np.array([value]) for name, value in channels.items()})
    kinetic = 0.5 * (2.0 * 2.0**2 + 3.0 * 0.1**2 + 5.0 * 0.5**2 + 7.0 * 0.1**2)
    assert cam == pytest.approx([4.0])
    assert total == pytest.approx([kinetic + 0.5 * (11.0 * 0.2**2 + 13.0 * 0.3**2)])


def test_energies_count_the_follower_on_the_moving_cam() -> None:
    machine = cases.free()
    zero = dict.fromkeys(measures.ENERGY_CHANNELS, np.zeros(1))
    middle = {**zero, "cam_angle": np.array([0.5 * math.pi]), "cam_rate": np.ones(1)}
    slope = 1.759603 * (2.0 * math.pi / 8) / math.pi  # Cv h / (2 π f)
    total, cam = measures.energies(machine, middle)
    assert total - cam == pytest.approx([0.5 * machine.follower_inertia * slope**2], rel=1e-5)


def test_draws_do_not_depend_on_their_number_and_keep_the_play() -> None:
    few, many = cases.draws(2), cases.draws(5)
    assert few == many[:2]
    assert len({machine.output_joint.stiffness for machine in many}) == 5
    for machine in many:
        assert (machine.input_joint.backlash, machine.output_joint.backlash) == (13.6e-3, 1.0e-3)
        for drawn, nominal in zip(
            (machine.input_joint, machine.output_joint),
            (cases.smooth().input_joint, cases.smooth().output_joint),
            strict=True,
        ):
            assert drawn.stiffness == pytest.approx(nominal.stiffness, rel=0.1)
            assert drawn.damping == pytest.approx(nominal.damping, rel=0.1)


def test_a_peer_refuses_a_machine_it_does_not_know() -> None:
    with pytest.raises(ParameterError, match="clipped play only, got 'smooth'"):
        peers.parameters(cases.smooth(), OperatingPoint())
    with pytest.raises(ParameterError, match=r"start at cam angle 0 rad, got 0\.5"):
        peers.parameters(cases.with_play(), OperatingPoint(start_angle=0.5))


def test_the_peers_law_is_the_simulators() -> None:
    """Four turns' worth of angles with all junctions, before and after zero."""
    law, angles = cases.smooth().motion_law, np.linspace(-2.0 * math.pi, 6.0 * math.pi, 257)
    mine = np.array([model_b.law(angle, 2.0 * math.pi / 8, 0.5) for angle in angles]).T
    np.testing.assert_allclose(mine, law.evaluate(angles, 8, 0.5), atol=1e-13)


def test_the_plain_rk4_in_lanes_is_the_plain_one() -> None:
    """Beyond one block of lanes, with the first contacts of both joints; both end as rounding and the sine do."""
    p = np.stack([peers.parameters(machine, cases.OPERATING_POINT) for machine in cases.draws(lane_peer.LANES + 2)])
    lanes = lane_peer.records(p, 1000.0, 120, 2)
    for index in (0, lane_peer.LANES + 1):
        alone = model_b.plain_rk4(p[index], peers.start(p[index]), 1000.0, 120, 2)
        np.testing.assert_allclose(lanes[index], alone, rtol=0, atol=1e-9 * np.abs(alone).max())
    assert np.abs(lanes[0] - lanes[1]).max() > 1e-3


@pytest.mark.slow
def test_smoke_the_simulator_and_its_peers_agree() -> None:
    """Two independent implementations, and the order of the simulator, in a short run."""
    machine = cases.with_play()
    p = peers.parameters(machine, cases.OPERATING_POINT)
    own = accuracy.accelerations([machine], 150)[0]
    assert measures.relative_rms(model_b.plain_rk4(p, peers.start(p), 1000.0, 150, 64), own) < 1e-3
    exact = scipy_peer.record(p, 1000.0, 150, method="DOP853", rtol=1e-9, max_step=5e-4)
    assert measures.relative_rms(exact, own) < 1e-4
    errors = accuracy.order_errors(accuracy.ORDER_STEPS[:2], accuracy.fine_record())
    assert measures.observed_order(accuracy.ORDER_STEPS[:2], errors) == pytest.approx(4.2, abs=0.4)
    assert accuracy.energy().met


def test_reference_records_are_kept_by_machine_and_source(monkeypatch, tmp_path) -> None:
    """A second call reads the file; another machine, length or source text has another name."""
    monkeypatch.setattr(references, "CACHE", tmp_path)
    calls = []

    class Here:
        """A pool that computes where it stands."""

        def __init__(self, *_: object, **__: object) -> None: ...
        def __enter__(self) -> Here:
            return self

        def __exit__(self, *_: object) -> None: ...
        def submit(self, _: object, machine: object, *arguments: object):
            from concurrent.futures import Future

            calls.append(machine)
            future: Future = Future()
            future.set_result(np.arange(3.0) + len(calls))
            return future

    monkeypatch.setattr(references, "ProcessPoolExecutor", Here)
    machines = cases.draws(2)
    first = references.reference_records(machines, cases.OPERATING_POINT, samples=3)
    again = references.reference_records(machines[::-1], cases.OPERATING_POINT, samples=3)
    assert calls == machines
    np.testing.assert_array_equal(first[::-1], again)
    references.reference_records(machines[:1], cases.OPERATING_POINT, samples=4)
    assert len(calls) == 3
    monkeypatch.setattr(references, "_source_digest", lambda: "another")
    references.reference_records(machines[:1], cases.OPERATING_POINT, samples=3)
    assert len(calls) == 4


def test_best_settings_are_those_that_none_beats() -> None:
    points = [Point("s", name, error, time) for name, error, time in
              (("slow", 1e-6, 3.0), ("fast", 1e-2, 1.0), ("worse", 1e-3, 4.0), ("middle", 1e-4, 2.0))]  # fmt: skip
    assert [point.setting for point in best(points)] == ["fast", "middle", "slow"]


def test_the_table_replaces_what_stands_between_its_markers() -> None:
    text = f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n"
    assert report.with_table(text, "new") == f"before\n{report.BEGIN}\nnew\n{report.END}\nafter\n"
    with pytest.raises(ValueError, match="must hold the markers"):
        report.with_table("no markers", "new")


def test_a_stored_section_replaces_only_itself(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(report, "RESULTS", tmp_path / "results.json")
    monkeypatch.setattr(report, "README", tmp_path / "README.md")
    report.README.write_text(f"{report.BEGIN}\n{report.END}\n")
    session = dict.fromkeys(("processor", "cores", "versions", "date", "load"), "x")
    report.store("speed", [report.Row("turns", "≥ 2", "1", False)], session)
    report.store("accuracy", [report.Row("order", "4", "4", True), report.Row("seen", "", "5")], session)
    report.store("speed", [report.Row("turns", "≥ 2", "3", True), report.Row("scan", "≥ 10", "none")], session)
    table = report.README.read_text()
    assert (
        "| order | 4 | 4 | met |\n| seen |  | 5 |  |\n| turns | ≥ 2 | 3 | met |\n| scan | ≥ 10 | none | not measured |"
        in table
    )
    assert list(json.loads(report.RESULTS.read_text())) == ["accuracy", "speed"]
    later, rows = session | {"date": "y"}, [report.Row("order", "4", "3", False), report.Row("other", "", "6")]
    report.store("accuracy", rows, later, part=True)
    stored = json.loads(report.RESULTS.read_text())["accuracy"]
    assert stored["session"] == session
    found = [(row["what"], row["measured"], row.get("session")) for row in stored["rows"]]
    assert found == [("order", "3", later), ("seen", "5", None), ("other", "6", later)]
    assert "- accuracy: x, x" in report.README.read_text()
    assert "- of accuracy, order; other: y, x" in report.README.read_text()


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.0123, "0.0123"), (3.14159, "3.14"), (2345.6, "2\u2009346"), (4.2e-8, "4.2e-8"), (1e6, "1.0e6")],
)
def test_numbers_are_short(value: float, text: str) -> None:
    assert report.number(value) == text


def test_a_child_tells_its_own_memory_and_messages() -> None:
    """The memory of the process that measures, here 200 MB more, is not counted."""
    held = b"x" * 200_000_000
    done = processes.child(["-c", "import sys; x = b'x' * 200_000_000; print('out'); print('err', file=sys.stderr)"])
    small = processes.child(["-c", "print('out')"])
    assert (done.output, done.messages) == ("out\n", "err\n")
    assert small.peak_memory < len(held)
    assert done.peak_memory - small.peak_memory > 150_000_000
    with pytest.raises(ChildProcessError, match="ended with code 1: ValueError: broken"):
        processes.child(["-c", "raise ValueError('broken')"])


def test_the_readme_holds_the_table_of_the_results() -> None:
    """What is committed was written by one run of the command."""
    results = json.loads(report.RESULTS.read_text(encoding="utf-8"))
    text = report.README.read_text(encoding="utf-8")
    assert report.with_table(text, report.markdown(results)) == text


@pytest.mark.slow
def test_smoke_the_data_set_section_measures_all_its_rows() -> None:
    rows = data_sets.measure(quick=True)
    assert len(rows) == 6 and all(row.met is not None for row in rows[:5])
    assert rows[4].numbers["best_bytes"] < rows[4].numbers["bytes"] < 12_000


def test_importing_the_benchmarks_loads_no_optional_peer() -> None:
    from benchmarks import accuracy, speed, work_precision  # noqa: F401

    assert {"jax", "diffrax", "sksundae"}.isdisjoint(sys.modules)


def test_training_one_after_the_other_is_the_same_training() -> None:
    """The loop that speed is compared with ends where the stack ends; seeds 0 and 3."""
    from benchmarks import natural
    from classifier.network import Mlp
    from classifier.trainers import Examples
    from classifier.trainers.traingdx import TrainGdx

    generator = torch.Generator().manual_seed(3)
    x = torch.rand(40, 5, generator=generator, dtype=torch.float64)
    t = (x[:, :1] > 0.5).double()
    network, calibration, control = Mlp(5, 4, 1), Examples(x[:20], t[:20]), Examples(x[20:], t[20:])
    start = network.initial(3, torch.Generator().manual_seed(0))
    for rule in (TrainGdx(rate=0.5, epochs=150, patience=10), TrainGdx(minimum_gradient=0.05)):
        training = rule.train(network, start, calibration, control)
        for i, one in enumerate(start):
            epochs, lowest = natural.train(network, one, calibration, control, rule)
            assert epochs == training.epochs[i]
            assert lowest == pytest.approx(np.nanmin(training.control_error[:, i]), rel=1e-9)


def test_smoke_the_section_of_diagnosing() -> None:
    from benchmarks import diagnosing

    (row,) = diagnosing.measure(quick=True)
    assert "8200 samples" in row.what and row.numbers["whole"]["processor_s"] > row.numbers["diagnosis"]["processor_s"]


@pytest.mark.slow
def test_smoke_the_section_of_training() -> None:
    from benchmarks import training

    threads = torch.get_num_threads()
    rows = training.measure(quick=True)
    assert torch.get_num_threads() == threads
    assert [row.required for row in rows] == ["≤ 20 s", "≥ 30 × per core", "≥ 30 × per core", "", "≤ 600 s", "≤ 5 s"]
    assert set(rows[3].numbers["rules"]) == set(TRAINERS)
    assert all(taken["epochs"] > 0 for taken in rows[3].numbers["rules"].values())


def test_the_page_on_data_sets_holds_the_table_of_the_results() -> None:
    from benchmarks import parquet

    results = json.loads(report.RESULTS.read_text(encoding="utf-8"))
    rows = [report.Row(**values) for values in results["parquet"]["rows"]]
    text = parquet.PAGE.read_text(encoding="utf-8")
    assert report.with_table(text, parquet.page_table(rows)) == text
    assert str(parquet.CHOSEN) == "plain list, byte-stream split, zstd 1, row groups of 256"


def test_ways_to_store_records_are_written_as_they_say() -> None:
    """The chosen way is that of the shards; a fixed-size list comes back as one."""
    from benchmarks import parquet

    records = np.arange(24, dtype=np.float32).reshape(3, 8)
    kind = pa.list_(pa.field("element", pa.float32(), nullable=False))
    table = pa.table({"record": pa.array(list(records), kind), "item": pa.array([0, 1, 2])})
    _, content = parquet._write(parquet._with_lists(table, "fixed-size"), parquet.Way(group=2))
    with pq.ParquetFile(pa.BufferReader(content)) as file:
        column = file.metadata.row_group(0).column(0)
        assert file.num_row_groups == 2 and column.compression == "ZSTD" and "BYTE_STREAM_SPLIT" in column.encodings
        assert pa.types.is_fixed_size_list(file.schema_arrow.field("record").type)
