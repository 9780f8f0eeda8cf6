"""Turns left are learnt from lives run to failure, with an interval for a new life. Every random choice is seeded."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from classifier.dataset import SUBSETS, Dataset
from classifier.parts import PARTS
from classifier.tasks.need import NotAvailable
from classifier.tasks.remaining import Remaining
from tests.classifier.tasks.conftest import CODES

NOTHING = np.empty(0)
RECORDS = 10


def worn(lives: int, seed: int) -> tuple[Dataset, np.ndarray]:
    """Lives of ten records whose features tell the wear, while each life's own length is told to no record."""
    rng = np.random.default_rng(seed)
    life = np.repeat(np.arange(lives), RECORDS)
    share = np.tile(np.linspace(0.0, 1.0, RECORDS), lives)
    length = rng.uniform(0.7e6, 1.3e6, lives)[life]
    mixing = np.random.default_rng(0).normal(0, 1, (1, 12))
    features = np.exp(share[:, None] @ mixing + 0.03 * rng.standard_normal((len(life), 12)))
    table = pa.table({"machine_draw": life, "remaining_turns": np.round((1.0 - share) * length).astype(np.int64)})
    subsets = np.resize(np.repeat(SUBSETS, (3, 5, 2)), lives)[life]
    classes = 1 + np.arange(len(life)) % 4
    dataset = Dataset(
        np.zeros((len(life), 8), np.float32), classes, subsets, CODES, 100.0, "table_acceleration", "rad/s^2", {},
        table=table,
    )  # fmt: skip
    return dataset, features


def test_turns_left_follow_the_truth_and_the_interval_holds_for_new_lives() -> None:
    """Mean over eight draws of 50 control and 20 new lives; the standard error is 2 %."""
    held, errors = [], []
    for seed in range(8):
        dataset, features = worn(100, seed)
        part = Remaining.fit(dataset, features, NOTHING, seed=0)
        rows = dataset.rows("validation")
        told, truth = part.assess(features[rows], NOTHING, NOTHING), dataset.table["remaining_turns"].to_numpy()[rows]
        held.append(np.mean((told["remaining_turns_low"] <= truth) & (truth <= told["remaining_turns_high"])))
        errors.append(np.abs(told["remaining_turns"] - truth).mean() / truth.mean())
    assert 0.86 <= np.mean(held) <= 0.97
    assert np.mean(errors) < 0.2


def test_lives_count_not_records() -> None:
    """Eight control lives of ten records each promise no interval for 90 % of new lives."""
    dataset, features = worn(16, 0)
    with pytest.raises(NotAvailable, match="8 lives in the control subset, 9 needed"):
        Remaining.fit(dataset, features, NOTHING, seed=0)


def test_no_part_where_machines_do_not_fail(known) -> None:
    with pytest.raises(NotAvailable, match="no turns left until failure that every row states"):
        Remaining.fit(*known, NOTHING, seed=0)
    dataset, features = worn(40, 0)
    unknown = dataset.table.set_column(1, "remaining_turns", pa.array([None, *range(399)], pa.int64()))
    with pytest.raises(NotAvailable, match="no turns left"):
        Remaining.fit(dataclasses.replace(dataset, table=unknown), features, NOTHING, seed=0)


def test_it_is_a_part_and_comes_back_bit_for_bit() -> None:
    dataset, features = worn(40, 0)
    part = Remaining.fit(dataset, features, NOTHING, seed=0)
    again = PARTS[part.kind].restore(part.body(), part.arrays())
    told, retold = (one.assess(features, NOTHING, NOTHING) for one in (part, again))
    assert isinstance(again, Remaining)
    assert all(np.array_equal(column, retold[name]) for name, column in told.items())
