"""In place of `indexer_env.kernels.compiling`: device functions of numba's CUDA target, with one lane for a thread.

Multiplications and additions are contracted as that compiler does by default, so numbers differ from the CPU's in the
last bits (docs/explanation/kernel.md). In numba's simulator the functions stay plain Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import config, cuda

LANES = np.uint64(1)
"""A workspace is a thread's own memory, which a GPU lays out so that neighbouring threads read neighbouring words."""

SIMULATED = bool(config.ENABLE_CUDASIM)  # type: ignore[attr-defined]  # read from the environment
"""Whether numba's simulator takes the place of a GPU (NUMBA_ENABLE_CUDASIM=1)."""


def _device_function(**settings: Any) -> Callable[..., Any]:
    return (lambda function: function) if SIMULATED else cuda.jit(device=True, **settings)


scalar = _device_function(forceinline=True)
"""As in `indexer_env.kernels.compiling`, like the three below."""

lanes = _device_function(forceinline=True)

outlined = _device_function()

merged = lanes
