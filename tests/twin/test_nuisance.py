"""The machine's own parameters beside the sizes of faults."""

from __future__ import annotations

import dataclasses

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.campaigns.own import LOAD_FACTOR
from discrepancy.indexer.machines import Machines
from discrepancy.model import NONE
from indexer_env import OperatingPoint, Sensor, make_effect
from indexer_env.coefficients import coefficients
from indexer_env.units import RPM
from tests.twin.builders import CELLS, MACHINE, healthy, record, synthesis, view
from twin.faults import FAULTS
from twin.nuisance import Nuisance
from twin.posterior import simulated
from twin.refine import fitted
from twin.synthesis import effect_of

POINT = OperatingPoint(1400.0 * RPM, 5.0)
RUBBING = MACHINE.with_effects(make_effect("friction.coulomb", torque=5.0))


@pytest.fixture
def draws(tmp_path):
    """Stiffness and inertia that go together, friction, load, gain, and a station that is known."""
    rng = np.random.default_rng(0)
    common, own = rng.standard_normal((2, 4000))
    k, J = MACHINE.output_joint.stiffness, MACHINE.table_inertia
    columns = {
        "machine.output_joint.stiffness": k * (1.0 + 0.03 * common),
        "machine.table_inertia": J * (1.0 + 0.02 * common + 0.02 * own),
        "effects.friction.coulomb.torque": 5.0 + 0.2 * rng.standard_normal(4000),
        "effects.cam.station_spacing.station": np.full(4000, 3.0),
        LOAD_FACTOR: 1.0 + 0.1 * rng.standard_normal(4000),
        "sensor.gain": 1.0 + 0.01 * rng.standard_normal(4000),
    }
    pq.write_table(pa.table(columns), tmp_path / "posterior.parquet")
    return columns, Nuisance.of(tmp_path / "posterior.parquet")


def test_coordinates_have_the_law_of_the_draws_and_what_is_known_has_none(draws):
    columns, nuisance = draws
    assert nuisance.count == 5 and "effects.cam.station_spacing.station" not in nuisance.paths
    rng, found = np.random.default_rng(1), []
    for z in rng.standard_normal((3000, 5)):
        machine, sensor, factor = nuisance.at(z, RUBBING, Sensor(), 1.0)
        found.append((machine.output_joint.stiffness, machine.table_inertia, machine.effects[0].torque,
                      factor, sensor.gain))  # fmt: skip
    drawn = np.column_stack([columns[path] for path in nuisance.paths])
    np.testing.assert_allclose(np.std(found, axis=0), drawn.std(axis=0), rtol=0.1)
    np.testing.assert_allclose(np.corrcoef(np.transpose(found)), np.corrcoef(drawn.T), atol=0.08)


def test_nothing_moved_is_the_twins_machine_and_nothing_leaves_the_draws_range(draws):
    columns, nuisance = draws
    assert nuisance.at(np.zeros(5), RUBBING, Sensor(), 1.02) == (RUBBING, Sensor(), 1.02)
    machine, _, _ = nuisance.at(np.full(5, 50.0), RUBBING, Sensor(), 1.0)
    drawn = columns["machine.output_joint.stiffness"]
    assert drawn.min() <= machine.output_joint.stiffness <= drawn.max()


def test_a_fit_by_discrepancy_knows_the_same(draws):
    """Its machine, sensor and loads at coordinates are those of the nuisance. Seed 2."""
    _, nuisance = draws
    together = nuisance.together(1.05)
    machines = Machines(RUBBING, Sensor(), together.parameters, (), together)
    points = 0.5 * np.random.default_rng(2).standard_normal((20, 5))
    for z, (item, sensor) in zip(points, machines.coefficients(NONE, points), strict=True):
        machine, read, factor = nuisance.at(z, RUBBING, Sensor(), 1.05)
        found, also_read = machines.at(NONE, z)
        assert sensor.gain == pytest.approx(read.gain) and also_read == sensor
        expected = coefficients(machine, OperatingPoint(load_torque=factor / 1.05))
        np.testing.assert_allclose(item.row, expected.row, rtol=1e-12)
        same = coefficients(found, OperatingPoint(load_torque=factor / 1.05))
        np.testing.assert_allclose(item.row, same.row, rtol=1e-12)


