"""In numba's CUDA simulator, where nothing is contracted, threads give the bits of the CPU's lanes."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

_SPEC = importlib.util.spec_from_file_location("cuda_cases", Path(__file__).parent / "cases.py")
cases = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(cases)


@pytest.mark.parametrize("run", cases.RUNS)
def test_a_thread_gives_the_bits_of_a_lane(run, simulated):
    expected = cases.RUNS[run]("cpu")
    assert {f"{run}: {name}" for name in expected} == {name for name in simulated if name.startswith(f"{run}: ")}
    for name, values in expected.items():
        # numpy sums the difference of two turns in another order, and has another sine
        apart = 1e-12 if name == "quick 2" or run == "hum" else 0.0
        np.testing.assert_allclose(simulated[f"{run}: {name}"], values, rtol=apart, atol=apart, err_msg=name)


def test_the_cases_show_what_they_are_meant_to_show():
    """Edges of the play are crossed, warm-up ends at different turns, faults grow, episodes end and differ."""
    found = cases.batches("cpu")
    crossed = {
        name: (np.diff(values) != 0.0).any(axis=1).tolist() for name, values in found.items() if "region" in name
    }
    assert crossed["index region_1"] == [True, True, True, False, *[True] * 4]  # Model A has no play there
    assert crossed["dwell region_2"] == [True, False, True, False, True, True, False, False]
    assert found["quick 0"].tolist() == [2, 3] and found["quick 1"].all()
    seen = cases.episodes("cpu", "SameStep")
    assert (seen["3 backlash"] != seen["0 backlash"]).all()
    assert seen["2 truncated"].all() and seen["2 ended"].all()
    assert not np.array_equal(seen["2 observations"], seen["reset"])


def test_noise_is_the_device_s_own_and_its_seed_s(in_simulator):
    program = """
import torch
from indexer_env import Sensor
from indexer_env.vector_env import IndexerVectorEnv

def read(seed, device="cuda"):
    sensor = Sensor(noise_density=0.05, full_scale=100.0)
    env = IndexerVectorEnv(2, device=device, period=0.1, start_angle=4.0, sensor=sensor)
    env.reset(seed=seed)
    infos = [env.step(torch.ones(2, 1).numpy())[4]["acceleration"] for _ in range(2)]
    return torch.cat([torch.as_tensor(each) for each in infos])

first, again, other, host = read(3), read(3), read(4), read(3, "cpu")
assert torch.equal(first, again) and not torch.equal(first, other) and not torch.equal(first[:2], first[2:])
assert not torch.equal(first, host) and abs((first - other).std() / 2**0.5 - 0.05 * 500**0.5) < 0.1
print("seen")
"""
    assert in_simulator(program) == "seen\n"


def test_a_data_set_s_rows_name_their_gpu_and_can_be_made_again(in_simulator, tmp_path):
    program = """
import dataclasses, sys
from indexer_env import OperatingPoint, Run, Sensor, load_machine
from datagen.campaign import Base
from datagen.campaigns import make_campaign
from datagen.order import Order
from datagen.produce import produce
from datagen.remake import differences, remake_all

run = Run(samples=30, warmup_turns=0)
base = Base(load_machine("reference"), OperatingPoint(start_angle=3.3), sensor=Sensor())
host = Order(make_campaign({"name": "grid"}), base, run, count=1)
order = dataclasses.replace(host, device="cuda")
assert order.fingerprint != host.fingerprint == dataclasses.replace(order, device="cpu").fingerprint
assert order.fingerprint == dataclasses.replace(order, device="cuda:0").fingerprint
(row,), records, rejected = produce(order, [order.campaign.item(0, base, 0)])
(plain,), plain_records, _ = produce(host, [order.campaign.item(0, base, 0)], threads=1)
assert row["device"] == "simulator" and "device" not in plain and not rejected
assert (records == plain_records).all()
full = {name: None for name in ("drive_sensors",)} | row | {"record": records[0]}
assert differences(remake_all(full), full) == ""
print("made")
"""
    assert in_simulator(program) == "made\n"


def test_ppo_learns_on_the_device_from_tensors_alone(in_simulator):
    program = "from examples.train_ppo_device import train; train('cuda', 3, 4, 2, 0)"
    assert in_simulator(program).count("mean reward") == 2
