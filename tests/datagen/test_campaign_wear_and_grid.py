"""The families wear and grid: plays along a life and turns that remain, every combination so many times."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from datagen.campaign import build
from datagen.campaigns.wear import play_after
from datagen.produce import produce
from indexer_env.errors import ParameterError
from tests.datagen.families import SHORT, items_of, made, ordered


def test_play_grows_as_its_differential_equation_says():
    """dg/dn = a + b g with the two constants that the ends and the speed-up fix, solved by DOP853."""
    first, last, speed_up, life = 0.01, 0.35, 4.0, 5e6
    b = math.log(speed_up) / life
    a = b * (last - first) / (speed_up - 1.0) - b * first
    solved = solve_ivp(lambda n, g: a + b * g, (0.0, life), [first], "DOP853", rtol=1e-10, max_step=life / 50)
    assert solved.y[0, -1] == pytest.approx(last, rel=1e-8)
    for n, g in zip(solved.t, solved.y[0], strict=True):
        assert play_after(n / life, first, last, speed_up) == pytest.approx(g, rel=1e-8)
    assert (a + b * last) / (a + b * first) == pytest.approx(speed_up)
    assert play_after(0.5, 1.0, 3.0, 1.0) == 2.0


def test_a_life_runs_from_its_first_backlash_to_failure():
    order = ordered("campaign=wear", "campaign.lives=4", "campaign.records_per_life=6", *SHORT)
    items = items_of(order)
    plays = np.degrees([item.faults["backlash"] for item in items]).reshape(4, 6)
    left = np.array([item.label.remaining_turns for item in items]).reshape(4, 6)
    assert (np.diff(plays) > 0.0).all() and plays[:, 0].max() <= 1.0 and plays[:, -1] == pytest.approx(20.0)
    assert (left[:, -1] == 0).all() and (left[:, 0] >= 1e6).all() and (left[:, 0] <= 1e7).all()
    assert np.ptp(np.diff(left), axis=1).max() <= 1
    assert len(set(left[:, 0])) == 4 and len({item.machine["output_joint.stiffness"] for item in items}) == 4
    assert [item.label.machine_draw for item in items] == [life for life in range(4) for _ in range(6)]
    rows, _ = made(order, [0, 5])
    assert [row["remaining_turns"] for row in rows] == [left[0, 0], 0]


def test_listed_turns_beyond_a_life_are_rejected():
    turns = ["campaign.records_per_life=null", "campaign.turns=[0,3000000]", "campaign.lives=10"]
    order = ordered("campaign=wear", *turns, *SHORT)
    rows, _, rejected = produce(order, items_of(order))
    assert len(rows) + len(rejected) == 20 and 0 < len(rejected) < 10
    assert all("which this machine lives, got 3000000." in row["reason"] for row in rejected)
    assert {row["remaining_turns"] > 0 for row in rows} == {True}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("campaign.turns=[5]", "campaign.turns must be given where records_per_life is null"),
        (
            "campaign.last_backlash_deg=200",
            "campaign.last_backlash_deg must be a finite number >= 0 and <= 114.592 deg at the motor shaft, got 200",
        ),
        (
            "campaign.last_backlash_deg=0.5",
            "campaign.last_backlash_deg must be a law that lies above first_backlash_deg",
        ),
        ("+campaign.speed_up={normal:[2,1]}", "{'uniform': [1, 5], 'normal': [2, 1]}; keep one law."),
        ("~campaign.speed_up +campaign.speed_up={normal:[2,1]}", "campaign.speed_up must be a finite number >= 1e-06"),
        (
            "~campaign.life_turns +campaign.life_turns={around:0.1}",
            "campaign.life_turns must be a law other than sobol and",
        ),
        ("+campaign.draws.faults.backlash={uniform:[0,1]}", "as the campaign wear decides it"),
    ],
)
def test_a_life_that_cannot_be(change, said):
    with pytest.raises(ParameterError) as caught:
        ordered("campaign=wear", *change.split(" "), *SHORT)
    assert said in str(caught.value)


# ---------------------------------------------------------------------------------------------- grid


def test_a_grid_has_every_combination_so_many_times():
    axes = ["+campaign.axes.faults.roller=[intact,cracked]", "+campaign.axes.machine.table_inertia=[4,5,6]"]
    order = ordered(*axes, "campaign.repeats=2", "sensor.noise_density=0.01", *SHORT)
    items = items_of(order)
    cells = Counter((item.faults["roller_crack"], item.machine["table_inertia"]) for item in items)
    assert order.count == 12 and set(cells.values()) == {2}
    assert set(cells) == {(crack, inertia) for crack in (0.0, 0.4) for inertia in (4, 5, 6)}
    assert {item.label.number for item in items} == {1, 5}
    # three machines in each repeat, whatever their faults
    for item in items:
        machine = [4, 5, 6].index(item.machine["table_inertia"])
        assert item.label.machine_draw == 3 * (item.index // 6) + machine


def test_the_default_grid_is_the_machine_as_configured(base):
    order = ordered("faults.backlash_deg=10", "faults.roller=cracked", *SHORT)
    (item,) = items_of(order)
    case = build(item, order.base)
    assert case.machine == dataclasses.replace(order.base.faults, cracked_station=None).applied_to(base.machine)
    assert math.degrees(case.faults.backlash) == pytest.approx(10.0) and case.faults.roller_crack == 0.4
    assert (item.label.number, item.label.code) == (6, "101")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("+campaign.axes.machine.table_inertia=[4,4]", "a list of different values"),
        ("+campaign.axes.machine.table_inertia={uniform:[4,5]}", "a list of values, got {uniform: [4.0, 5.0]}"),
        ("+campaign.axes.run.samples=[4,5]", "campaign.axes.key must be one of machine, operating_point"),
        (
            "+campaign.axes.faults.backlash_deg=[0,5] +campaign.draws.faults.backlash_deg={uniform:[0,1]}",
            "left out or {around: share}, as the campaign grid decides it",
        ),
        ("campaign.repeats=0", "campaign.repeats must be a whole number >= 1"),
    ],
)
def test_a_grid_that_cannot_be(change, said):
    with pytest.raises(ParameterError) as caught:
        ordered(*change.split(" "), *SHORT)
    assert said in str(caught.value)
