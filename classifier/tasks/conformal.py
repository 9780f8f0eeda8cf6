"""Split conformal intervals: half-widths that cover a stated share of new records, whatever the errors' law."""

from __future__ import annotations

import math

import numpy as np

from indexer_env.checks import check_number
from indexer_env.errors import refuse


def least_records(coverage: float) -> int:
    """Fewest held-out records with which a finite interval can promise a coverage in (0, 1): 9 for 90 %."""
    return math.ceil(coverage / (1.0 - coverage) - 1e-9)


def conformal_quantile(scores: np.ndarray, coverage: float, units: np.ndarray | None = None) -> float:
    """The score that a share `coverage` of new records stays below, from the scores (n,) of held-out records.

        q = the ⌈(n + 1) · coverage⌉-th smallest score

    units (n,) labels records that hang together, such as those of one machine. Then q is for a record of a new unit:
    the smallest score with Σ_units (share of the unit's scores at or below q) >= (k + 1) · coverage for k units.

    A new record whose score is exchangeable with these lies at or below q with a probability of at least `coverage`,
    and at most coverage + 1/(n + 1) where no two scores are equal. That is an average over records and over draws of
    the held-out ones; it is no promise for each kind of record.
    Source: V. Vovk, A. Gammerman, G. Shafer, Algorithmic Learning in a Random World (2005); J. Lei et al., J. Am. Stat.
    Assoc. 113 (2018) 1094–1111, theorem 2.2; R. Dunn, L. Wasserman, A. Ramdas, J. Am. Stat. Assoc. 118 (2023)
    2491–2502, for units (their pooled distribution functions).

    Raises ParameterError for a coverage outside (0, 1) and for fewer than `least_records(coverage)` scores or units.
    """
    check_number("conformal_quantile", "coverage", coverage, low=0.0, high=1.0, low_open=True, high_open=True)
    labels = np.arange(len(scores)) if units is None else np.asarray(units)
    _, unit, sizes = np.unique(labels, return_inverse=True, return_counts=True)
    least = least_records(coverage)
    if len(sizes) < least:
        rule = f"at least {least} held-out records or units for a coverage of {coverage:g}"
        raise refuse("conformal_quantile", "scores", rule, len(sizes), "use more records")
    order = np.argsort(scores, kind="stable")
    reached = np.cumsum(1.0 / sizes[unit[order]])
    return float(scores[order][np.searchsorted(reached, (len(sizes) + 1) * coverage - 1e-9)])