def test_no_number_leaves_the_range_of_the_draws(draws):
    """A damping that is hardly known stays above nothing, wherever the twin's machine stands in the draws."""
    random, joint = np.random.default_rng(6), MACHINE.output_joint
    known = {"machine.output_joint.damping": joint.damping * np.exp(0.8 * random.standard_normal(2000))}
    together = Nuisance.of_draws(known).together(1.0)
    machines = Machines(MACHINE, Sensor(), together.parameters, (), together)
    found = [machines.at(NONE, np.array([u]))[0].output_joint.damping for u in (-3.0, 3.0)]
    (drawn,) = known.values()
    assert found == pytest.approx([drawn.min(), min(joint.damping + 3.0 * drawn.std(), drawn.max())], rel=1e-3)


def test_a_gain_that_was_found_may_be_off_to_either_side():
    """6 % found, known to 1 %: the fit goes as far down as up from there."""
    z = np.random.default_rng(3).standard_normal(4000)
    drawn = simulated({"effects.sensor.gain.error": np.full(8000, 0.06), "sensor.gain": 1.0 + 0.01 * np.r_[z, -z]})
    together = Nuisance.of_draws(drawn).together(1.0)
    machines = Machines(MACHINE, Sensor(gain=1.06), together.parameters, (), together)
    low, high = (machines.at(NONE, np.array([u]))[1].gain for u in (-3.0, 3.0))
    assert high - 1.06 == pytest.approx(1.06 - low, abs=1e-9) and high - low > 0.06


def test_what_is_hardly_known_stays_above_nothing_in_a_fit_too():
    """A damping that is known to a factor, at its median: the mean of the draws lies far above."""
    joint, normal = MACHINE.output_joint, np.random.default_rng(6).standard_normal(2000)
    drawn = joint.damping * np.exp(0.8 * normal)
    nuisance = Nuisance.of_draws({"machine.output_joint.damping": drawn})
    found = [nuisance.at(np.array([z]), MACHINE, Sensor(), 1.0)[0].output_joint.damping for z in (-20.0, 20.0)]
    assert found == pytest.approx([drawn.min(), drawn.max()])


def test_the_load_of_a_single_turn_is_one_more_coordinate(draws, tmp_path):
    common, own = draws[1], Nuisance.of(tmp_path / "posterior.parquet", 0.02)
    assert own.count == common.count + 1
    z = np.zeros(own.count)
    z[-1] = 2.0
    machine, sensor, factor = own.at(z, RUBBING, Sensor(), 1.0)
    assert (machine, sensor) == (RUBBING, Sensor()) and factor == pytest.approx(1.04)
    # by itself, where the posterior leaves the loads' common factor or anything else not open
    pq.write_table(pa.table({"sensor.gain": [1.0, 1.0]}), tmp_path / "known.parquet")
    alone = Nuisance.of(tmp_path / "known.parquet", 0.02)
    assert alone.count == 1 and alone.at(np.array([-1.0]), RUBBING, Sensor(), 1.0)[2] == pytest.approx(0.98)
    assert alone.at(np.array([-9.0]), RUBBING, Sensor(), 1.0)[2] == pytest.approx(0.94)


def test_a_size_is_found_although_the_machine_is_not_quite_the_twins(draws):
    """Known to 3 % and off by 5 %: the machine is fitted beside the size."""
    nuisance = draws[1]
    joint = MACHINE.output_joint
    soft = dataclasses.replace(MACHINE, output_joint=dataclasses.replace(joint, stiffness=0.95 * joint.stiffness))
    signal, stated = record(soft.with_effects(effect_of(FAULTS["loose_base"], 0.3, MACHINE, 0.0, 0)))
    (found,) = CELLS.turns(signal.values, MACHINE.reduction * stated.motor_speed, 3.0)
    x = view().measured(found - healthy().turn(POINT), healthy().turn(POINT), POINT)[None]
    x = x + np.random.default_rng(0).standard_normal(x.shape)
    said = {"faults": np.array([[2.0, 3.0, -9.0]]), "size": np.array([[0.1, 0.4, 0.2]])}
    known = synthesis()
    without = fitted(known, x, [POINT], said)
    free = fitted(dataclasses.replace(known, nuisance=_of_this_machine(nuisance)), x, [POINT], said)
    assert free.left[0] < 0.4 * without.left[0]
    assert free.size[0, 1] == pytest.approx(0.3, abs=0.02) and abs(without.size[0, 1] - 0.3) > 0.02
    assert free.error[0, 0] > without.error[0, 0]


def _of_this_machine(nuisance: Nuisance) -> Nuisance:
    """Without the friction that the machine of these tests lacks."""
    kept = [k for k, path in enumerate(nuisance.paths) if not path.startswith("effects")]
    rows = (nuisance.axes, nuisance.low, nuisance.high)
    return Nuisance(tuple(nuisance.paths[k] for k in kept), *(row[kept] for row in rows))
