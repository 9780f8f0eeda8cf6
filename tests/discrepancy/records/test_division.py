"""The part of each record that is held out sees the stations that the fitted part sees."""

import dataclasses
import math

import numpy as np
import pytest

from discrepancy.indexer.windows import Experiment, windows_of
from discrepancy.records.division import divided
from indexer_env import OperatingPoint, Signal
from indexer_env.units import RPM

RATE = 1000.0


@pytest.mark.parametrize(
    ("turns", "shares", "by_both"),
    [
        ((2.3,), (0.5,), 8),
        ((3.4,), (2 / 3,), 8),
        ((1.4, 1.4), (0.5, 0.5), 8),
    ],
)
def test_both_parts_see_as_many_stations_as_they_can(turns: tuple, shares: tuple, by_both: int, nominal) -> None:
    """Records of table turns of 8 stations, all from one station on: the last third of 2.3 turns leaves stations out,
    a half does not; of two short records one part is the end and one the beginning."""
    length = 2.0 * math.pi * nominal.stations / (1500.0 * RPM * nominal.reduction)
    made = [
        Experiment(Signal(np.zeros(round(RATE * length * t)), RATE), OperatingPoint(1500.0 * RPM, 2.0, 1.3), noise=1.0)
        for t in turns
    ]
    parts = divided(made, nominal)
    found = [len(one.signal.values) / len(whole.signal.values) for one, whole in zip(parts[0], made, strict=True)]
    assert found == pytest.approx(shares, abs=0.01)
    stations = [set(windows_of(part, nominal.reduction).turn % nominal.stations) for part in parts]
    assert len(stations[0] & stations[1]) == by_both


def test_what_is_known_of_a_part_allows_for_the_drift(nominal) -> None:
    """A record of 12 cam turns whose speed falls by 0.3 % over it: the angle and the mean speeds that its parts have
    lie within a standard deviation or so, and far outside what is known of the whole record."""
    mean, drift, whole = 1500.0 * RPM, -3e-3, 12.0 * 2.0 * math.pi
    rate = nominal.reduction * mean
    record = Experiment(
        Signal(np.zeros(round(RATE * whole / rate)), RATE), OperatingPoint(mean, 2.0, 1.3), noise=1.0,
        drift_uncertainty=abs(drift),
    )  # fmt: skip
    (fitted,), (held,) = divided([record], nominal)
    end, cut = record.signal.duration, fitted.signal.duration
    turned = rate * (cut + drift * (cut**2 / (2.0 * end) - cut / 2.0))
    off = 1.3 + turned - held.operating_point.start_angle
    assert 0.9 < off / held.start_uncertainty < 1.01 and off > 10.0 * record.start_uncertainty
    assert fitted.start_uncertainty == record.start_uncertainty
    slower = (turned / cut) / rate - 1.0
    faster = ((rate * end - turned) / (end - cut)) / rate - 1.0
    for part, differs in ((fitted, slower), (held, faster)):
        assert 0.9 < abs(differs) / part.speed_uncertainty < 1.01
        assert part.drift_uncertainty == pytest.approx(abs(drift) * part.signal.duration / end, rel=1e-3)


@pytest.mark.parametrize("stations", [2, 3])
def test_both_parts_have_cam_turns_enough_where_stations_are_few(stations: int, nominal) -> None:
    """Of ten cam turns a third holds three whole ones, which are too few, though it shows every station."""
    machine = dataclasses.replace(nominal, stations=stations)
    length = 10.0 * 2.0 * math.pi / (1500.0 * RPM * machine.reduction)
    record = Experiment(Signal(np.zeros(round(RATE * length)), RATE), OperatingPoint(1500.0 * RPM, 2.0, 1.3), noise=1.0)
    parts = divided([record], machine)
    assert all(len(windows_of(part, machine.reduction).turn) >= 4 for part in parts)
