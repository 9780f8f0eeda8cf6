import dataclasses

import numpy as np
import pytest

from datagen.changes import value_at, with_changes
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.run import Run
from indexer_env.simulate import simulate
from indexer_experiments.study.claims.fig10 import Fig10, record_of
from indexer_experiments.study.claims.models import misfits
from indexer_experiments.study.measured import JOINTS, SENSOR, drawn, measured, read, scaled


def test_a_measured_machine_has_joints_of_its_own():
    """Seed 0: all within ±10 % of the reference machine's, none equal, another seed's differ."""
    first, second = (drawn(np.random.default_rng(seed)) for seed in (0, 1))
    ratios = [
        [value_at(machine, path) / value_at(load_machine(), path) for path in JOINTS] for machine in (first, second)
    ]
    assert np.all(np.abs(np.array(ratios) - 1.0) <= 0.1) and len(np.unique(ratios)) == 2 * len(JOINTS)
    assert scaled(first, {"table_inertia": 3.0}).table_inertia == 3.0 * first.table_inertia


def test_a_measured_record_is_the_solvers_motion_as_the_accelerometer_reads_it():
    """The kernel's motion through a sensor without noise differs from it by the noise: 0.045 m/s² rms over 0.4 m."""
    machine = with_changes(load_machine(), {"input_joint.backlash": 0.0})
    record = measured(machine, OperatingPoint(), np.random.default_rng(0), 500)
    motion = simulate(machine, run=Run(samples=500, warmup_turns=0)).channels["table_acceleration"]
    quiet = read(motion, None, dataclasses.replace(SENSOR, noise_density=0.0))
    assert np.std(record - quiet) == pytest.approx(0.045 / 0.4, rel=0.15)
    assert np.std(record) > 5 * np.std(record - quiet)


def test_a_model_fits_what_it_can_express():
    """A record of Model A leaves both models the noise alone; one of Model B leaves Model A much more. Seed 0."""
    plain = with_changes(load_machine(), {"input_joint.backlash": 0.0})
    left = {}
    for truth in "AB":
        machine = with_changes(drawn(np.random.default_rng(0)), {"model": truth, "input_joint.backlash": 0.0})
        record = measured(machine, OperatingPoint(), np.random.default_rng(0), 1000)
        left |= {(truth, model): value for model, value in misfits(record, plain, OperatingPoint()).items()}
    # Noise, and hum of 0.02 m/s² in amplitude.
    floor = np.hypot(0.045, 0.02 / np.sqrt(2)) / 0.4 / np.std(record)
    assert left["A", "A"] < 1.2 * floor and left["B", "B"] < 1.2 * floor
    assert left["A", "B"] < 2 * floor and left["B", "A"] > 5 * floor


@pytest.mark.parametrize("key", ["20° of play", "intact"])
def test_the_record_of_fig_10_is_that_of_its_setting(key):
    """The crack and the play change the record by far more than the noise; the same seed gives it again."""
    settings = {setting.key: setting for setting in Fig10.settings}
    record, intact = record_of(settings[key], 0, 600, 0), record_of(settings["intact"], 0, 600, 0)
    assert np.array_equal(record, intact) == (key == "intact")
    assert not np.array_equal(record, record_of(settings[key], 1, 600, 0))
