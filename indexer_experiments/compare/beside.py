"""Every method beside one of them, seed by seed: which of them differ by more than the scatter of the seeds.

Of many differences some lie beyond their 95 % intervals by chance. So a method is called better or worse only where
Student's t of its differences says so at 5 % after Holm's correction over all m rows of the table (Scand. J. Stat. 6
(1979) 65): of p-values in rising order the k-th becomes the largest of (m - j + 1) p_j, j <= k.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import stats

from classifier.results import CONFIDENCE, Row, differences, mean
from indexer_experiments.tables import table

_ALIKE = 1e-12
"""Standard deviation over mean up to which values do not scatter, beside rounding."""

SAID = (
    "± is the 95 % interval of one difference over the seeds; it holds nothing but what each seed draws anew. Better "
    "and worse: by Student's t with Holm's correction over all rows; –: not shown either way."
)


def beside(rows: Sequence[Row], metric: str, reference: str) -> str:
    """The table, in Markdown, of a metric that is the better the lower it is; empty without other methods."""
    values: dict[tuple[str, str], list[float]] = {}
    for row in differences(rows, metric, reference):
        values.setdefault((row.data, row.method), []).append(row.value)
    if not values:
        return ""
    lines = []
    for (data, method), p in zip(values, holm([_p_value(own) for own in values.values()]), strict=True):
        found = mean(values[data, method])
        told = "–" if not p < 1.0 - CONFIDENCE else "better" if found.value < 0.0 else "worse"
        lines.append((data, method, found.text(2), "–" if np.isnan(p) else f"{p:.2g}", told))
    return table(["data", "method", f"{metric} minus {reference}", "p (Holm)", "at 5 %"], lines) + f"\n\n{SAID}\n"


def holm(p: Sequence[float]) -> np.ndarray:
    """p-values as corrected for their number; one that is NaN counts among them and stays what it is."""
    given = np.asarray(p, float)
    order = np.argsort(given)
    found = np.empty(len(given))
    found[order] = np.minimum(1.0, np.maximum.accumulate(given[order] * np.arange(len(given), 0, -1)))
    return found


def _p_value(values: Sequence[float]) -> float:
    """Two-sided, that the mean is 0; NaN where one seed or none scatters."""
    centre, spread = float(np.mean(values)), float(np.std(values))
    if len(values) < 2 or not spread > _ALIKE * abs(centre):
        return float("nan")
    found: Any = stats.ttest_1samp(values, 0.0)
    return float(found.pvalue)
