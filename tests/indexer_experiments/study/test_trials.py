import dataclasses

import numpy as np
import pytest

from classifier.features import Psd
from classifier.trainers.traingdx import TrainGdx
from indexer_experiments.study.trials import Variant, misclassified, train

VARIANT = Variant("small", features=Psd(resolution_hz=2.0, maximum_hz=50.0), hidden=6, trainer=TrainGdx(epochs=200))


def test_rows_are_the_errors_of_the_outputs(labelled):
    trained = train(labelled, VARIANT, networks=3, seed=0)
    rows, outputs = trained.rows(), trained.outputs(labelled.records)
    assert len(rows) == 3
    chosen = labelled.subsets["control"]
    for network, row in enumerate(rows):
        error = np.mean((outputs[network, chosen] - labelled.targets[chosen]) ** 2)
        assert row["performance"] == row["control_mse"] == pytest.approx(error)
        assert row["performance"] == pytest.approx(np.nanmin(trained.training.control_error[:, network]))
        assert row["performance_of_targets"] == row["performance"]
    assert min(row["validation_misclassified"] for row in rows) == 0.0


def test_bipolar_targets_are_compared_on_the_scale_of_the_bits(labelled):
    bipolar = dataclasses.replace(VARIANT, targets="bipolar", output_function="tanh")
    trained = train(labelled, bipolar, networks=2, seed=0)
    for network, row in enumerate(trained.rows()):
        own = np.nanmin(trained.training.control_error[:, network])
        assert (row["performance_of_targets"], row["performance"]) == pytest.approx((own, own / 4))


def test_without_scaling_the_start_is_the_same_function_and_the_training_another(labelled):
    raw = dataclasses.replace(VARIANT, scaled=False)
    still = TrainGdx(epochs=1, rate=1e-12)
    before = [
        train(labelled, dataclasses.replace(variant, trainer=still), 2, 0).outputs(labelled.records)
        for variant in (VARIANT, raw)
    ]
    assert before[0] == pytest.approx(before[1], abs=1e-9)
    after = [train(labelled, variant, 2, 0).outputs(labelled.records) for variant in (VARIANT, raw)]
    assert np.abs(after[0] - after[1]).max() > 0.1


def test_a_code_is_any_target_and_the_nearest_wins():
    targets = np.array([[0.0, 0.0], [0.0, 0.5], [0.0, 1.0]])
    outputs = np.array([[[0.1, 0.2], [0.1, 0.2], [0.0, 0.8]]])
    assert misclassified(outputs, targets).tolist() == [[False, True, False]]
