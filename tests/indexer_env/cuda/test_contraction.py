"""What a card's contraction of multiplications and additions does to a record, seen on a CPU: the kernels once more,
one lane each, compiled for contraction."""

import importlib
import sys

import numpy as np
import pytest

from benchmarks import cases, measures
from indexer_env import Run, kernels, simulate_batch
from indexer_env.coefficients import coefficients, pack
from indexer_env.engine import LARGEST_DEFLECTION
from indexer_env.kernels import layout
from indexer_env.modes import steps_of

APART = 1e-9
SAMPLES, MACHINES = 500, 16

COMPILING = """
import numpy as np
from numba import njit

LANES = np.uint64(1)
scalar = lanes = merged = njit(error_model="numpy", _nrt=False, forceinline=True, fastmath={"contract"})
outlined = njit(error_model="numpy", _nrt=False, fastmath={"contract"})
"""


@pytest.fixture
def contracted(tmp_path, monkeypatch):
    """The modules of indexer_env.kernels beside another `compiling`, as the GPU's are."""
    folder = tmp_path / "contracted"
    folder.mkdir()
    (folder / "__init__.py").write_text(f"__path__.extend({list(kernels.__path__)!r})")
    (folder / "compiling.py").write_text(COMPILING)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield lambda name: importlib.import_module(f"contracted.{name}")
    for name in [name for name in sys.modules if name.split(".")[0] == "contracted"]:
        del sys.modules[name]


@pytest.mark.slow
def test_contraction_stays_within_the_bound_over_half_a_second(contracted):
    from numba import njit

    run_item, workspace = contracted("item").run_item, contracted("layout").WORKSPACE

    @njit(error_model="numpy")
    def run(model, features, states, coefficients, pieces, n_steps, steps, last, every, rows, out, status, when):
        for item in range(len(states)):
            run_item(
                np.empty(workspace), item, model, features, states, coefficients, pieces, n_steps, steps, last, every,
                rows, LARGEST_DEFLECTION, out, status, when,
            )  # fmt: skip

    machines = cases.draws(MACHINES)
    points = [cases.OPERATING_POINT] * MACHINES
    items = [coefficients(machine, cases.OPERATING_POINT) for machine in machines]
    every = Run().steps_per_sample(float(steps_of(items, points)[1].min()))
    step = 1e-3 / every
    packed = pack(items, points)
    out = np.empty((MACHINES, 1, SAMPLES))
    run(
        packed.model, packed.features, packed.states, packed.coefficients, packed.pieces,
        np.full(MACHINES, SAMPLES * every), np.full(MACHINES, step), np.zeros(MACHINES), every,
        np.array([layout.TABLE_ACC // layout.LANES], dtype=np.int64), out, np.zeros(MACHINES, dtype=np.int64),
        np.zeros(MACHINES),
    )  # fmt: skip
    expected = simulate_batch(machines, run=Run(samples=SAMPLES, warmup_turns=0, step=step)).table_acceleration
    apart = measures.relative_rms(out[:, 0], expected)
    print(f"contraction: {apart.max():.2g} of the rms at most, {np.median(apart):.2g} in the median")
    assert 0.0 < apart.max() <= APART
