"""A case is drawn by seed, half and number alone, and lies in its ranges."""

import dataclasses

import numpy as np
import pytest

from discrepancy.indexer.parameters import UNCERTAINTY
from indexer_env import load_machine
from indexer_env.errors import ParameterError
from indexer_experiments.challenge.laws import LAWS
from indexer_experiments.challenge.messy.disturbances import DISTURBANCES, HALVES
from indexer_experiments.challenge.messy.draw import HIDDEN_SHARES, MessyOrder, messy_draw
from indexer_experiments.challenge.messy.machines import VARIED, drawn_machine
from indexer_experiments.challenge.messy.pieces import FITTED
from indexer_experiments.challenge.parameters import read


def test_case_k_is_the_same_whatever_the_count() -> None:
    for half in HALVES:
        a, b = (messy_draw(MessyOrder(count, 5, half), 3) for count in (4, 400))
        assert a.machines == b.machines and a.records == b.records and a.disturbances == b.disturbances
        assert (a.noise, a.effects, a.hidden, a.above) == (b.noise, b.effects, b.hidden, b.above)


def test_other_seeds_halves_and_numbers_are_other_cases() -> None:
    cases = [
        messy_draw(MessyOrder(9, seed, half), k).noise for seed in (1, 2) for half in HALVES for k in range(3)
    ]  # fmt: skip
    assert len(set(cases)) == 12


def test_halves_draw_their_own_disturbances() -> None:
    """Seed 1, 60 cases each: all kinds of the half and none of the other, 0 to 3 in a case."""
    for half in HALVES:
        drawn = [messy_draw(MessyOrder(60, 1, half), k).disturbances for k in range(60)]
        assert {w.name for one in drawn for w in one} == {k.name for k in DISTURBANCES.values() if k.half == half}
        assert {len(one) for one in drawn} == {0, 1, 2, 3}
        assert all(len({w.name for w in one}) == len(one) for one in drawn)


def test_everything_lies_in_its_range() -> None:
    """Seed 2, 200 cases."""
    drawn = [messy_draw(MessyOrder(200, 2, "tune"), k) for k in range(200)]
    reference = load_machine("reference")
    for d in drawn:
        nominal, truth = d.machines.nominal, d.machines.truth
        assert 0.01 <= d.machines.size <= 100.0
        for name in VARIED:
            factor = read(nominal, name) / read(reference, name) / (1.0 if "backlash" in name else d.machines.size)
            assert 0.75 <= factor <= 1.25
            assert 0.9 <= read(truth, name) / read(nominal, name) <= 1.1
        assert truth.stations == nominal.stations and truth.motion_share == nominal.motion_share
        assert 0.003 <= d.noise <= 0.05 and 0.0 <= d.correlation <= 0.95 and 10 <= d.bits <= 16
        assert 500.0 <= d.rate <= 5000.0 and abs(d.clock) <= 0.003
        assert 1 <= len(d.records) <= 3 and sum(r.turns for r in d.records) >= 2.1
        for record in d.records:
            assert 1.0 <= record.turns <= 3.0 and abs(record.drift) <= 0.005
            assert 0.9 <= record.stated_load / record.point.load_torque <= 1.1
            assert 1.0 <= record.point.load_torque / d.machines.size <= 30.0
        assert sum(r.held_out for r in d.records) <= 1 and not all(r.held_out for r in d.records)
        assert d.disturbed == 0.0 if not d.disturbances else 0.5 <= d.disturbed <= 3.0
        assert d.noise * d.disturbed <= 0.05 + 1e-9 and 3.0 <= d.above <= 8.0
        assert {"drive.speed_ripple", "drive.transmission_error"} - {w.name for w in d.effects}
    assert {d.machines.truth.motion_law.name for d in drawn} == set(LAWS)
    shares = np.bincount([d.hidden for d in drawn]) / len(drawn)
    assert shares == pytest.approx(HIDDEN_SHARES, abs=0.1)
    assert {len(d.records) for d in drawn} == {1, 2, 3}
    assert len({d.machines.truth.stations for d in drawn}) > 4


def test_shapes_follow_the_machine() -> None:
    """Seed 2, 40 cases: bumps in the motion, pulses in the dwell, stations that there are."""
    for k in range(40):
        d = messy_draw(MessyOrder(40, 2, "judge"), k)
        machine, shapes = d.machines.truth, {w.name: w.shape for w in d.effects}
        bump, pulse = shapes["cam.profile_error"], shapes["load.process"]
        assert bump["centre"] - bump["half_width"] > 0.0 and bump["centre"] + bump["half_width"] < machine.motion_share
        assert machine.motion_share < pulse["centre"] - pulse["half_width"]
        assert pulse["centre"] + pulse["half_width"] < 1.0
        assert shapes["cam.station_spacing"]["station"] in range(machine.stations)


def test_sizes_are_independent_of_the_rest() -> None:
    """Seed 6, 300 machines: the factor is log-uniform."""
    sizes = np.log10([drawn_machine(np.random.default_rng(6 + k)).size for k in range(300)])
    assert np.histogram(sizes, 4, (-2.0, 2.0))[0] == pytest.approx(75, abs=25)


def test_what_is_told_as_uncertain_is_what_a_search_fits() -> None:
    assert set(FITTED) == set(UNCERTAINTY)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"half": "all"}, r"challenge\.half must be one of tune, judge, got 'all'"),
        ({"count": 0}, r"challenge\.count must be a whole number >= 1, got 0"),
        ({"limit": 0.0}, r"challenge\.limit must be a finite number > 0 s, got 0\.0"),
    ],
)
def test_a_wrong_order_is_refused(given: dict, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        dataclasses.replace(MessyOrder(1, 0, "tune"), **given)
