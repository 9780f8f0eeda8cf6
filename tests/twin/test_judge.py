"""Thresholds, detection sizes, the check, and what a twin says of a turn."""

from __future__ import annotations

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from indexer_env import OperatingPoint
from indexer_env.errors import ParameterError
from indexer_env.units import RPM
from tests.twin.builders import CELLS, JUDGE, MACHINE, RANGE, WEIGHTS, Fixed, healthy, record, synthesis, view
from twin.check import checked
from twin.data import Turns
from twin.detection import Seen, points_of, size_at, worst
from twin.diagnosis import FAULTY, HEALTHY, NOT_COMPARABLE, UNKNOWN
from twin.faults import FAULTS
from twin.judge import Judge, judge_of
from twin.learn import Feed, Sight, said, trained
from twin.network import NETWORKS, Modes
from twin.twin import Twin
from twin.weigh import Weights

NAMES = tuple(FAULTS)


def turns(count: int, seed: int, *, faulty: bool) -> Turns:
    """Turns whose one fault is a wave of its own order, as large as its size says."""
    rng = np.random.default_rng(seed)
    size = np.zeros((count, 2), dtype=np.float32)
    if faulty:
        size[np.arange(count), rng.integers(0, 2, count)] = rng.uniform(0.05, 1.0, count)
    cam = np.linspace(0.0, 2.0 * np.pi, CELLS.count, endpoint=False)
    waves = np.stack([np.sin(5.0 * cam), np.sin(11.0 * cam)])
    x = np.repeat((size @ waves)[:, None], 8, axis=1).astype(np.float32)
    subset = (np.arange(count) % 4 == 0).astype(int)
    point = OperatingPoint(1350.0 * RPM, 10.0)
    reference = healthy().turn(point)[None]
    none = np.full(count, -1)
    return Turns(x, np.zeros(count, int), size, size != 0.0, none, subset, [point], reference)


@pytest.fixture(scope="module")
def taught() -> tuple[Any, Turns, Turns, Judge]:
    torch.set_num_threads(1)
    both = [turns(400, 1, faulty=True), turns(120, 2, faulty=False)]
    mixed = Turns(*(
        np.concatenate([getattr(part, name) for part in both])
        for name in ("x", "point", "size", "there", "station", "subset")
    ), both[0].points, both[0].reference)  # fmt: skip
    network = trained("modes", mixed, view(), epochs=20, seed=0)
    control, sound = turns(300, 3, faulty=True), turns(300, 4, faulty=False)
    judge = judge_of([network], control, sound, view(), false_alarms=0.05, coverage=0.9, seed=0)
    return network, control, sound, judge


@pytest.mark.parametrize("epochs", [1, 10])
def test_a_network_learns_in_as_few_steps_as_it_is_given(epochs: int) -> None:
    """Ten steps are those of which a tenth is one."""
    few = turns(40, 7, faulty=True)
    assert not trained("modes", few, view(), epochs=epochs, seed=0).training


def test_a_shift_moves_what_a_fault_does_to_a_turn_that_is_learned_from():
    part = turns(40, 5, faulty=True)
    feed, rows = Feed(part, view()), torch.arange(40)
    cells, step = CELLS.count, 0.002
    cam = 2.0 * np.pi * np.arange(cells) / cells
    waves = np.stack([5.0 * np.cos(5.0 * cam), 11.0 * np.cos(11.0 * cam)])
    wanted = step * np.repeat((part.size @ waves)[:, None], 8, axis=1) / view().noise
    found = feed.shifts(rows)[:, 0].numpy()
    away = np.abs(found - wanted).reshape(40, -1).max(axis=1)
    assert (away < 0.5 * np.abs(wanted).reshape(40, -1).max(axis=1)).all()
    healthy_rows = turns(10, 6, faulty=False)
    assert np.abs(Feed(healthy_rows, view()).shifts(torch.arange(10)).numpy()).max() == 0.0


def told(network: Any, part: Turns, seed: int) -> dict[str, np.ndarray]:
    x, conditions = Feed(part, view()).noisy(torch.arange(len(part.x)), torch.Generator().manual_seed(seed))
    return said(network, x, conditions)


def test_false_alarms_come_at_the_stated_rate_and_faults_are_named(taught):
    network, control, sound, judge = taught
    assert 0.01 < (told(network, sound, 9)["any"] > judge.alarm).mean() < 0.1
    large = control.size.max(axis=1) > 0.3
    found = told(network, control, 9)
    assert (found["any"][large] > judge.alarm).mean() > 0.97
    assert (found["faults"][large].argmax(axis=1) == control.size[large].argmax(axis=1)).mean() > 0.97


def test_intervals_of_sizes_hold_the_stated_share(taught):
    network, _, _, judge = taught
    other = turns(400, 7, faulty=True)
    found = told(network, other, 8)
    for fault in range(2):
        mine = other.there[:, fault] & (found["faults"][:, fault] > 0.0)
        missed = np.abs(found["size"][mine, fault] - other.size[mine, fault])
        inside = missed <= judge.reach[fault, 0] * np.exp(found["spread"][mine, fault])
        assert 0.8 < inside.mean() < 0.98


