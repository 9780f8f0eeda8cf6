"""Shares and their intervals."""

import pytest

from indexer_experiments.tables import grouped, share_of_groups, wilson


def test_interval_of_a_share_is_wilsons() -> None:
    """Newcombe, Statist. Med. 17 (1998) 857, table I: 81 of 263 gives 0.2553 to 0.3662, 0 of 20 up to 0.1611."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)


def test_an_interval_is_as_wide_as_groups_differ() -> None:
    alike, apart = [[True] + [False] * 9] * 10, [[True] * 10] + [[False] * 10] * 9
    (low, high), (other_low, other_high) = grouped(alike), grouped(apart)
    assert (low, high) == pytest.approx(wilson(10, 100))
    assert other_low == 0.0 and other_high > high
    assert grouped([[False] * 50])[1] == pytest.approx(wilson(0, 50)[1])
    assert grouped([]) == grouped([[]]) == (0.0, 1.0)
    assert share_of_groups([[True, True], [], [False]])[0] == "2 of 3 (66.7 %)"
    assert share_of_groups([[]]) == ("no case", "–")
