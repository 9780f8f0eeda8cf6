"""Dead and clipped sensors, low rates and too few turns are refused."""

import numpy as np
import pytest

from discrepancy.records.quality import check_records
from indexer_env.errors import SignalError


def spoiled(values: np.ndarray, how: str) -> np.ndarray:
    if how == "dead":
        return np.where(np.arange(len(values)) // 1000 == 4, 0.3, values)
    top = 8.0 if how == "clipped" else 0.05 * np.abs(values).max()
    return np.clip(values, -top, top)


@pytest.mark.parametrize(
    ("how", "said"),
    [("dead", "got one value for 1 s on end"), ("clipped", "at flat tops"), ("clipped for long", "at flat tops")],
)
def test_a_spoiled_sensor_is_refused(record, nominal, values, how: str, said: str) -> None:
    with pytest.raises(SignalError, match=said):
        check_records([record(half) for half in np.array_split(spoiled(values, how), 2)], nominal)


def test_fewer_than_two_turns_in_all_are_refused(record, nominal, values) -> None:
    with pytest.raises(SignalError, match=r"two turns|2 turns of the table or more in all, got 1\.22"):
        check_records([record(values[:10000])], nominal)
    check_records([record(values[:10000]), record(values[10000:])], nominal)


def test_slow_records_need_their_noise(record, nominal, values) -> None:
    with pytest.raises(SignalError, match=r"noise must be stated for records sampled below 200 Hz, .* got 125 Hz"):
        check_records([record(values[::8], rate=125.0)], nominal)
    check_records([record(values[::8], rate=125.0, noise=0.1)], nominal)
    check_records([record(values[::5], rate=200.0)], nominal)
    with pytest.raises(SignalError, match=r"got 125 Hz and none in run\.csv"):
        check_records([record(), record(values[::8], rate=125.0)], nominal)


def test_a_rate_too_low_for_the_vibration_is_refused(record, nominal, values) -> None:
    with pytest.raises(SignalError, match=r"must be sampled at 100 Hz or more, got 50 Hz in run\.csv"):
        check_records([record(values[::20], rate=50.0)], nominal)
