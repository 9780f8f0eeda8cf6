"""Makes records of a machine with a drag that no library has: `python -m examples.unknown_drag OUT [turns]`.

As `examples/hidden_effect.py`, but the table drags with the square of its speed, 30 N m at its fastest. The truth is
solved by equations of its own (`indexer_experiments.challenge.truth`). docs/how-to/explain.md takes it up as a table.
"""

from __future__ import annotations

import numpy as np

from examples.hidden_effect import make_records, typed
from indexer_env import Machine, OperatingPoint
from indexer_experiments.challenge.truth import run
from indexer_experiments.challenge.unlisted import NOTHING

DRAG = 4.0
"""N m s²/rad²."""


def with_drag(machine: Machine, point: OperatingPoint, samples: int) -> np.ndarray:
    """Acceleration (samples,) at 1 kHz."""
    return run(machine, point, samples, 1000.0, NOTHING._replace(quadratic=DRAG))[0]


if __name__ == "__main__":
    make_records(*typed("python -m examples.unknown_drag OUT [turns]"), accelerated=with_drag)
