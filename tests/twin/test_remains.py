"""What healthy records leave: a fixed part, and noise that follows speed and load."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pytest
import torch

from indexer_env import OperatingPoint
from indexer_env.units import RPM
from tests.twin.builders import CELLS, NOISE, healthy, record, synthesis, view
from twin.data import Turns
from twin.learn import Feed
from twin.remains import Remains, remains_of
from twin.report.figures import remains as drawn
from twin.turns import shift_shapes
from twin.work import Work

SLOW, FAST = OperatingPoint(1200.0 * RPM, 2.0), OperatingPoint(1500.0 * RPM, 20.0)


def test_chance_is_not_learned_by_heart_but_structure_is():
    sound, point = healthy(), OperatingPoint(1350.0 * RPM, 5.0)
    reference = sound.turn(point)
    rng = np.random.default_rng(0)
    shape = np.sin(np.linspace(0.0, 40.0, CELLS.count)) * np.ones((8, 1))
    for size, kept in ((0.0, 0.1), (3.0, 0.95)):
        turns = reference + NOISE * (size * shape + rng.standard_normal((3, 8, CELLS.count)))
        left = remains_of([turns], [point], 0.002, sound)
        assert left.sigma(point) == pytest.approx(NOISE, rel=0.1)
        share = left.fixed[0].std() / NOISE
        assert share < kept if size == 0.0 else share > kept * size * shape.std()


@pytest.mark.parametrize("common", [True, False])
def test_what_records_leave_is_the_machines_as_far_as_they_share_it(common: bool):
    """All records leave one shape, the faster the more of it; or each leaves one of its own."""
    sound = healthy()
    points = [OperatingPoint(rpm * RPM, 5.0) for rpm in (1200.0, 1350.0, 1500.0)]
    rng = np.random.default_rng(0)
    steps = np.linspace(0.0, 40.0, CELLS.count) * np.ones((8, 1))
    shapes = [NOISE * (4.0 + k) * np.sin(steps if common else (1.0 + k) * steps + k) for k in range(3)]
    noise = 0.01 * rng.standard_normal((3, 2, 8, CELLS.count))
    turns = [sound.turn(p) + shape + part for p, shape, part in zip(points, shapes, noise, strict=True)]
    left = remains_of(turns, points, 0.002, sound)
    assert left.shared > 0.95 if common else left.shared < 0.15
    size = [float(np.sqrt((left.at(p) ** 2).mean()) / NOISE) for p in points]
    assert size[0] < size[1] < size[2] if common else max(size) < 0.6
    np.testing.assert_allclose(left.shared * left.parts(points[1]).sum(axis=0), left.at(points[1]))


def test_the_residual_of_a_single_record_is_taken_as_it_is():
    sound, point = healthy(), OperatingPoint(1350.0 * RPM, 5.0)
    turns = sound.turn(point) + NOISE * 3.0 * np.sin(np.linspace(0.0, 40.0, CELLS.count)) * np.ones((2, 8, 1))
    left = remains_of([turns], [point], 0.002, sound)
    assert left.shared == 1.0
    np.testing.assert_allclose(left.at(point), left.fixed[0])


@pytest.mark.parametrize("count", [2, 3, 6])
def test_what_stations_differ_by_is_kept_and_the_noise_is_what_it_was(count: int):
    """A pattern of ten times the noise that is the same in each turn; seed 1."""
    sound, rng = healthy(), np.random.default_rng(1)
    pattern = 10.0 * NOISE * rng.standard_normal((8, CELLS.count))
    noise = NOISE * rng.standard_normal((count, 8, CELLS.count))
    left = remains_of([sound.turn(FAST) + pattern + noise], [FAST], 1e-6, sound)
    own, wanted = (one - one.mean(axis=0) for one in (left.fixed[0], pattern))
    assert (own * wanted).sum() / (wanted**2).sum() > 0.9
    assert left.sigma(FAST) == pytest.approx(NOISE, rel=0.1)


def test_noise_of_which_nothing_is_fixed_is_as_large_as_it_is():
    """Two turns; seed 2."""
    sound, rng = healthy(), np.random.default_rng(2)
    left = remains_of([sound.turn(FAST) + NOISE * rng.standard_normal((2, 8, CELLS.count))], [FAST], 1e-6, sound)
    assert left.sigma(FAST) == pytest.approx(NOISE, rel=0.05)
    assert np.sqrt((left.spectrum**2).mean() / CELLS.count) == pytest.approx(1.0, rel=0.05), "over its own size"


def test_noise_beside_what_all_stations_share_is_as_large_as_it_is():
    """Of one turn its mean takes a share of the noise; the mean of ten, seeds 0 to 9."""
    sound, pattern = healthy(), 10.0 * NOISE * np.sin(np.linspace(0.0, 40.0, CELLS.count))
    found = []
    for seed in range(10):
        noise = NOISE * np.random.default_rng(seed).standard_normal((1, 8, CELLS.count))
        found.append(remains_of([sound.turn(FAST) + pattern + noise], [FAST], 1e-6, sound).sigma(FAST))
    assert np.mean(found) == pytest.approx(NOISE, rel=0.02)


def measured(point: OperatingPoint, turns: float, noise: float, rng: np.random.Generator) -> np.ndarray:
    """Turns of a record whose samples have white noise."""
    signal, told = record(rpm=point.motor_speed / RPM, load=point.load_torque, turns=turns)
    values = signal.values + noise * rng.standard_normal(len(signal.values))
    return CELLS.turns(values, healthy().machine.reduction * point.motor_speed, told.start_angle)


def left_of(points: Sequence[OperatingPoint], noises: Sequence[float], rng: np.random.Generator) -> Remains:
    sound = healthy()
    turns = [measured(point, 12.1, noise, rng) for point, noise in zip(points, noises, strict=True)]
    return remains_of(turns, points, 0.002, sound)


def test_a_turn_is_as_noisy_at_every_speed():
    """In units of the noise: of white noise a cell averages fewer samples at the higher speed. Seed 3."""
    rng = np.random.default_rng(3)
    seen = dataclasses.replace(view(), remains=left_of((SLOW, FAST), (0.5, 0.5), rng))
    middle = OperatingPoint(1350.0 * RPM, 11.0)
    for point in (SLOW, middle, FAST):
        reference = healthy().turn(point)
        x = [seen.measured(turn - reference, reference, point) for turn in measured(point, 8.1, 0.5, rng)]
        assert np.sqrt(np.mean(np.square(x))) == pytest.approx(1.0, abs=0.03), point


def test_noise_follows_the_load_of_the_records_that_show_it():
    """The loaded record is twice as noisy; seed 4."""
    left = left_of((SLOW, FAST), (0.3, 0.6), np.random.default_rng(4))
    for point, own in zip((SLOW, FAST), left.sigmas, strict=True):
        assert left.sigma(point) == pytest.approx(own, rel=0.1)
    between = [left.sigma(OperatingPoint(1350.0 * RPM, load)) for load in np.linspace(2.0, 20.0, 7)]
    assert left.sigma(SLOW) < between[0] and (np.diff(between) > 0.0).all() and between[-1] < left.sigma(FAST)
    assert drawn(left).startswith("<svg")


def test_noise_follows_the_load_at_a_speed_that_is_nearly_the_recorded_one():
    """All records at 1500 rpm; 1503 rpm is the same speed, and not one far from all of them."""
    loads, levels = (2.0, 11.0, 20.0), (0.1, 0.2, 0.3)
    left = rows(*((OperatingPoint(1500.0 * RPM, load), 0.0, level) for load, level in zip(loads, levels, strict=True)))
    for load in loads:
        here, beside = (left.sigma(OperatingPoint(rpm * RPM, load)) for rpm in (1500.0, 1503.0))
        assert beside == pytest.approx(here, rel=0.03)


def test_networks_see_noise_of_one_size_at_all_operating_points():
    """No shift and nothing fixed: of nothing, noise is seen. Seed 5."""
    left = left_of((SLOW, FAST), (0.3, 0.6), np.random.default_rng(5))
    seen = dataclasses.replace(view(), remains=dataclasses.replace(left, fixed=0.0 * left.fixed), shift=1e-9)
    none, zeros = np.full(400, -1), np.zeros((400, 1), dtype=np.float32)
    at, points = np.repeat([0, 1], 200), [SLOW, FAST]
    nothing = np.zeros((400, 8, CELLS.count), dtype=np.float32)
    feed = Feed(Turns(nothing, at, zeros, zeros != 0.0, none, at, points, healthy().turns(points)), seen)
    x, _ = feed.noisy(torch.arange(400), torch.Generator().manual_seed(0))
    for place in (0, 1):
        assert float(x[at == place].square().mean().sqrt()) == pytest.approx(1.0, abs=0.03)


def test_networks_see_turns_and_residuals_in_units_of_the_noise_there():
    left = rows((SLOW, 4.0, 0.01), (FAST, 5.0, 0.02))
    none, zeros, points = np.full(2, -1), np.zeros((2, 1), dtype=np.float32), [SLOW, FAST]
    sigma = np.array([left.sigma(point) for point in points])
    x = np.ones((2, 8, CELLS.count), dtype=np.float32)
    turns = Turns(x, np.arange(2), zeros, zeros != 0.0, none, none, points, healthy().turns(points))
    feed = Feed(turns, dataclasses.replace(view(), remains=left))
    for k, point in enumerate(points):
        np.testing.assert_allclose(feed.x[k], x[k] / sigma[k], rtol=1e-5)
        np.testing.assert_allclose(feed.parts[k], left.parts(point) / sigma[k], rtol=1e-5)
        wanted = shift_shapes(healthy().turn(point), view().shift) / sigma[k]
        np.testing.assert_allclose(feed.shapes[k], wanted, rtol=0.0, atol=1e-3 * np.abs(wanted).max())


def test_turns_are_fitted_in_units_of_the_noise_there():
    """A crack at two operating points, one twice as noisy; no shift."""
    plain = dataclasses.replace(synthesis(("crack",)), shapes=lambda turns, sigma=1.0: np.zeros((2, 8, CELLS.count)))
    made = []
    for sigma in (lambda point: 1.0, lambda point: 0.1 if point is SLOW else 0.2):
        of = dataclasses.replace(plain, sigma=sigma)
        nothing = np.zeros((2, of.components.count))
        work = Work(of, nothing, [SLOW, FAST], np.ones((2, 1), dtype=bool), np.zeros(2, dtype=int))
        made.append(work.simulated(np.full((2, 1), 0.5), np.arange(2)))
    np.testing.assert_allclose(made[1] * np.array([0.1, 0.2])[:, None, None], made[0], rtol=1e-6)


def rows(*given: tuple[OperatingPoint, float, float]) -> Remains:
    """Remains of records (point, fixed part, level), each fixed part the same in all cells."""
    at = np.array([(point.motor_speed, point.load_torque) for point, *_ in given])
    fixed = np.array([np.full((8, CELLS.count), size) for _, size, _ in given])
    return Remains(at, fixed, np.array([level for *_, level in given]), view().remains.spectrum)


def test_what_earlier_records_left_stays_where_there_is_no_newer_one():
    """Of two speeds one is recorded again; alone it would be the residual of all speeds, in full."""
    old, new = rows((SLOW, 4.0, 0.1), (FAST, 5.0, 0.2)), rows((SLOW, 4.0, 0.1))
    both = new.with_those_of(old)
    np.testing.assert_allclose(both.at(FAST), old.at(FAST))
    assert both.sigma(FAST) == pytest.approx(old.sigma(FAST)) and len(both.points) == 2
    again = both.with_those_of(both)
    assert len(again.points) == 2, "each record has a newer one"
    other = rows((OperatingPoint(1202.0 * RPM, 2.0), 1.0, 0.3)).with_those_of(old)
    assert other.fixed[:, 0, 0].tolist() == [1.0, 5.0]


def test_what_is_left_is_stored_and_comes_back():
    left = rows((SLOW, 4.0, 0.1), (FAST, 5.0, 0.2))
    back = Remains.restore(left.arrays())
    for field in dataclasses.fields(Remains):
        np.testing.assert_allclose(getattr(back, field.name), getattr(left, field.name))