def test_a_network_of_modes_sees_noise_added_and_paired_draws_keep_its_law():
    generator = torch.Generator().manual_seed(0)
    feed, network = Feed(turns(64, 5, faulty=True), view()), Modes(2, CELLS.count, 8)
    rows = torch.arange(64)
    network.fit(feed.clean(rows))
    noise = feed.noise(feed.point[rows], generator)
    both = network.sees(feed.clean(rows)) + network.sees(noise)
    torch.testing.assert_close(network.sees(feed.clean(rows) + noise), both, atol=1e-3, rtol=1e-3)
    sight = Sight(network, feed, rows, generator)
    drawn = torch.cat([sight.at(rows) - sight.seen for _ in range(40)])
    fresh = torch.cat([network.sees(feed.noise(feed.point[rows], generator)) for _ in range(40)])
    assert float((drawn.var(dim=0) / fresh.var(dim=0)).mean()) == pytest.approx(1.0, rel=0.05)


def test_looks_at_one_turn_hang_together_where_thresholds_are_taken(monkeypatch):
    """Of 20 turns one always looks faulty: of 80 looks taken apart, the 76th would be the alarm for 1 of 16."""
    sound, control = turns(20, 4, faulty=False), turns(20, 3, faulty=True)
    rng = np.random.default_rng(0)

    def looked(networks, part, view, rows, seed, looks=4):
        row = np.tile(rows, looks)
        told = {"any": np.where(row == 7, 9.0, 0.0) + 1e-3 * rng.random(len(row))}
        told |= {"faults": part.there[row].astype(float), "size": part.size[row], "spread": np.zeros((len(row), 2))}
        return told, row

    monkeypatch.setattr("twin.judge.looked_at", looked)
    with pytest.raises(ParameterError, match="at least 49 held-out records or units"):
        judge_of([], control, sound, view(), false_alarms=0.02, coverage=0.9, seed=0)
    judge = judge_of([], control, sound, view(), false_alarms=1 / 16, coverage=0.9, seed=0)
    assert judge.alarm > 9.0


def test_a_judge_is_stored_and_comes_back(taught):
    judge = taught[3]
    assert Judge.restore(judge.plain()).plain() == judge.plain()


