import contextlib
import dataclasses
from typing import Any

import numpy as np
import pytest
import torch

from classifier.curves import write_curves
from classifier.dataset import SUBSETS, load_dataset, rows_sha256
from classifier.evaluate import score
from classifier.model import load_model, save_model
from classifier.pictures import draw_training
from classifier.train import train
from classifier.trainers import TRAINERS
from indexer_env.errors import ParameterError, SignalError


def test_three_resonances_are_told_apart(result, dataset):
    for subset in SUBSETS:
        assert result.score(subset).misclassified_percent == 0.0
        assert result.score(subset).records == 24
        assert np.trace(result.score(subset).confusion) == 24
    assert result.score("validation").mse_percent < 2.0


def test_scores_are_those_of_the_model_that_is_handed_out(result, dataset):
    rows = dataset.rows("validation")
    again = score(dataset.codes, result.model.outputs(dataset.records[rows]), dataset.classes[rows])
    assert again.mse_percent == pytest.approx(result.score("validation").mse_percent, rel=1e-12)
    assert again.confusion == result.score("validation").confusion


def test_the_best_restart_on_the_control_subset_is_kept(result):
    control = [score.mse_percent for score in result.scores["control"]]
    assert len(control) == 3
    assert result.kept == np.argmin(control)
    assert len(set(control)) == 3


def test_errors_of_bipolar_targets_are_shown_on_the_scale_of_the_bits(dataset, features, trainer, tmp_path):
    """In the curve, in what the progress tells, in the picture and in TensorBoard as in the table of scores."""
    told, shown = [], {}

    class Writer(contextlib.nullcontext):
        def __enter__(self):
            return self

        def add_scalar(self, name, value, epoch):
            shown.setdefault(name, []).append(value)

    result = train(
        dataset, features, trainer, hidden=6, seed=3, restarts=2, parts=(),
        output_function="tanh", targets="bipolar", progress=lambda epoch, error: told.append(error),
    )  # fmt: skip
    write_curves(Writer, tmp_path, result)
    (ax,) = draw_training(dataset, result)["training"].axes
    (drawn,) = (line.get_ydata() for line in ax.lines if line.get_label() == "control, kept network")
    lowest = [100 * min(result.to_dict()["curve"]["control_mse"]), 100 * min(told), np.nanmin(drawn)]
    assert [*lowest, min(shown["training_mse_percent/control"])] == pytest.approx(
        [result.score("control").mse_percent] * 4
    )


def test_validation_records_change_nothing_in_the_model(result, dataset, features, trainer):
    """Scaling, weights, number of epochs and mean spectra are blind to the validation subset."""
    records = dataset.records.copy()
    records[dataset.rows("validation")] *= 7.0
    changed = train(dataclasses.replace(dataset, records=records), features, trainer, hidden=6, seed=3, restarts=3)
    assert torch.equal(changed.model.parameters, result.model.parameters)
    assert np.array_equal(changed.model.scaling.low, result.model.scaling.low)
    assert np.array_equal(changed.model.scaling.high, result.model.scaling.high)
    assert np.array_equal(changed.model.mean_densities, result.model.mean_densities)
    assert changed.score("validation").mse_percent != result.score("validation").mse_percent


def test_scaling_is_fitted_to_the_calibration_subset_alone(result, dataset, features, trainer):
    values = features.compute(dataset.records[dataset.rows("calibration")], dataset.sample_rate)
    assert np.array_equal(result.model.scaling.low, values.min(axis=0))
    assert np.array_equal(result.model.scaling.high, values.max(axis=0))


def test_the_seed_decides(result, dataset, features, trainer):
    same = train(dataset, features, trainer, hidden=6, seed=3, restarts=3)
    other = train(dataset, features, trainer, hidden=6, seed=4, restarts=3)
    assert torch.equal(same.model.parameters, result.model.parameters)
    assert not torch.equal(other.model.parameters, result.model.parameters)


@pytest.mark.parametrize(
    "net",
    [
        {"output_function": "linear"},
        {"output_function": "linear", "targets": "bipolar"},
        {"hidden_function": "tanh", "output_function": "tanh", "targets": "bipolar"},
    ],
)
def test_other_functions_and_targets_name_the_classes_too(dataset, features, trainer, net, tmp_path):
    """Outputs come on the scale of the bits, whatever the targets were, also from a stored model."""
    result = train(dataset, features, trainer, hidden=6, seed=3, restarts=2, **net)
    assert result.score("calibration").misclassified_percent == 0.0
    assert result.score("validation").mse_percent < 5.0
    save_model(result.model, tmp_path)
    loaded = load_model(tmp_path)
    assert loaded.network == result.model.network
    assert np.array_equal(loaded.outputs(dataset.records), result.model.outputs(dataset.records))


@pytest.mark.parametrize("kind", TRAINERS)
def test_every_rule_learns_the_three_resonances(dataset, features, kind):
    result = train(dataset, features, TRAINERS[kind](), hidden=6, seed=3, restarts=3)
    assert result.score("validation").misclassified_percent == 0.0
    assert result.model.provenance["trainer"]["kind"] == kind


