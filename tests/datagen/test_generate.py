"""A data set on disk: complete, reproducible row by row, whole or absent, and honest about rejected items."""

from __future__ import annotations

import csv
import hashlib
import json
from dataclasses import replace

import numpy as np
import pyarrow.dataset
import pyarrow.parquet as pq
import pytest

from datagen.campaign import build
from datagen.campaigns import make_campaign
from datagen.campaigns.table2 import Table2
from datagen.generate import generate, head
from datagen.publish import publish
from datagen.remake import remake
from datagen.rows import machine_columns, machine_of
from datagen.shard import read_shards
from datagen.store import State, StoreError, making
from indexer_cli.places import open_place
from indexer_env.effects import make_effect
from indexer_env.errors import ParameterError
from indexer_env.faults import Faults
from indexer_env.motion_law import motion_law
from indexer_env.sensors import Sensor
from indexer_records.measured import read_signal


class _AlwaysImpossible(Table2):
    """Table 2 with a stiffness that no joint can have."""

    def draw(self, index, base, rng):
        item = super().draw(index, base, rng)
        return replace(item, machine={**item.machine, "output_joint.stiffness": -1.0})


class _FirstImpossible(Table2):
    """Table 2, item 0 with a stiffness that no joint can have."""

    def draw(self, index, base, rng):
        item = super().draw(index, base, rng)
        changes = {**item.machine, "output_joint.stiffness": -1.0} if index == 0 else item.machine
        return replace(item, machine=changes)


class _OneTooStiff(Table2):
    """Table 2, item 1 so stiff that the step cannot resolve it."""

    def draw(self, index, base, rng):
        item = super().draw(index, base, rng)
        changes = {**item.machine, "output_joint.stiffness": 1e12} if index == 1 else item.machine
        return replace(item, machine=changes)


def contents(folder) -> dict[str, str]:
    """Every file's checksum but those of run.json and the card, which hold times."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in ("run.json", "README.md"))
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_read_back_all_items_in_order(dataset, order):
    data = read_shards(dataset)
    assert data.records.shape == (20, 300) and data.records.dtype == np.float32
    assert np.isfinite(data.records).all() and data.records.std(axis=1).min() > 0
    assert data.table.column("item").to_pylist() == list(range(20))
    assert set(data.table.column("seed").to_pylist()) == {3}
    assert set(data.table.column("unit").to_pylist()) == {"m/s^2"}
    assert set(data.table.column("sample_rate").to_pylist()) == {1000.0}
    assert "record" not in data.table.column_names
    assert len(data.subset("control")) == data.table.column("subset").to_pylist().count("control") == 6
    assert set(data.subset("control").table.column("subset").to_pylist()) == {"control"}


def test_rows_hold_the_item_s_own_machine(dataset, order):
    data = read_shards(dataset)
    for index in range(len(data)):
        case = build(order.campaign.item(index, order.base, order.seed), order.base)
        row = data.row(index)
        assert machine_of(row) == case.machine
        assert {name: row[f"fault_{name}"] for name in vars(case.faults)} == vars(case.faults)
        assert (row["class"], row["code"], row["subset"]) == (
            case.item.label.number, case.item.label.code, case.item.label.subset
        )  # fmt: skip


def test_machine_with_every_shape_of_parameter_survives_the_columns(base):
    share = [min(1.0, k / 18) for k in range(37)]
    rise = [s**3 * (10 - 15 * s + 6 * s**2) for s in share]
    law = motion_law({
        "name": "table",
        "cam_angle_deg": [10.0 * k for k in range(37)],
        "follower_angle_deg": [45.0 * y for y in rise],
    })  # fmt: skip
    machine = replace(base.machine, motion_law=law, name="mine")
    effects = [
        make_effect("friction.coulomb", torque=3.0),
        *Faults(roller_crack=0.3, backlash=0.1).effects(machine),
    ]
    machine = machine.with_effects(*effects)
    assert machine_of(machine_columns(machine)) == machine


def test_former_names_of_an_effect_s_parameters_are_read(base):
    """Data sets written when the backlash of an effect was called play, and a crack's loss of stiffness severity."""
    machine = base.machine.with_effects(
        make_effect("output.backlash", backlash=1e-3),
        make_effect("base.looseness", compliance=1e-6, backlash=2e-3),
        *Faults(roller_crack=0.3, backlash=0.1).effects(base.machine),
        *Faults(roller_crack=0.2, cracked_station=3).effects(base.machine),
    )
    row = machine_columns(machine)
    former = row["effects"].replace('"backlash":', '"play":').replace('"stiffness_loss":', '"severity":')
    assert former.count('"play"') == 3 and former.count('"severity"') == 2
    assert machine_of({**row, "effects": former}) == machine


