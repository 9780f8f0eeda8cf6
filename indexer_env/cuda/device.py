"""The GPU that a `device` names: arrays on it, and launches of the kernels."""

from __future__ import annotations

import functools
import importlib
import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import torch
from numba import cuda

from indexer_env.cuda.kernels.compiling import SIMULATED
from indexer_env.kernels.layout import LANES

THREADS = 64
"""Threads of a block: with some 255 registers each, four blocks fill a multiprocessor of compute capability 9.0."""


class Buffer(NamedTuple):
    """A tensor on the device, and the same memory as the kernels take it."""

    tensor: torch.Tensor
    view: Any


@dataclass(frozen=True)
class Cuda:
    """One GPU.

    Attributes
    ----------
    index : int
        Its number, as CUDA counts.
    """

    index: int

    @property
    def name(self) -> str:
        """What the GPU is called."""
        return "simulator" if SIMULATED else torch.cuda.get_device_name(self.place)

    @property
    def place(self) -> torch.device:
        """Where its tensors are; under numba's simulator on the CPU."""
        return torch.device("cpu") if SIMULATED else torch.device("cuda", self.index)

    def empty(self, *shape: int, dtype: torch.dtype = torch.float64) -> Buffer:
        """A new array of this shape whose first index is the fastest."""
        tensor = torch.empty(shape[::-1], dtype=dtype, device=self.place).permute(*reversed(range(len(shape))))
        return self.seen(tensor)

    def zeros(self, *shape: int, dtype: torch.dtype = torch.float64) -> Buffer:
        """The same, of zeros."""
        buffer = self.empty(*shape, dtype=dtype)
        buffer.tensor.zero_()
        return buffer

    def put(self, array: np.ndarray) -> Buffer:
        """A copy of an array, its first index the fastest."""
        given = torch.from_numpy(np.array(array.T, order="C", copy=True))
        return self.seen(given.to(self.place).permute(*reversed(range(array.ndim))))

    def index_of(self, items: np.ndarray) -> torch.Tensor:
        """Numbers of items (k,), to index a tensor of the device."""
        return torch.from_numpy(np.ascontiguousarray(items, dtype=np.int64)).to(self.place)

    def seen(self, tensor: torch.Tensor) -> Buffer:
        """A tensor with its view for the kernels, which an empty one has not."""
        if SIMULATED or not tensor.numel():
            return Buffer(tensor, tensor.numpy() if SIMULATED else None)
        with cuda.gpus[self.index]:
            return Buffer(tensor, cuda.as_cuda_array(tensor))

    def wait(self) -> None:
        """Until all that was asked of the GPU is done."""
        if not SIMULATED:
            torch.cuda.synchronize(self.place)

    def launch(self, name: str, count: int, *arguments: Any) -> None:
        """Run a kernel of `kernels.entries` with `count` threads, behind what torch's present stream does already."""
        if not count:
            return
        if SIMULATED:
            kernel(name)[count, 1](*arguments)
            return
        with cuda.gpus[self.index], warnings.catch_warnings():
            # a few machines leave most of a GPU idle, which numba would say each time, in colour or not
            warnings.filterwarnings("ignore", ".*Grid size")
            stream = torch.cuda.current_stream(self.place).cuda_stream
            queue = cuda.external_stream(stream) if stream else 0
            kernel(name)[-(-count // THREADS), THREADS, queue](*arguments)


_capturing = threading.Lock()
"""Held during a capture, of which torch allows one at a time."""


class Series:
    """Launches and tensor operations that are asked for again and again, always on the same memory.

    The first time they run one by one, which compiles and loads what they need. The second time they are captured as a
    CUDA graph, which is replayed from then on: asked for one by one from Python, a launch costs the host 0.2 ms. A
    capture waits for the GPU and empties torch's cache of its memory.

    Parameters
    ----------
    cuda : Cuda
    generator : torch.Generator
        Whatever random numbers they draw come from it.
    """

    def __init__(self, cuda: Cuda, generator: torch.Generator) -> None:
        self._cuda, self._generator = cuda, generator
        self._known = False
        self._graph: torch.cuda.CUDAGraph | None = None

    def run(self, work: Callable[[], object]) -> None:
        """Ask for all of them, behind what torch's present stream does already; `work` asks for them one by one, and
        neither waits for the GPU nor reads from it."""
        if SIMULATED or not self._known:
            work()
            self._known = True
            return
        with torch.cuda.device(self._cuda.place):
            self._graph = self._graph or self._captured(work)
            self._graph.replay()

    def _captured(self, work: Callable[[], object]) -> torch.cuda.CUDAGraph:
        graph = torch.cuda.CUDAGraph()
        graph.register_generator_state(self._generator)
        # torch's own stream for captures is one of the GPU that was first asked for one
        stream = torch.cuda.Stream(self._cuda.place)
        with _capturing, torch.cuda.graph(graph, stream=stream, capture_error_mode="thread_local"):
            work()
        return graph


def rows_of_a_thread(rows: np.ndarray) -> np.ndarray:
    """Rows of the workspace (c,) of a thread, from those of a block of lanes."""
    return np.asarray(rows, np.int64) // int(LANES)


def entries() -> ModuleType:
    """The module `kernels.entries`, whose neighbours are found in two folders, which no static reader sees."""
    return importlib.import_module("indexer_env.cuda.kernels.entries")


_compiling = threading.Lock()


def kernel(name: str) -> Any:
    """A kernel of this name, compiled for its one set of types when it is first asked for."""
    with _compiling:
        return _compiled(name)


@functools.cache
def _compiled(name: str) -> Any:
    source = getattr(entries(), name)
    if SIMULATED:
        return cuda.jit(source)
    # without `lto` all would be compiled once more, and there is nothing to link
    return cuda.jit(entries().SIGNATURES[source], lto=False)(source)
