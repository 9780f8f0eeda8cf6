"""Makes records of a machine with a drag that no library has: `python -m examples.unknown_drag OUT [turns]`.

As `examples/hidden_effect.py`, but the table drags with the square of its speed, 30 N m at its fastest. The truth is
solved by equations of its own (`indexer_experiments.challenge.truth`). docs/how-to/explain.md takes it up as a table.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from examples.hidden_effect import make_records
from indexer_env import Machine, OperatingPoint
from indexer_experiments.challenge.truth import run
from indexer_experiments.challenge.unlisted import NOTHING

DRAG = 4.0
"""N m s²/rad²."""


def with_drag(machine: Machine, point: OperatingPoint, samples: int) -> np.ndarray:
    """Acceleration (samples,) at 1 kHz."""
    return run(machine, point, samples, 1000.0, NOTHING._replace(quadratic=DRAG))[0]


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("error: the folder to write is missing; python -m examples.unknown_drag OUT [turns]")
    make_records(Path(sys.argv[1]), *(float(turns) for turns in sys.argv[2:3]), accelerated=with_drag)