def test_any_row_is_made_again_bit_for_bit(dataset):
    data = read_shards(dataset)
    for index in (0, 7, 8, 19):
        np.testing.assert_array_equal(remake(data.row(index)), data.records[index])


def test_another_item_s_columns_give_another_record(dataset):
    data = read_shards(dataset)
    assert not np.array_equal(remake(data.row(5)), data.records[11])


def test_same_order_same_bytes_whatever_the_shards(dataset, order, tmp_path):
    generate(order, tmp_path / "again")
    assert contents(tmp_path / "again") == contents(dataset)
    generate(replace(order, shard_items=5, count=13), tmp_path / "other")
    np.testing.assert_array_equal(read_shards(tmp_path / "other").records, read_shards(dataset).records[:13])
    assert len(list((tmp_path / "other" / "data").iterdir())) == 3


def test_another_seed_differs_in_every_record(dataset, order, tmp_path):
    generate(replace(order, seed=4), tmp_path / "seed4")
    a, b = read_shards(dataset).records, read_shards(tmp_path / "seed4").records
    assert (np.abs(a - b).max(axis=1) > 0).all()


def test_manifest_counts_and_checksums(dataset, order):
    manifest = json.loads((dataset / "manifest.json").read_text())
    assert (manifest["count"], manifest["records"], manifest["rejected"]) == (20, 20, 0)
    assert list(manifest["classes"].values()) == [4, 4, 3, 3, 3, 3]
    assert manifest["subsets"] == {"calibration": 8, "control": 6, "validation": 6}
    assert manifest["config"] == {"note": "test"}
    assert [entry["rows"] for entry in manifest["shards"]] == [8, 8, 4]
    for entry in manifest["shards"]:
        content = (dataset / entry["name"]).read_bytes()
        assert (len(content), hashlib.sha256(content).hexdigest()) == (entry["bytes"], entry["sha256"])
    assert not list(dataset.rglob("*.part")) and not (dataset / "unfinished").exists()


