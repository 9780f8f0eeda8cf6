"""A sensor read block by block on a GPU: `indexer_env.sensor_stream` with tensors."""

from __future__ import annotations

import math

import numpy as np
import torch

from indexer_env.cuda.device import Cuda
from indexer_env.sensor_stream import SensorStream
from indexer_env.sensors import Sensor


class StreamOnCuda:
    """Reads `rows` accelerations side by side on a GPU, each started anew on its own.

    Readings are those of `SensorStream`, but for the noise, which a generator of the device draws for all rows at once:
    its numbers are not those of the rows' own generators, and depend on what was read before.

    Parameters
    ----------
    cuda : Cuda
    sensor : Sensor
    sample_rate : float
        [Hz].
    rows : int

    Attributes
    ----------
    plain : bool
        As of `SensorStream`.
    generator : torch.Generator
        Of the noise.

    Raises
    ------
    ParameterError
        As `SensorStream`.
    """

    def __init__(self, cuda: Cuda, sensor: Sensor, sample_rate: float, rows: int) -> None:
        host = SensorStream(sensor, sample_rate, 0)
        self.plain = host.plain
        self._cuda, self._sensor, self._rate = cuda, sensor, float(sample_rate)
        self._sections, self._rest = cuda.put(host.sections), cuda.put(host.rest)
        self._states = cuda.zeros(rows, *host.rest.shape)
        self._read = torch.zeros(rows, dtype=torch.int64, device=cuda.place)
        self._order = cuda.put(np.arange(rows))
        self._sigma = sensor.noise_density * math.sqrt(sample_rate / 2.0)
        self.generator = torch.Generator(device=cuda.place)

    def seed(self, seed: int) -> None:
        """Start the noise anew."""
        self.generator.manual_seed(seed % 2**63)

    def start(self, index: torch.Tensor, first: torch.Tensor) -> None:
        """Start rows `index` (k,) anew, as if their first acceleration `first` (k,) [rad/s²] had lasted for ever."""
        y = first * self._sensor.scale
        self._states.tensor[index] = self._rest.tensor * y[:, None, None]
        self._read[index] = 0

    def read(self, index: torch.Tensor | slice, block: torch.Tensor) -> torch.Tensor:
        """Readings (k, m) of the next m accelerations (k, m) [rad/s²] of rows `index`."""
        order = self._order if isinstance(index, slice) else self._cuda.seen(index)
        y = self._cuda.empty(*block.shape)
        y.tensor[:] = block * self._sensor.scale
        if len(self._sections.tensor):
            self._cuda.launch("chain", len(block), order.view, self._sections.view, self._states.view, y.view)
        samples = self._read[index, None] + torch.arange(block.shape[1], device=self._cuda.place)
        time = samples.to(torch.float64) / self._rate
        self._read[index] += block.shape[1]
        read = self._sensor.with_background(y.tensor, time, torch.sin)
        if self._sigma > 0.0:
            noise = torch.empty(read.shape, dtype=read.dtype, device=read.device).normal_(generator=self.generator)
            read = read + self._sigma * noise
        return self._sensor.recorded(read)
