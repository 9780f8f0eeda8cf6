"""What the level of a record says of the machine."""

from types import SimpleNamespace
from typing import Any

import pytest

from discrepancy.records.likeness import other_stations


@pytest.mark.parametrize(("stations", "level", "said"), [(8, 8.0 / 6.0, "6 stations"), (36, 1.02, "")])
def test_a_level_points_at_other_stations_where_few_numbers_are_near(stations: int, level: float, said: str) -> None:
    """Of 36 stations each level is within 1.5 % of some number's."""
    record: Any = SimpleNamespace(name="a.csv")
    notes = other_stations(record, level, stations)
    assert said in " ".join(notes) and bool(said) == bool(notes)
