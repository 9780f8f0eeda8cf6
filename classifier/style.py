"""The one style of all pictures of this package."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib

# Okabe and Ito's, told apart by colour-blind readers too; black and grey are kept for what is no class.
COLOURS = ("#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#8A7A00")
GREY, DARK = "0.75", "0.25"
_STYLE: Any = {
    "figure.dpi": 130,
    "savefig.dpi": 130,
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "0.9",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.0,
}


@contextmanager
def style() -> Iterator[None]:
    """Figures made inside have the style."""
    with matplotlib.rc_context(_STYLE):
        yield
