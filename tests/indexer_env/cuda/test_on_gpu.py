"""On a real card: the same motion as on a CPU. Run by `python -m pytest -m gpu tests/indexer_env/cuda`."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import torch

from benchmarks import cases as draws
from benchmarks import measures
from classifier.features import Psd
from indexer_env import Run, Sensor, simulate_batch
from indexer_env.device import on_host
from indexer_env.vector_env import IndexerVectorEnv

_SPEC = importlib.util.spec_from_file_location("cuda_cases", Path(__file__).parent / "cases.py")
cases = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(cases)

pytestmark = pytest.mark.gpu

APART = 1e-9
"""Of the record's rms, over half a second: the card contracts multiplications and additions and has another exponential
function, and play makes of one rounding some thousand."""


def test_half_a_second_agrees():
    run = Run(samples=500, warmup_turns=0)
    for machines in (draws.draws(64), cases.machines()):
        expected = simulate_batch(machines, run=run).table_acceleration
        found = simulate_batch(machines, run=run, device="cuda").table_acceleration
        assert isinstance(found, torch.Tensor) and found.device.type == "cuda"
        assert (measures.relative_rms(on_host(found), expected) <= APART).all()


def test_the_spectrum_of_a_turn_agrees():
    """Play parts any two solutions within a turn; the level of its spectrum stays."""
    machines, run = draws.draws(64), Run(samples=draws.TURN_SAMPLES, warmup_turns=0)
    expected = simulate_batch(machines, run=run).table_acceleration
    found = on_host(simulate_batch(machines, run=run, device="cuda").table_acceleration)
    psd = Psd()
    levels = measures.level_difference(psd.density(found, 1000.0), psd.density(expected, 1000.0))
    assert abs(float(np.mean(levels))) <= 0.1


@pytest.mark.parametrize("run", cases.RUNS)
def test_the_cases_agree(run):
    expected, found = cases.RUNS[run]("cpu"), cases.RUNS[run]("cuda")
    for name, values in expected.items():
        if values.dtype == float:
            np.testing.assert_allclose(found[name], values, rtol=1e-7, atol=1e-7, err_msg=name)


def test_an_item_does_not_depend_on_its_batch():
    run = Run(samples=500, warmup_turns=0)
    machines = draws.draws(200)
    together = simulate_batch(machines, run=run, device="cuda").table_acceleration
    alone = simulate_batch(machines[131:132], run=run, device="cuda").table_acceleration
    assert torch.equal(together[131], alone[0])


def test_the_environment_stays_on_the_card():
    env = IndexerVectorEnv(256, device="cuda", autoreset_mode="SameStep", max_episode_steps=4)
    observations, _ = env.reset(seed=0)
    for _ in range(6):
        observations, rewards, terminated, truncated, infos = env.step(torch.zeros(256, 1, device="cuda"))
        for values in (observations, rewards, terminated, truncated, infos["acceleration"]):
            assert values.device.type == "cuda"
    assert bool(observations.abs().le(1.0).all()) and bool(rewards.isfinite().all())


def test_noise_goes_on_where_a_period_is_replayed():
    """A CUDA graph replays a period's operations; the numbers of its noise must be new ones each time."""
    env, quiet = (
        IndexerVectorEnv(8, device="cuda", sensor=Sensor(noise_density=density, full_scale=1e3))
        for density in (1e-2, 0.0)
    )
    actions = torch.zeros(8, 1, device="cuda")

    def noise() -> list[torch.Tensor]:
        for fleet in (env, quiet):
            fleet.reset(seed=3)
        return [env.step(actions)[4]["acceleration"] - quiet.step(actions)[4]["acceleration"] for _ in range(5)]

    first, again = noise(), noise()
    assert all(torch.equal(one, other) for one, other in zip(first, again, strict=True))
    assert len({float(each[0, 0]) for each in first}) == 5
