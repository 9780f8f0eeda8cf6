"""Shares and their intervals."""

import pytest

from indexer_experiments.tables import wilson


def test_interval_of_a_share_is_wilsons() -> None:
    """Newcombe, Statist. Med. 17 (1998) 857, table I: 81 of 263 gives 0.2553 to 0.3662, 0 of 20 up to 0.1611."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
