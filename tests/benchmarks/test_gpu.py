"""The benchmark of the GPU: operations are counted, and without a GPU it says so."""

import json
import os
import subprocess
import sys

import pytest
from numba import cuda

from benchmarks import cases, flops, gpu


def test_operations_are_counted():
    one = flops.Counted(3.0)
    flops.Counted.done = 0
    found = (one * 2.0 + 1.0) / one - 1.0
    assert float(found) == pytest.approx(4.0 / 3.0) and flops.Counted.done == 4
    assert isinstance(2.0 / one, flops.Counted) and float(1.0 / flops.Counted(0.0)) == float("inf")


def test_a_millisecond_of_steps_costs_some_hundred_operations():
    short, long = (flops.of_a_turn(cases.with_play(), samples) for samples in (10, 20))
    assert 200.0 < (long - short) / 10.0 < 3000.0


def test_the_machines_are_of_all_classes():
    found = gpu.machines(12)
    joints = [(machine.model, machine.output_joint) for machine in found]
    assert len(joints) == 12
    assert len({(model, joint.backlash > 0.0, joint.stiffness_ratio < 1.0) for model, joint in joints}) == 6


@pytest.mark.skipif(cuda.is_available(), reason="there is a GPU here")
def test_without_a_gpu_nothing_is_measured():
    rows = gpu.measure(quick=False)
    assert [row.required for row in rows] == ["≥ 300 000", "≥ 5e7"]
    for row in rows:
        assert row.verdict == "not measured" and row.measured.startswith("not measured (an NVIDIA GPU with its driver")


def test_it_runs_where_there_is_one():
    program = """
import json
from benchmarks import gpu
from indexer_env.cuda.device import Cuda
rows = [*gpu.turn_rows(Cuda(0), 2, 12, 2, repeats=1), *gpu.step_rows(Cuda(0), 2, 1)]
print(json.dumps([row.numbers for row in rows]))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], env=os.environ | {"NUMBA_ENABLE_CUDASIM": "1"}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    turns, others, steps, core = json.loads(done.stdout.splitlines()[-1])
    assert turns["turns_per_s"] > 0.0 and turns["flop_a_turn"] > 1e4 and turns["peak"] is None
    assert others["simulate_batch_turns_per_s"] > 0.0 and steps["steps_per_s"] > 0.0 and core["steps_per_core_s"] > 0.0
