"""Where machines are computed: `device` of simulate_batch, of data sets and of the vector environment."""

from __future__ import annotations

import contextlib
import importlib.util
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from indexer_env.errors import ParameterError, refuse

if TYPE_CHECKING:
    from indexer_env.cuda.device import Cuda

CPU = "cpu"
"""The device where none is named."""


def check_device(owner: str, device: object) -> None:
    """Refuse what names no device: "cpu", "cuda" or "cuda:N"; whether there is one, `cuda_of` tells."""
    if not isinstance(device, str) or not re.fullmatch(r"cpu|cuda(:\d{1,3})?", device):
        raise refuse(owner, "device", "cpu, cuda or cuda:N, N the number of a GPU", device)


def cuda_of(owner: str, device: object) -> Cuda | None:
    """The GPU of this name; None for "cpu".

    Raises
    ------
    ParameterError
        No such name; the extra [cuda], the driver, the GPU or a torch that is built for it is not there.
    """
    check_device(owner, device)
    if device == CPU:
        return None
    if importlib.util.find_spec("numba_cuda") is None:
        raise _missing(owner, device, "the package numba-cuda", "pip install 'indexer-diagnosis[cuda]'")
    import torch
    from numba import cuda

    from indexer_env.cuda.device import Cuda
    from indexer_env.cuda.kernels.compiling import SIMULATED

    index = int(str(device).partition(":")[2] or 0)
    if not SIMULATED and not cuda.is_available():
        raise _missing(owner, device, "an NVIDIA GPU with its driver", "use device=cpu")
    if not SIMULATED and not torch.cuda.is_available():
        what = f"a torch that is built for CUDA and not {torch.__version__}"
        raise _missing(owner, device, what, "install torch as its site says for this driver")
    count = 1 if SIMULATED else torch.cuda.device_count()
    if index >= count:
        here = "cuda:0, the one GPU here" if count == 1 else f"cuda:0 to cuda:{count - 1}, the GPUs here"
        raise refuse(owner, "device", here, device)
    return Cuda(index)


def gpu_name() -> str | None:
    """Name of the GPU on which a data set's rows are made again, as data sets have it; None where there is none."""
    with contextlib.suppress(ParameterError):
        gpu = cuda_of("device", "cuda")
        return None if gpu is None else gpu.name
    return None


def on_host(values: Any) -> np.ndarray:
    """A channel as an array of the host, which it is but for a tensor of a GPU."""
    return values if isinstance(values, np.ndarray) else values.cpu().numpy()


def _missing(owner: str, device: object, what: str, remedy: str) -> ParameterError:
    return ParameterError(f"{owner}.device={device} needs {what}, which is not here; {remedy}.")