def test_a_turn_may_begin_at_any_station():
    network = Modes(3, 64, 8).eval()
    x = torch.randn((2, 8, 64), generator=torch.Generator().manual_seed(0))
    conditions = torch.zeros((2, 2))
    with torch.no_grad():
        one, other = network(x, conditions), network(torch.roll(x, 3, dims=1), conditions)
    torch.testing.assert_close(one.faults, other.faults, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(torch.roll(one.station, 3, dims=1), other.station, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("kind", sorted(NETWORKS))
def test_every_network_says_what_is_asked_of_it(kind):
    found = said(NETWORKS[kind](3, 64, 8).eval(), torch.randn(5, 8, 64), torch.zeros((5, 2)))
    assert found["faults"].shape == found["size"].shape == (5, 3) and found["any"].shape == (5,)


def test_the_smallest_size_is_where_the_power_is_reached():
    rng = np.random.default_rng(0)
    logs = rng.uniform(np.log(3e-3), 0.0, 4000)
    chance = 1.0 / (1.0 + np.exp(-4.0 * (logs - np.log(0.05))))
    found = size_at(logs, rng.random(4000) < chance, 0.95)
    assert found == pytest.approx(0.05 * np.exp(np.log(19.0) / 4.0), rel=0.1)
    assert size_at(logs, np.zeros(4000, dtype=bool), 0.95) is None


def test_the_worst_operating_point_says_what_matters():
    rows = [Seen("crack", rpm, 2.0, size, None, "%") for rpm, size in ((1200.0, 0.1), (1500.0, 0.02))]
    assert worst(rows, "crack") == 0.1
    unseen = Seen("crack", 1350.0, 2.0, None, None, "%")
    assert worst([*rows, unseen], "crack") == 0.1, "what is not seen at one point still matters where it is"
    assert worst([unseen], "crack") == 0.0


def test_a_range_that_is_one_point_is_looked_at_once():
    assert len(points_of((1500.0, 1500.0), (2.0, 2.0))) == 1
    assert len(points_of((1200.0, 1500.0), (2.0, 20.0))) == 5


def checked_with(
    network: Fixed, offset: float = 0.0, own: bool = False, weights: Weights = WEIGHTS, stations_known: bool = True
):
    point = OperatingPoint(1400.0 * RPM, 5.0)
    turn = healthy().turn(point) + offset
    return checked(
        [turn[None]], [point], ["a.csv"], healthy(), view(), [network], JUDGE, synthesis(), weights, 0.01, own,
        stations_known,
    )  # fmt: skip


def test_each_way_to_fail_the_check_has_its_sentence():
    sound = [-3.0] * 10
    assert checked_with(Fixed(-5.0, sound)).trusted
    assert "None of the records held out" in checked_with(Fixed(-5.0, sound), own=True).reason
    assert "are called faulty" in checked_with(Fixed(5.0, sound)).reason
    assert "like none of the simulated" in checked_with(Fixed(-5.0, sound), offset=0.3).reason
    easy = dataclasses.replace(WEIGHTS, quiet=8000.0, quiet_mean=8000.0)
    off = checked_with(Fixed(-5.0, sound), offset=0.3, weights=easy)
    assert (
        not off.trusted and "from its prediction by 2.9 times the noise" in off.reason and "stations" not in off.reason
    )
    unknown = checked_with(Fixed(-5.0, sound), offset=0.3, weights=easy, stations_known=False)
    assert "record a once-per-turn pulse" in unknown.reason


def test_an_alarm_and_a_novel_turn_by_chance_are_two_turns_and_the_caution_stays(monkeypatch):
    class Odd(Weights):
        def oddness(self, left: np.ndarray, *, stations_known: bool) -> np.ndarray:
            return np.where(np.arange(len(left)) == 1, 2.0, 0.5)

    point, any_fault = OperatingPoint(1400.0 * RPM, 5.0), np.where(np.arange(10) == 0, 5.0, -5.0)
    monkeypatch.setattr("twin.check.ensemble", lambda networks, x, conditions: {"any": any_fault})
    given = [healthy().turn(point)[None].repeat(10, axis=0)], [point], ["a.csv"], healthy(), view(), [], JUDGE
    found = checked(*given, synthesis(), Odd(**vars(WEIGHTS)), 0.01, True, True)
    assert found.trusted and "8 of 10 healthy turns that were fitted come out healthy" in found.reason
    assert "None of the records held out" in found.reason


def twin(network: Fixed, alone: bool = True) -> Twin:
    about = {
        "settings": {"faults": list(NAMES), "matters": {"reducer_play": 12.0}, "coverage": 0.9}, "range": RANGE,
        "detection": [{"fault": n, "motor_speed_rpm": 1400.0, "load_torque": 5.0, "size": 0.2, "told": 1.0, "unit": ""}
                      for n in NAMES],
    }  # fmt: skip
    sound = healthy()
    return Twin(
        Path("twin"),
        about,
        MACHINE,
        sound.sensor,
        view(),
        (network,),
        JUDGE,
        sound,
        None if alone else synthesis(NAMES),
        WEIGHTS,
    )


def test_the_verdicts_on_a_turn():
    quiet = [-3.0] * 10
    loud = [3.0 if name in ("crack", "reducer_play") else -3.0 for name in NAMES]
    given = record()
    assert twin(Fixed(-1.0, quiet)).diagnose_turn(*given).verdict == HEALTHY
    found = twin(Fixed(1.0, loud)).diagnose_turn(*given)
    assert found.verdict == FAULTY and {one.name for one in found.faults} == {"crack", "reducer_play"}
    # size 0.5 of the largest: 30 % of the stiffness, 10° of play where 12° matter
    by_name = {one.name: one for one in found.faults}
    assert by_name["crack"].size == pytest.approx(30.0) and by_name["crack"].matters
    assert by_name["reducer_play"].size == pytest.approx(10.0) and not by_name["reducer_play"].matters
    assert by_name["crack"].low < 30.0 < by_name["crack"].high
    slight = twin(Fixed(1.0, quiet))
    vars(slight)["matters"] = dict.fromkeys(NAMES, 0.6)
    near = slight.diagnose_turn(*given)
    assert (near.verdict, near.faults) == (HEALTHY, ()) and near.reason.endswith(", 5 %, too small to matter")
    assert len(near.unnamed) == len(NAMES) and not any(one.matters for one in near.unnamed)
    none = twin(Fixed(1.0, quiet)).diagnose_turn(*given)
    assert none.verdict == UNKNOWN and none.faults == () and none.reason.endswith(", 5 %")
    short = twin(Fixed(1.0, quiet)).diagnose_turn(*record(turns=0.5))
    assert short.verdict == NOT_COMPARABLE and "whole turn" in short.reason


class Slow(Modes):
    """A network that takes its time before its first weights are drawn."""

    def __init__(self, *given: Any) -> None:
        time.sleep(0.05)
        super().__init__(*given)


def test_networks_taught_side_by_side_are_those_taught_one_after_the_other(monkeypatch):
    """The generator of first weights is one for all threads."""
    monkeypatch.setitem(NETWORKS, "slow", Slow)
    few = turns(40, 6, faulty=True)

    def first(seed: int) -> torch.Tensor:
        return next(iter(trained("slow", few, view(), epochs=1, seed=seed).layers[1].parameters())).detach()

    with ThreadPoolExecutor(2) as pool:
        beside = list(pool.map(first, (0, 1)))
    for seed, weights in enumerate(beside):
        torch.testing.assert_close(weights, first(seed))
