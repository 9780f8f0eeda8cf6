"""Flat tops of a quantiser and of a limit."""

import numpy as np
import pytest

from indexer_records.quality import is_clipped, quality_columns


def quantised(values: np.ndarray, bits: int) -> np.ndarray:
    step = 2.2 * np.abs(values).max() / 2**bits
    return step * np.round(values / step)


def peaks(noise: float) -> np.ndarray:
    """An index of half a cam turn, ringing, 16 times at 4 kHz; seed 3."""
    t = np.tile(np.arange(2000) / 2000.0, 16)
    move = np.where(t < 0.5, np.sin(4.0 * np.pi * t), 0.1 * np.exp(-8.0 * (t - 0.5)) * np.sin(60.0 * np.pi * t))
    return move + noise * np.random.default_rng(3).standard_normal(t.size)


@pytest.mark.parametrize("bits", [10, 12, 16])
@pytest.mark.parametrize("limit", [None, 0.8, 0.97])
@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_a_limit_is_told_from_the_top_of_a_quantised_peak(bits: int, limit: float | None, noise: float) -> None:
    values = peaks(noise)
    if limit is not None:
        values = np.clip(values, -limit, limit)
    record = quantised(values, bits)
    share = quality_columns(record[None])[0]["clipped_share"]
    assert is_clipped(record, share, 2e-3) == (limit is not None)


def test_a_quantiser_of_few_bits_holds_peaks_for_long() -> None:
    assert quality_columns(quantised(peaks(0.0), 10)[None])[0]["clipped_share"] > 2e-3


def test_a_record_of_two_values_is_cut_at_both() -> None:
    assert is_clipped(np.repeat([-1.0, 1.0, -1.0], 100), 1.0, 2e-3)
