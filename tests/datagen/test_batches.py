"""Every record comes once an epoch, whatever the workers, shuffled as the seed says, with the columns asked for."""

from __future__ import annotations

import itertools
import threading
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from datagen.batches import RecordStream, RecordTable
from datagen.generate import generate
from datagen.shard import read_shards
from indexer_env.errors import ParameterError, SignalError


@pytest.fixture(scope="module")
def larger(order, tmp_path_factory):
    """97 records in 8 shards of 13 at most: no number divides another."""
    folder = tmp_path_factory.mktemp("data") / "larger"
    generate(replace(order, count=97, shard_items=13, run=replace(order.run, samples=64)), folder)
    return folder


def items(stream, workers: int = 0) -> list[list[int]]:
    return [batch["item"].tolist() for batch in DataLoader(stream, batch_size=None, num_workers=workers)]


def test_every_record_once_with_its_own_columns(larger):
    data = read_shards(larger)
    stream = RecordStream(larger, ("item", "code", "class_name", "output_joint_stiffness"), batch_size=8, window=24)
    batches = list(stream)
    assert len(batches) == len(stream) == 13
    assert [len(batch["record"]) for batch in batches] == [8] * 12 + [1]
    assert sorted(item for batch in batches for item in batch["item"].tolist()) == list(range(97))
    stiffness = data.table.column("output_joint_stiffness").to_numpy()
    codes, names = (data.table.column(name).to_pylist() for name in ("code", "class_name"))
    for batch in batches:
        places = batch["item"].numpy()
        np.testing.assert_array_equal(batch["record"].numpy(), data.records[places])
        np.testing.assert_array_equal(batch["output_joint_stiffness"].numpy(), stiffness[places])
        assert batch["code"].dtype == torch.float32 and batch["code"].shape == (len(places), 5)
        assert ["".join(str(int(bit)) for bit in row) for row in batch["code"]] == [codes[place] for place in places]
        assert batch["class_name"] == [names[place] for place in places]


@pytest.mark.filterwarnings("ignore:This DataLoader will create 3 worker processes:UserWarning")
@pytest.mark.parametrize("workers", [1, 2, 3])
def test_workers_change_the_order_of_the_batches_only(larger, workers):
    stream = RecordStream(larger, ("item",), batch_size=8, window=24, seed=5)
    assert sorted(items(stream, workers)) == sorted(items(stream))


@pytest.mark.parametrize("threads", [2, 3, 50])
def test_threads_give_the_same_batches_in_the_same_order(larger, threads):
    alone, together = (
        list(RecordStream(larger, ("item", "code"), batch_size=8, window=24, seed=5, threads=number))
        for number in (1, threads)
    )
    assert len(alone) == len(together) == 13
    for one, other in zip(alone, together, strict=True):
        assert all(torch.equal(one[name], other[name]) for name in ("item", "code", "record"))


def test_threads_end_with_a_loop_that_is_left(larger):
    batches = iter(RecordStream(larger, batch_size=8, window=8, threads=2))
    next(batches)
    assert any(thread.name.startswith("records") for thread in threading.enumerate())
    batches.close()  # pyright: ignore[reportAttributeAccessIssue]
    assert not any(thread.name.startswith("records") for thread in threading.enumerate())


def test_seed_and_epoch_decide_the_batches(larger):
    def drawn(seed: int, epoch: int) -> list[list[int]]:
        stream = RecordStream(larger, ("item",), batch_size=8, window=24, seed=seed)
        stream.set_epoch(epoch)
        return items(stream)

    assert drawn(0, 0) == drawn(0, 0)
    assert drawn(0, 0) != drawn(0, 1) and drawn(0, 0) != drawn(1, 0)
    assert sorted(itertools.chain(*drawn(0, 1))) == list(range(97))


def test_no_two_shuffles_of_an_epoch_are_drawn_alike(larger, monkeypatch):
    """Seed 3: the order of the shards and that of each window have streams of their own."""
    seeds, real = [], np.random.default_rng
    monkeypatch.setattr(np.random, "default_rng", lambda seed: seeds.append(seed) or real(seed))
    list(RecordStream(larger, ("item",), batch_size=8, window=24, seed=3, threads=1))
    assert len(seeds) == 6 and len({real(seed).random() for seed in seeds}) == 6


