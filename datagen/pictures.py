"""A picture of one record and its spectrum, for the data card."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.mlab import psd

from datagen.schema import RECORD
from indexer_records.channels import channels_of

RESOLUTION = 1.0
"""Of the spectrum [Hz]."""

HIGHEST = 200.0
"""End of the spectrum's axis [Hz]: twice what the paper uses (section 4.2)."""


def picture(row: Mapping[str, Any], title: str) -> bytes:
    """PNG of a row's record over time and of its power spectral density (Welch's mean of Hann windows of one second).

    The same row gives the same bytes with the same version of Matplotlib.
    """
    rate, unit = row["sample_rate"], row["unit"].replace("^2", "²")
    # Of several channels the first is shown.
    record = np.asarray(row[RECORD], dtype=float)
    record = record[: len(record) // len(channels_of(row.get("source_channel")))]
    figure = Figure(figsize=(9.0, 4.0))
    FigureCanvasAgg(figure)
    # By hand: a layout engine would measure every text twice, half of the time a picture takes.
    figure.subplots_adjust(left=0.075, right=0.975, bottom=0.13, top=0.92, wspace=0.2)
    over_time, spectrum = figure.subplots(1, 2, width_ratios=(2, 1))
    over_time.plot(np.arange(len(record)) / rate, record, linewidth=0.5, color="#1f4e79")
    over_time.set(xlabel="time [s]", ylabel=f"{row['quantity'].replace('_', ' ')} [{unit}]")
    over_time.margins(x=0.0)
    window = min(len(record), round(rate / RESOLUTION))
    # Matplotlib's and not SciPy's: loading scipy.signal would take longer than all pictures of a data set.
    density, frequency = map(np.asarray, psd(record, window, rate, detrend="mean", noverlap=window // 2))
    spectrum.semilogy(frequency[1:], np.maximum(density[1:], np.finfo(float).tiny), linewidth=0.9, color="#1f4e79")
    spectrum.set(xlabel="frequency [Hz]", ylabel=f"density [({unit})²/Hz]", xlim=(0.0, min(HIGHEST, rate / 2)))
    spectrum.minorticks_off()
    for axes in (over_time, spectrum):
        axes.grid(visible=True, linewidth=0.3, color="#bbbbbb")
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title, fontsize=10)
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=110, metadata={"Software": None})
    return out.getvalue()
