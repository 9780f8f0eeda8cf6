"""The sensor's radius is that of the records, stated of all of them or of none."""

import numpy as np
import pytest

from discrepancy.records.conditions import Conditions
from discrepancy.records.reading import Record
from discrepancy.subjects.from_config import _with_radius
from indexer_env import Sensor, Signal
from indexer_env.errors import SignalError


def records(*radii: float | None) -> list[Record]:
    signal = Signal(np.zeros(16), 1000.0, unit="m/s^2")
    return [Record(f"{k}.csv", signal, Conditions(150.0, 2.0, sensor_radius=r)) for k, r in enumerate(radii)]


@pytest.mark.parametrize(
    ("radii", "own", "taken"),
    [((0.3, 0.3), None, 0.3), ((None, None), 0.4, 0.4), ((None, None), None, None), ((0.3, None), 0.3, 0.3)],
)
def test_the_radius_is_that_of_all_records(radii: tuple[float | None, ...], own: float | None, taken) -> None:
    assert _with_radius(Sensor(radius=own), records(*radii)).radius == taken


@pytest.mark.parametrize(
    ("radii", "own", "said"),
    [
        ((0.3, 0.4), None, "All records must be taken at one sensor_radius, got 0.3, 0.4 m"),
        ((0.3, None), None, "A sensor_radius must be stated of all records or of none; 1.csv has none."),
        ((0.3, None), 0.4, "got 0.3, 0.4 m"),
    ],
)
def test_records_of_several_radii_are_refused(radii: tuple[float | None, ...], own: float | None, said: str) -> None:
    with pytest.raises(SignalError, match=said):
        _with_radius(Sensor(radius=own), records(*radii))
