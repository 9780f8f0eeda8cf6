"""The benchmark set is the published one, and each of its splits keeps its word."""

import numpy as np
import pytest

from classifier import benchmark
from classifier.benchmark import BENCHMARKS, FASTEST_TAUGHT, LARGE, SEED, SPLITS, digest, load_benchmark, recipe_of
from classifier.tasks.severity import QUANTITIES
from datagen.recipes import Recipe, order_of
from indexer_env.errors import ParameterError
from indexer_env.units import RPM


@pytest.mark.parametrize("name", BENCHMARKS)
def test_items_are_the_published_ones(name: str) -> None:
    assert digest(order_of(recipe_of(name), SEED)) == BENCHMARKS[name]


def test_another_number_is_another_set() -> None:
    other = Recipe("other", (*recipe_of("benchmark-v1").overrides, "campaign.draws.machine.table_inertia.around=0.11"))
    assert digest(order_of(other, SEED)) != BENCHMARKS["benchmark-v1"]


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """The first 400 records of the set at 125 Hz, which a test can make; its loader, with the digest that they have."""
    slow = ("run.sample_rate=125", "sensor.bracket_hz=null", "sensor.lowpass_hz=null", "sensor.hum_amplitude=0")
    recipe = Recipe("small", (*recipe_of("benchmark-v1").overrides, "count=400", *slow))
    folder = tmp_path_factory.mktemp("benchmark")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BENCHMARKS, "small", digest(order_of(recipe, SEED)))
        patch.setattr(benchmark, "recipe_of", lambda name: recipe)
        return {split: load_benchmark("small", split, folder) for split in SPLITS}


def _column(dataset, name: str, rows: str) -> np.ndarray:
    return dataset.table.column(name).to_numpy()[dataset.rows(rows)]


def test_no_machine_teaches_and_judges(small) -> None:
    for dataset in small.values():
        teach = {*_column(dataset, "machine_draw", "calibration"), *_column(dataset, "machine_draw", "control")}
        assert not teach & set(_column(dataset, "machine_draw", "validation"))
        assert set(dataset.classes[dataset.rows("validation")]) == set(dataset.codes.classes)


def test_judged_speeds_are_above_all_that_teach(small) -> None:
    limit = FASTEST_TAUGHT * RPM
    assert _column(small["operating_point"], "motor_speed", "validation").min() > limit
    assert _column(small["operating_point"], "motor_speed", "calibration").max() <= limit
    assert _column(small["machine"], "motor_speed", "calibration").max() > limit


def test_judged_faults_are_smaller_than_all_that_teach(small) -> None:
    for name, least in LARGE.items():
        column, factor, _ = QUANTITIES[name]
        judged, taught = (factor * _column(small["fault_size"], column, rows) for rows in ("validation", "calibration"))
        assert 0.0 < judged.max() < least <= taught[taught > 0.0].min()


def test_refusals(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ParameterError, match="did you mean 'fault_size'"):
        load_benchmark(split="faultsize")
    with pytest.raises(ParameterError, match="name must be one of benchmark-v1"):
        load_benchmark("v1")
    monkeypatch.setitem(BENCHMARKS, "benchmark-v1", "0" * 64)
    with pytest.raises(ParameterError, match="items have the digest 000000000000…, got 'benchmark-v1 with e0f449"):
        load_benchmark()