def test_workers_that_stay_see_the_next_epoch(larger):
    stream = RecordStream(larger, ("item",), batch_size=8, window=24)
    loader = DataLoader(stream, batch_size=None, num_workers=2, persistent_workers=True)
    epochs = []
    for epoch in range(3):
        stream.set_epoch(epoch)
        epochs.append([batch["item"].tolist() for batch in loader])
    assert all(sorted(itertools.chain(*epoch)) == list(range(97)) for epoch in epochs)
    assert sorted(epochs[0]) != sorted(epochs[1]) != sorted(epochs[2])


def test_records_of_far_apart_places_meet(larger):
    """With a window of all records, batches hold as much of every part as chance gives; without shuffling they would
    span 8 places."""
    stream = RecordStream(larger, ("item",), batch_size=8, window=104, seed=1)
    spans = [max(batch) - min(batch) for batch in items(stream)[:-1]]
    assert min(spans) > 30


def test_a_batch_keeps_its_values_when_the_next_comes(larger):
    batches = iter(RecordStream(larger, ("item",), batch_size=8, window=8))
    first = next(batches)
    before = first["record"].clone()
    next(batches)
    assert torch.equal(first["record"], before)


def test_one_subset(larger):
    data = read_shards(larger)
    wanted = [i for i, name in enumerate(data.table.column("subset").to_pylist()) if name == "control"]
    stream = RecordStream(larger, ("item", "subset"), "control", batch_size=8, window=16)
    batches = list(stream)
    assert sorted(item for batch in batches for item in batch["item"].tolist()) == wanted
    assert {name for batch in batches for name in batch["subset"]} == {"control"}
    for batch in batches:
        np.testing.assert_array_equal(batch["record"].numpy(), data.records[batch["item"].numpy()])
    table = RecordTable(larger, ("item",), "control")
    assert [table[place]["item"].item() for place in range(len(table))] == wanted


def test_a_table_gives_records_by_place_in_any_order(larger):
    data, table = read_shards(larger), RecordTable(larger, ("item", "code"))
    assert len(table) == 97
    for place in (0, 13, 96, -1):
        assert table[place]["item"].item() == place % 97
        np.testing.assert_array_equal(table[place]["record"].numpy(), data.records[place])
    found = table.__getitems__([50, 3, 50, 90])
    assert [row["item"].item() for row in found] == [50, 3, 50, 90]
    with pytest.raises(IndexError, match="0 to 96"):
        table[97]
    sampled = DataLoader(table, batch_size=32, shuffle=True, generator=torch.Generator().manual_seed(0))
    seen = [item for batch in sampled for item in batch["item"].tolist()]
    assert sorted(seen) == list(range(97)) and seen != sorted(seen)


def test_null_is_nan(larger):
    batch = next(iter(RecordStream(larger, ("remaining_turns", "warmup_settled"), batch_size=8, window=8)))
    assert batch["remaining_turns"].isnan().all() and batch["warmup_settled"].dtype == torch.bool


def test_a_network_learns_from_the_stream(larger):
    """The loss of a linear fit to the codes falls."""
    torch.manual_seed(0)
    model = torch.nn.Linear(64, 5)
    optimiser = torch.optim.Adam(model.parameters(), lr=3e-2)
    stream, losses = RecordStream(larger, ("code",), batch_size=16, window=96), []
    for epoch in range(10):
        stream.set_epoch(epoch)
        for batch in stream:
            loss = torch.nn.functional.binary_cross_entropy_with_logits(model(batch["record"]), batch["code"])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(loss.item())
    assert np.mean(losses[-7:]) < 0.8 * np.mean(losses[:7])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"columns": ("clas",)}, "columns must be one of .*did you mean 'class'"),
        ({"columns": ("record",)}, "columns must be one of"),
        ({"subset": "training"}, "subset must be one of calibration, control, validation, got 'training'"),
        ({"batch_size": 0}, "batch_size must be a whole number >= 1, got 0"),
        ({"batch_size": 100, "window": 150}, r"window must be a multiple of batch_size \(100\), got 150"),
        ({"batch_size": 100, "window": 50}, "window must be a whole number >= 100, got 50"),
        ({"seed": -1}, "seed must be a whole number >= 0"),
        ({"threads": 0}, "threads must be a whole number >= 1, got 0"),
    ],
)
def test_mistakes(larger, arguments, sentence):
    with pytest.raises(ParameterError, match=sentence):
        RecordStream(larger, **arguments)


def test_a_folder_that_is_none_and_a_damaged_shard(larger, tmp_path):
    with pytest.raises(SignalError, match="is no folder"):
        RecordStream(tmp_path / "none")
    stream = RecordStream(larger)
    stream.set_epoch(1)
    with pytest.raises(ParameterError, match="epoch must be a whole number"):
        stream.set_epoch(-1)
