"""Fig. 4: the power spectral density against the plain spectrum, from fine to coarse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes

from classifier.features import Fft
from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.lines import draw_lines, errors_made, performances, ratio
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.settings import ANALYSIS, Training
from indexer_experiments.study.verdicts import Line

CUTS = (100.0, 50.0, 25.0, 12.5, 6.3, 3.1)
RESOLUTIONS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
"""The paper's cuts of the FFT and resolutions of the PSD [Hz], from most to least information."""

FFT_LIMIT, PSD_LIMIT = 12.5, 8.0
"""Last acceptable ones in the paper [Hz]."""

ACCEPTABLE = 1.5
"""Mean error over that with finer features of its kind up to which a resolution or cut is acceptable: ours."""


class Fig4(Claim):
    """Which features, and how many."""

    key: ClassVar[str] = "fig4"
    where: ClassVar[str] = "§4.2, fig. 4"
    title: ClassVar[str] = "The PSD serves better than the FFT"
    says: ClassVar[str] = (
        "The FFT cut at 100 to 3.1 Hz against the PSD at 0.5 to 64 Hz, 100 trainings each: networks on the PSD "
        "perform better, in the mean and at best; the FFT must reach 12.5 Hz, the PSD must resolve 8 Hz."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "Band of the PSD: 100 Hz, since 8 Hz gives the paper's 12 inputs; window and overlap are not printed (Hann, "
        "half).",
        "FFT: amplitudes of the lines above 0 Hz of one whole turn, 102 of them up to 12.5 Hz (the paper: about 100).",
        f"“Acceptable” is not defined: a mean error at most {ACCEPTABLE:g} times that with finer features of its kind.",
        "Compared are the features that the paper calls acceptable: PSD 0.5 to 8 Hz, FFT 100 to 12.5 Hz.",
    )
    settings: ClassVar[tuple[Training, ...]] = ANALYSIS

    def collect(self, lab: Lab, setting: Training) -> Rows:
        """All cuts and all resolutions."""
        fft = [lab.variant(setting, _fft(cut), cut, features=Fft(maximum_hz=cut)) for cut in CUTS]
        psd = [lab.variant(setting, _psd(step), step, features=lab.psd(setting, step)) for step in RESOLUTIONS]
        return lab.trials(setting, [*fft, *psd])

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """PSD against FFT, and where each becomes unacceptable."""
        means, bests = performances(rows), performances(rows, np.min)
        psd = [_psd(step) for step in RESOLUTIONS if step <= PSD_LIMIT]
        fft = [_fft(cut) for cut in CUTS if cut >= FFT_LIMIT]
        hard, best = f"Of both kinds together {errors_made(rows)}.", "The best network of each kind and data set."
        better = "PSD better (below 1)"
        return (
            Line("error on the PSD over that on the FFT, mean", better, ratio(means, psd, fft), hard, high=1.0),
            Line("error on the PSD over that on the FFT, best", better, ratio(bests, psd, fft), best, high=1.0),
            *_limit(means, [_psd(step) for step in RESOLUTIONS], psd),
            *_limit(means, [_fft(cut) for cut in CUTS], fft),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Mean dotted and best solid, as in the paper."""
        (ax,) = axes
        draw_lines(ax, rows, [_psd(step) for step in RESOLUTIONS], "PSD", 0)
        draw_lines(ax, rows, [_fft(cut) for cut in CUTS], "FFT", 4)
        ax.set_xscale("log")
        ticks = (0.5, 1, 2, 4, 8, 16, 32, 64, 3.1, 6.3, 12.5, 25, 50, 100)
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks], rotation=60)
        ax.minorticks_off()
        ax.set_xlabel("resolution of the PSD, cut of the FFT [Hz]")


def _fft(cut: float) -> str:
    return f"FFT to {cut:g} Hz"


def _psd(step: float) -> str:
    return f"PSD at {step:g} Hz"


def _limit(means: dict[str, np.ndarray], names: Sequence[str], good: Sequence[str]) -> tuple[Line, Line]:
    """The last acceptable variant and the next one, each against all better ones."""
    last, beyond = good[-1], names[len(good)]
    order = [f"{name} {float(np.exp(np.mean(np.log(means[name])))):.2g}" for name in (good[0], last, beyond)]
    why = f"Mean errors: {', '.join(order)}."
    return (
        Line(f"error on the {last} over that on finer ones", f"acceptable (below {ACCEPTABLE:g})",
             ratio(means, [last], good[:-1]), why, high=ACCEPTABLE),
        Line(f"error on the {beyond} over that on finer ones", f"not acceptable (above {ACCEPTABLE:g})",
             ratio(means, [beyond], good), why, low=ACCEPTABLE),
    )  # fmt: skip
