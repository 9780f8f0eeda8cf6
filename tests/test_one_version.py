"""Nothing in the packages makes numba compile a second version of what is compiled."""

import dataclasses

import gymnasium
import numpy as np

from discrepancy import NONE
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.jobs import Jobs
from indexer_env import OperatingPoint, Run, Signal, load_machine, simulate_batch
from indexer_env.engine import _kernel, control_kernels
from indexer_env.vector_env import IndexerVectorEnv
from indexer_experiments.challenge.truth import compiled, true_motion


def test_every_path_uses_the_one_version() -> None:
    """Machines and points of whole numbers, laws that are read-only, actions that stand column by column."""
    reference, smooth = load_machine("reference"), load_machine("smooth")
    whole = dataclasses.replace(reference, table_inertia=5)
    point = OperatingPoint(load_torque=2, start_angle=0)
    run = Run(samples=4800, warmup_turns=0)
    batch = simulate_batch([whole, smooth, reference], [point] * 3, run)
    one = gymnasium.make("indexer_env/Indexer-v1", brake_torque=20.0)
    one.reset(seed=1)
    one.step(np.zeros(2, dtype=np.float32))
    many = IndexerVectorEnv(40, brake_torque=20.0)
    many.reset(seed=1)
    actions = np.zeros((40, 2), dtype=np.float32, order="F")
    actions.flags.writeable = False
    many.step(actions)
    experiments = [Experiment(Signal(values, 1000.0, unit="rad/s^2"), point) for values in batch.table_acceleration]
    model = IndexerModel(whole, experiments[:1])
    windows = np.arange(len(model.counts))
    jobs = Jobs(np.zeros((1, len(model.parameters))), 0 * windows, windows, np.zeros((len(windows), 4)))
    assert np.isfinite(model.residuals(NONE, jobs)).all()
    for machine in (whole, reference):
        assert np.isfinite(true_motion(machine, point, 20, 1000.0)[0]).all()
    for kernel in (_kernel(), *control_kernels(), *compiled()):
        assert len(kernel.signatures) == 1, kernel
