"""Make a row's record again from its own columns, bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from datagen.rows import remade
from datagen.seeds import Part, stream
from indexer_env.simulate import simulate


def remake(row: Mapping[str, Any]) -> np.ndarray:
    """Simulate and sense the record of a row anew.

    Parameters
    ----------
    row : mapping
        The columns of `datagen.schema`, e.g. `Records.row(index)`; its record is not looked at.

    Returns
    -------
    numpy.ndarray, shape (samples,), float32
        Equal to the row's record in every bit when the versions named in the row made it, on the same kind of
        processor.
    """
    made = remade(row)
    trajectory = simulate(made.machine, made.operating_point, made.run)
    noise = stream(made.seed, Part.SENSOR, made.item)
    signal = made.sensor.read(trajectory.table_acceleration, trajectory.sample_rate, noise)
    return signal.values.astype(np.float32)
