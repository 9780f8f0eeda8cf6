"""All inertias, stiffnesses, dampings and loads times one factor leave the motion and so the search the same. Seed 41.

A search sees nothing of a model but its residuals as a function of scaled coordinates, and the bounds, priors and
starts in these: where they are the same, so is all that is found.
"""

import dataclasses

import numpy as np
import pytest

from discrepancy import Criteria, explain
from discrepancy.estimates import estimates_of
from discrepancy.fit import fit
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.indexer.parameters import changed, read, torque_power
from discrepancy.jobs import Jobs
from discrepancy.model import NONE
from discrepancy.problem import Problem
from indexer_env import OperatingPoint, Signal, make_effect
from indexer_env.machine import Machine

FACTORS = (1e-3, 1e3)
EXACT = (2.0**-10, 2.0**10)
"""Powers of two round nothing, so that even a motion that is chaotic, as it sticks and slips, stays the same."""
SCALED = (
    "table_inertia", "cam_inertia", "follower_inertia", "housing_inertia", "motor_inertia",
    *(f"{joint}_joint.{field}" for joint in ("input", "output", "base") for field in ("stiffness", "damping")),
)  # fmt: skip


def scaled_machine(machine: Machine, factor: float) -> Machine:
    return changed(machine, {name: read(machine, name) * factor for name in SCALED})


def scaled_record(experiment: Experiment, factor: float) -> Experiment:
    point = experiment.operating_point
    point = OperatingPoint(point.motor_speed, point.load_torque * factor, point.start_angle)
    return dataclasses.replace(experiment, operating_point=point)


def scaled(model: IndexerModel, factor: float) -> IndexerModel:
    records = [scaled_record(e, factor) for e in model.experiments]
    return IndexerModel(scaled_machine(model.machine, factor), records)


@pytest.mark.parametrize("factor", EXACT)
def test_a_search_sees_the_same_of_a_machine_of_any_size(records, factor: float) -> None:
    model, _, _ = records(41)
    other = scaled(model, factor)
    pairs = list(zip(model.hypotheses().items(), other.hypotheses().items(), strict=True))
    assert len(pairs) > 20
    rng = np.random.default_rng(41)
    for (name, mine), (_, its) in pairs:
        for one, two in zip(mine, its, strict=True):
            assert one.fixed == two.fixed and one.name == two.name
            starts = [np.array([h.coordinates(start) for start in h.starts]) for h in (one, two)]
            assert starts[1] == pytest.approx(starts[0], rel=1e-9, abs=1e-9), name
            bounds = [[p.bounds for p in m.parameters + h.parameters] for m, h in ((model, one), (other, two))]
            assert np.array(bounds[1]) == pytest.approx(np.array(bounds[0]), rel=1e-9, abs=1e-9), name
            known = [[p.known for p in m.parameters + h.parameters] for m, h in ((model, one), (other, two))]
            assert known[0] == known[1]
        hypothesis = mine[-1]
        start = starts[0][rng.integers(len(starts[0]))]
        z = np.concatenate([0.3 * rng.standard_normal(len(model.parameters)), start])
        windows = np.arange(3)
        states = 0.3 * rng.standard_normal((3, model.local_count(hypothesis)))
        jobs = Jobs(z[None], 0 * windows, windows, states)
        left = model.residuals(hypothesis, jobs)
        assert other.residuals(its[-1], jobs) == pytest.approx(left, rel=1e-9, abs=1e-9 * np.abs(left).max()), name


def test_units_of_torque_are_the_ones_that_grow() -> None:
    """A parameter that the factor would leave as it is, though its unit holds a torque, would be told here."""
    units = ("N m/rad", "N m s/rad", "kg m²", "N m", "rad/(N m)", "rad", "-", "s")
    assert [torque_power(unit) for unit in units] == [1, 1, 1, 1, -1, 0, 0, 0]


@pytest.mark.slow
def test_findings_are_those_of_a_machine_of_any_size(records) -> None:
    """Seed 11: 80 N m s/rad of viscous friction, and the machine a thousand times smaller and larger."""
    model, held_out, _ = records(11, 0.0, make_effect("friction.viscous", coefficient=80.0))
    found = []
    for factor in (1.0, *FACTORS):
        answer = explain(scaled(model, factor), scaled(held_out, factor), Criteria(rivals=1))
        (finding,) = answer.findings
        size = finding.effects[0].parameters[0].value / factor
        found.append((answer.verdict, finding.name, finding.grade, pytest.approx(size, rel=0.02)))
    assert found[0] == found[1] == found[2]


def test_a_signal_of_any_size_is_no_other_machine(records) -> None:
    """Noise is stated or estimated in the record's own numbers, so nothing about it is in SI either."""
    model, _, _ = records(41)
    first = model.experiments[0]
    assert first.noise_level == pytest.approx(0.015 * first.signal.values.std(), rel=0.2)
    small = dataclasses.replace(first, signal=Signal(first.signal.values * 1e-3, 1000.0, unit="rad/s^2"))
    assert small.noise_level == pytest.approx(1e-3 * first.noise_level)


def test_records_tell_nothing_of_the_common_scale(records) -> None:
    """The information along it is below a hundredth of the priors' there; one-sided differences of 1e-3 make it 0.3."""
    model, _, truth = records(41)
    problem = Problem(model, NONE)
    z = np.array([0.0 if p.of_record else p.coordinate(read(truth, p.name)) for p in model.parameters])
    place = fit(problem, problem.searched(problem.point(z, np.zeros((len(model.counts), 4)))), steps=6).place
    moved = [torque_power(p.unit) or p.name.endswith(".load") for p in model.parameters]
    scale = np.array([1.0 / p.scale if own else 0.0 for p, own in zip(model.parameters, moved, strict=True)])
    assert scale @ estimates_of(model, place).information @ scale < 0.01 * scale @ (problem.precision * scale)
