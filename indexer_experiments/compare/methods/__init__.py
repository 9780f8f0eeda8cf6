"""Methods under comparison, one file each; all learn from a `Dataset` and give probabilities of its classes.

    base        what a method is
    mlp         the paper's network on PSD features, linear or logarithmic
    logistic    logistic regression on the same features
    boosting    gradient-boosted trees on the same features (scikit-learn)
    decimate    records at a lower rate, for the next two
    kernels     MiniRocket's random convolutions of the record, judged by logistic regression
    cnn         a one-dimensional convolutional network on the record
    own         methods by name, those of a user's own file among them

Every method learns from the calibration subset, chooses its own settings on the control subset, and sees nothing else.
"""

from __future__ import annotations

from classifier.features import Psd
from indexer_experiments.compare.methods.base import Fitted, Method
from indexer_experiments.compare.methods.boosting import Boosting
from indexer_experiments.compare.methods.cnn import Cnn
from indexer_experiments.compare.methods.kernels import MiniRocket
from indexer_experiments.compare.methods.logistic import Logistic
from indexer_experiments.compare.methods.mlp import Paper

__all__ = ["METHODS", "Fitted", "Method"]

_LOG = Psd(scale="log")

METHODS: dict[str, Method] = {
    "mlp": Paper(Psd()),
    "mlp, log": Paper(_LOG),
    "logistic": Logistic(Psd()),
    "logistic, log": Logistic(_LOG),
    "boosting": Boosting(Psd()),
    "MiniRocket": MiniRocket(),
    "CNN": Cnn(),
}
"""Methods by the name under which tables show them; "log": on the logarithms of the densities."""
