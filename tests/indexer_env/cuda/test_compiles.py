"""Every kernel compiles to PTX for an H100, which takes libraries of NVIDIA's but no GPU and no driver."""

import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from numba import cuda

import indexer_env
from indexer_env.cuda.device import entries
from tests.kept import kept

H100 = (9, 0)
PACKAGE = Path(indexer_env.__file__).parent
SOURCES = [path for folder in ("kernels", "cuda") for path in (PACKAGE / folder).rglob("*.py")]
KERNELS = {kernel.__name__: kernel for kernel in entries().SIGNATURES}


@pytest.fixture(autouse=True)
def no_gpu_is_asked(monkeypatch):
    """numba asks the present GPU what to compile device functions for."""
    gpu = SimpleNamespace(compute_capability=H100)
    monkeypatch.setattr("numba.cuda.dispatcher.get_current_device", lambda: gpu)


def ptx_of(name: str, *, optimised: bool) -> str:
    def compiled() -> str:
        kernel = KERNELS[name]
        signature = entries().SIGNATURES[kernel]
        ptx, _ = cuda.compile(
            kernel, signature.args, device=False, abi="numba", cc=H100, output="ptx", opt=optimised
        )  # fmt: skip
        return ptx.decode() if isinstance(ptx, bytes) else ptx

    return kept(f"{name}-{optimised}", Path(__file__), SOURCES, compiled)


def check(ptx: str, name: str) -> None:
    assert re.search(r"^\.target sm_90", ptx, re.MULTILINE) and re.search(rf"\.visible \.entry \w*{name}", ptx)
    assert not re.search(r"\.extern \.func", ptx), "a function is left open"
    assert not re.search(r"\b(add|sub|mul|fma|div|sqrt)[\w.]*\.f32|\b(div|sqrt)\.approx", ptx), "not all is in doubles"


@pytest.mark.parametrize("name", [name for name in KERNELS if name != "advance"])
def test_a_kernel_compiles(name):
    check(ptx_of(name, optimised=True), name)


def test_the_integrator_compiles():
    """Without optimisation, which takes far longer and adds nothing to what is checked here."""
    check(ptx_of("advance", optimised=False), "advance")


@pytest.mark.slow
def test_the_integrator_compiles_as_it_runs():
    ptx = ptx_of("advance", optimised=True)
    check(ptx, "advance")
    assert "fma.rn.f64" in ptx


def test_all_kernels_are_listed():
    functions = {
        name for name, value in vars(entries()).items() if getattr(value, "__module__", "") == entries().__name__
    }
    assert functions == set(KERNELS)