def test_a_device_that_is_not_there_is_refused(dataset, features, trainer, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ParameterError, match=r"train.device must be .*, got 'cuda'; use 'cpu'\."):
        train(dataset, features, trainer, device="cuda")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": -1}, "train.seed must be a whole number >= 0"),
        ({"restarts": 0}, "train.restarts must be a whole number >= 1"),
        ({"device": "gpu"}, "train.device must be one of cpu, cuda"),
        ({"hidden": 0}, "Mlp.hidden must be a whole number >= 1"),
    ],
)
def test_bad_numbers_are_refused(dataset, features, trainer, change, words):
    with pytest.raises(ParameterError, match=words):
        train(dataset, features, trainer, **change)


def test_scores_by_hand(dataset):
    """Codes 011, 101, 110: the second record is given to class 1, the nearest to its outputs."""
    outputs = np.array([[0.0, 1.0, 0.5], [0.4, 0.5, 1.0]])
    got = score(dataset.codes, outputs, np.array([1, 2]))
    assert got.mse_percent == pytest.approx(100 * (0.25 + 0.36 + 0.25) / 6)
    assert got.misclassified_percent == 50.0
    assert got.confusion == ((1, 0, 0), (1, 0, 0), (0, 0, 0))


def test_a_data_set_is_read_from_a_url(dataset, tmp_path, write_dataset):
    fsspec = pytest.importorskip("fsspec")
    fsspec.filesystem("memory").put(str(write_dataset(dataset, tmp_path / "set")), "/bucket/trained", recursive=True)
    there, here = load_dataset("memory://bucket/trained"), load_dataset(tmp_path / "set")
    np.testing.assert_array_equal(there.records, here.records)
    assert there.provenance["manifest_sha256"] == here.provenance["manifest_sha256"]
    assert there.provenance["folder"] == "memory://bucket/trained"


def test_a_data_set_comes_back_as_it_was_written(dataset, write_dataset, tmp_path):
    read = load_dataset(write_dataset(dataset, tmp_path / "set"))
    assert np.array_equal(read.records, dataset.records)
    assert np.array_equal(read.classes, dataset.classes)
    assert np.array_equal(read.subsets, dataset.subsets)
    assert (read.codes, read.sample_rate, read.unit) == (dataset.codes, dataset.sample_rate, dataset.unit)
    assert len(read.provenance["manifest_sha256"]) == 64


def test_a_longer_data_set_of_the_same_seed_has_the_rows_of_a_shorter_one():
    """Neither count nor shards nor repeats change an item; seed, machine and laws do."""
    campaign = {"name": "bench", "repeats": 10, "draws": {"machine": {"cam_inertia": {"around": 0.1}}}}
    config = {"count": 20, "shard_items": 576, "device": "cpu", "machine": {"table_inertia": 5.0}, "campaign": campaign}
    manifest = {"campaign": "bench", "seed": 3, "count": 20, "config": config}

    def rows(of_item: dict[str, Any] | None = None, of_campaign: dict[str, Any] | None = None, **others: Any) -> Any:
        given = {**config, **(of_item or {}), "campaign": {**campaign, **(of_campaign or {})}}
        return rows_sha256({**manifest, "config": given, **others})

    assert rows() == rows({"count": 40, "shard_items": 7, "device": "cuda"}, {"repeats": 20}, count=40)
    changed = [rows(seed=4), rows({"machine": {"table_inertia": 6.0}}), rows(None, {"draws": {}})]
    assert None not in changed and len({rows(), *changed}) == 4
    assert rows(campaign="measured") is None and rows_sha256({**manifest, "config": {}}) is None
    assert rows(None, {"posterior": "posterior.parquet"}) is None


def test_a_subset_without_a_class_is_refused(dataset):
    keep = ~((dataset.classes == 2) & dataset.rows("control"))
    parts = {name: getattr(dataset, name)[keep] for name in ("records", "classes", "subsets")}
    with pytest.raises(SignalError, match=r"control subset must hold .* none of class 2"):
        dataclasses.replace(dataset, **parts)


@pytest.mark.parametrize(
    ("last", "words"),
    [
        ({"unit": "m/s^2"}, "unit must be the same for all records"),
        ({"sample_rate": 100.0}, "sample_rate must be the same for all records"),
        ({"constant_share": 1.0}, r"must vary, got one value throughout in 1 of them \(item 71 first\)"),
        ({"machine_draw": 0}, "machine draw 0 .* got calibration and validation"),
    ],
)
def test_a_data_set_with_one_odd_row_is_refused(dataset, write_dataset, tmp_path, last, words):
    with pytest.raises(SignalError, match=words):
        load_dataset(write_dataset(dataset, tmp_path / "set", **last))


def test_a_folder_without_a_data_set_is_refused(tmp_path):
    with pytest.raises(SignalError, match="is no folder that holds a data set"):
        load_dataset(tmp_path)


def test_a_data_set_with_missing_samples_is_refused(dataset, write_dataset, tmp_path):
    records = dataset.records.copy()
    records[5, 7] = np.nan
    folder = write_dataset(dataclasses.replace(dataset, records=records), tmp_path / "set")
    with pytest.raises(SignalError, match=r"must be finite, got others in 1 records \(item 5 first\)"):
        load_dataset(folder)