def test_example_is_a_logger_s_file_with_its_truth(dataset, order):
    truth = json.loads((dataset / "example.json").read_text())
    assert (truth["class"], truth["code"]) == (6, "11100")
    signal = read_signal(dataset / "example.csv", expected_rate=1000.0, expected_duration=0.3)
    assert signal.unit == "m/s^2" and len(signal.values) == 300
    with (dataset / "example.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["time [s]", "acceleration [m/s^2]"] and len(rows) == 301
    stiffnesses = read_shards(dataset).table.column("output_joint_stiffness").to_pylist()
    assert truth["output_joint_stiffness"] not in stiffnesses


def test_arrow_opens_the_folder_of_shards(dataset):
    table = pyarrow.dataset.dataset(dataset / "data").to_table(columns=["item", "record"])
    assert table.num_rows == 20 and len(table.column("record")[19]) == 300


def test_rejected_items_are_recorded_with_reason_and_the_others_live(order, settings, tmp_path):
    settings["draws"]["machine"]["output_joint"]["stiffness"]["around"] = 1.5
    wild = replace(order, campaign=make_campaign(settings), count=40)
    manifest = generate(wild, tmp_path / "wild")
    rejected = pq.read_table(tmp_path / "wild" / "rejected.parquet").to_pylist()
    assert manifest["rejected"] == len(rejected) > 0 and manifest["records"] == 40 - len(rejected) > 0
    publish(open_place(tmp_path / "wild"), tmp_path / "hub")
    assert pq.read_table(tmp_path / "hub" / "rejected.parquet").to_pylist() == rejected
    assert f"{len(rejected)} of 40 items have no record" in (tmp_path / "hub" / "README.md").read_text()
    kept = read_shards(tmp_path / "wild").table.column("item").to_pylist()
    assert sorted(kept + [row["item"] for row in rejected]) == list(range(40))
    assert all(row["reason"].endswith(".") and row["stage"] in ("machine", "simulation") for row in rejected)
    impossible = [row for row in rejected if row["stage"] == "machine"]
    assert impossible and all(json.loads(row["draws"])["machine"]["output_joint.stiffness"] <= 0 for row in impossible)


def test_an_item_that_cannot_be_simulated_is_recorded_and_its_neighbours_are_unchanged(order, settings, tmp_path):
    stiff = _OneTooStiff(**{key: value for key, value in settings.items() if key != "name"})
    generate(replace(order, campaign=stiff, count=4), tmp_path / "stiff")
    generate(replace(order, count=4), tmp_path / "plain")
    (row,) = pq.read_table(tmp_path / "stiff" / "rejected.parquet").to_pylist()
    assert (row["item"], row["stage"], row["class"]) == (1, "simulation", 2)
    assert "step" in row["reason"] and row["reason"].endswith(".")
    records = read_shards(tmp_path / "plain").records
    np.testing.assert_array_equal(read_shards(tmp_path / "stiff").records, records[[0, 2, 3]])


def test_an_order_without_a_record_is_refused_with_a_reason(order, settings, tmp_path):
    broken = replace(order, campaign=_AlwaysImpossible(**{k: v for k, v in settings.items() if k != "name"}), count=3)
    with pytest.raises(ParameterError, match=r"got none of 3; item 0: .*stiffness must be"):
        generate(replace(broken, shard_items=1), tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_a_first_shard_without_a_record_does_not_stop_the_others(order, settings, tmp_path):
    late = _FirstImpossible(**{key: value for key, value in settings.items() if key != "name"})
    manifest = generate(replace(order, campaign=late, count=3, shard_items=1), tmp_path / "late")
    assert (manifest["records"], manifest["rejected"]) == (2, 1)
    assert pq.read_table(tmp_path / "late" / "rejected.parquet").column("item").to_pylist() == [0]


def test_two_runs_into_one_folder(tiny, tmp_path):
    folder = tmp_path / "set"
    with making(folder, head(tiny), overwrite=False), pytest.raises(StoreError, match="no other run is writing to"):
        generate(tiny, folder, overwrite=True)
    generate(tiny, folder, overwrite=True)
    assert len(read_shards(folder)) == 3


def test_a_folder_that_was_filled_meanwhile_is_left_alone(tiny, tmp_path, monkeypatch):
    folder = tmp_path / "set"
    generate(tiny, folder)
    before = contents(folder)
    monkeypatch.setattr("datagen.generate.standing", lambda *_: State.FREE)
    with pytest.raises(StoreError, match="overwrite=true"):
        generate(replace(tiny, seed=9), folder)
    assert contents(folder) == before


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_foreign_folder_is_left_untouched(tiny, tmp_path, overwrite):
    (tmp_path / "thesis.txt").write_text("years of work")
    before = contents(tmp_path)
    with pytest.raises(StoreError):
        generate(tiny, tmp_path, overwrite=overwrite)
    assert contents(tmp_path) == before


def test_a_data_set_is_replaced_only_when_asked_and_only_if_pure(tiny, tmp_path):
    folder = tmp_path / "set"
    generate(tiny, folder)
    before = contents(folder)
    with pytest.raises(StoreError, match="overwrite=true"):
        generate(replace(tiny, seed=9), folder)
    assert contents(folder) == before
    generate(replace(tiny, seed=9, count=2, shard_items=1), folder, overwrite=True)
    assert read_shards(folder).table.column("seed").to_pylist() == [9, 9]
    (folder / "notes.txt").write_text("mine")
    before = contents(folder)
    with pytest.raises(StoreError, match=r"notes\.txt"):
        generate(tiny, folder, overwrite=True)
    assert contents(folder) == before


def test_an_order_that_cannot_be_carried_out_leaves_the_folder_as_it_was(tiny, tmp_path):
    folder = tmp_path / "set"
    generate(tiny, folder)
    before = contents(folder)
    bad = replace(tiny, base=replace(tiny.base, sensor=Sensor()), run=replace(tiny.run, sample_rate=50.0, step=0.02))
    with pytest.raises(ParameterError, match="fastest mode"):
        generate(bad, folder, overwrite=True)
    assert contents(folder) == before
    with pytest.raises(ParameterError, match="fastest mode"):
        generate(bad, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_out_that_is_a_file(tiny, tmp_path):
    (tmp_path / "file").write_text("x")
    for out in ("file", "file/below"):
        with pytest.raises(StoreError, match="must be a folder"):
            generate(tiny, tmp_path / out, overwrite=True)


def test_a_sensor_that_does_not_suit_the_rate_is_refused_before_any_simulation(tiny):
    with pytest.raises(ParameterError, match="lowpass_hz must be below 500 Hz"):
        replace(tiny, base=replace(tiny.base, sensor=replace(tiny.sensor, lowpass_hz=600.0)))


def test_a_run_that_no_data_set_can_hold(tiny):
    with pytest.raises(ParameterError, match=r"run\.channels must be table_acceleration alone"):
        replace(tiny, run=replace(tiny.run, channels=("table_angle",)))
    with pytest.raises(ParameterError, match="2147483647 samples in one file"):
        replace(tiny, run=replace(tiny.run, samples=10**9))


@pytest.mark.parametrize("change", [{"count": 0}, {"count": 2.5}, {"seed": -1}, {"seed": "x"}, {"shard_items": 0}])
def test_bad_orders(tiny, change):
    with pytest.raises(ParameterError, match=f"datagen.{next(iter(change))} must be"):
        replace(tiny, **change)
