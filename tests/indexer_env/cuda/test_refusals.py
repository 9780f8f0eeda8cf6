"""One sentence where there is no such device."""

import importlib.util
import subprocess
import sys

import pytest
from numba import cuda

from datagen.campaign import Base
from datagen.campaigns import make_campaign
from datagen.generate import generate
from datagen.order import Order
from indexer_env import OperatingPoint, ParameterError, Run, Sensor, load_machine, simulate_batch
from indexer_env.vector_env import IndexerVectorEnv

NO_GPU = "device=cuda needs an NVIDIA GPU with its driver, which is not here; use device=cpu."

without_gpu = pytest.mark.skipif(cuda.is_available(), reason="there is a GPU here")


def order(device: str) -> Order:
    base = Base(load_machine("reference"), OperatingPoint(), sensor=Sensor())
    run = Run(samples=300, warmup_turns=0)
    return Order(make_campaign({"name": "grid"}), base, run, count=1, device=device)


@pytest.mark.parametrize("device", ["gpu", "cuda:", "cuda:x", "CUDA", 0, None])
def test_a_device_of_no_such_name(device):
    rule = "device must be cpu, cuda or cuda:N, N the number of a GPU, got "
    with pytest.raises(ParameterError, match=f"^simulate_batch.{rule}"):
        simulate_batch([load_machine()], device=device)
    with pytest.raises(ParameterError, match=f"^IndexerVectorEnv.{rule}"):
        IndexerVectorEnv(2, device=device)
    with pytest.raises(ParameterError, match=f"^datagen.{rule}"):
        order(device)


@without_gpu
def test_no_gpu(tmp_path):
    with pytest.raises(ParameterError) as refused:
        simulate_batch([load_machine()], device="cuda")
    assert str(refused.value) == f"simulate_batch.{NO_GPU}"
    with pytest.raises(ParameterError) as refused:
        IndexerVectorEnv(2, device="cuda")
    assert str(refused.value) == f"IndexerVectorEnv.{NO_GPU}"
    with pytest.raises(ParameterError) as refused:
        generate(order("cuda"), tmp_path / "set")
    assert str(refused.value) == f"datagen.{NO_GPU}" and not (tmp_path / "set").exists()


def test_the_extra_is_not_installed(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "numba_cuda" else find(name))
    with pytest.raises(ParameterError) as refused:
        simulate_batch([load_machine()], device="cuda:1")
    assert str(refused.value) == (
        "simulate_batch.device=cuda:1 needs the package numba-cuda, which is not here; "
        "pip install 'indexer-diagnosis[cuda]'."
    )


def test_a_torch_without_cuda(monkeypatch):
    monkeypatch.setattr(cuda, "is_available", lambda: True)
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    with pytest.raises(ParameterError, match=r"needs a torch that is built for CUDA and not .*; install torch as its"):
        simulate_batch([load_machine()], device="cuda")


def test_refusals_on_a_device(in_simulator):
    program = """
import torch
from indexer_env import ParameterError, load_machine, simulate_batch
from indexer_env.vector_env import IndexerVectorEnv

def refused(call):
    try:
        call()
    except ParameterError as error:
        print(" ".join(str(error).split()))

refused(lambda: simulate_batch([load_machine()], device="cuda", threads=2))
refused(lambda: simulate_batch([load_machine()], device="cuda:3"))
env = IndexerVectorEnv(2, device="cuda", period=0.001, start_angle=4.0)
env.reset(seed=0)
refused(lambda: env.step(torch.tensor([[0.0], [1.5]])))
refused(lambda: env.step(torch.zeros(3, 1)))
refused(lambda: env.step(torch.zeros(2, 1, dtype=torch.bool)))
"""
    assert in_simulator(program).splitlines() == [
        "simulate_batch.threads must be left out (None) with device=cuda, got 2.",
        "simulate_batch.device must be cuda:0, the one GPU here, got 'cuda:3'.",
        "IndexerVectorEnv (item 1).action must be finite and within [-1, 1] (speed), got 1.5; clip it yourself where "
        "that is meant.",
        "IndexerVectorEnv.action must be of shape (2, 1), got array([[0.], [0.], [0.]], dtype=float32).",
        "IndexerVectorEnv.action must be an array of floats, got array([[False], [False]]); its dtype is bool.",
    ]


def test_a_machine_of_the_batch_that_fails_is_rejected_on_a_device(in_simulator):
    program = """
import dataclasses
from indexer_env import OperatingPoint, Run, load_machine, simulate_batch

good = load_machine()
soft = dataclasses.replace(good, output_joint=dataclasses.replace(good.output_joint, stiffness=10.0, damping=0.0))
run = Run(samples=400, warmup_turns=0, sample_rate=500.0)
batch = simulate_batch([soft, good], OperatingPoint(motor_speed=600.0), run, device="cuda")
print(batch.rejected, batch.table_acceleration.isnan().all(dim=1).tolist(), batch.table_acceleration.device)
"""
    said = in_simulator(program)
    assert "deflected a joint beyond 0.5 rad" in said and "[True, False] cpu" in said


def test_the_package_is_as_light_as_before():
    names = ("torch", "numba.cuda", "numba_cuda", "indexer_env.cuda")
    program = f"import sys, indexer_env; print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
