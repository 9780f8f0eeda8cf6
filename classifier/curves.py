"""Curves and scores of a training as TensorBoard shows them; needs the extra [tensorboard]."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from classifier.dataset import SUBSETS
from classifier.train import Result
from indexer_env.errors import IndexerError

TENSORBOARD = "tensorboard"
"""Folder of the events."""


def summary_writer() -> type[Any]:
    """PyTorch's writer of events. Raises IndexerError where TensorBoard is not installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ModuleNotFoundError as error:
        if error.name != "tensorboard":
            raise
        remedy = "run: pip install 'indexer-diagnosis[tensorboard]'"
        raise IndexerError(f"tensorboard=true must have the package tensorboard, got none; {remedy}.") from None
    return SummaryWriter


def write_curves(writer: type[Any], folder: Path, result: Result) -> None:
    """Write both errors [%] of the kept network and the range of the control errors of all restarts by epoch, and the
    scores of the kept network by subset at its best epoch."""
    training, kept = result.training, result.kept
    calibration, control = (100 * error for error in result.errors())
    with writer(str(folder)) as events:
        for epoch in range(int(training.epochs[kept]) + 1):
            events.add_scalar("training_mse_percent/calibration", calibration[epoch, kept], epoch)
            events.add_scalar("training_mse_percent/control", control[epoch, kept], epoch)
            events.add_scalar("training_mse_percent/control_best_restart", np.nanmin(control[epoch]), epoch)
        for subset in SUBSETS:
            for name, value in result.score(subset).to_dict().items():
                if isinstance(value, float):
                    events.add_scalar(f"{subset}/{name}", value, int(training.best_epoch[kept]))
