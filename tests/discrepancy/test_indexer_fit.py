"""The base model is found on machines with and without play: noise floor reached, parameters near the truth."""

import dataclasses
import math
import re
from typing import Any, cast

import numpy as np
import pytest

from discrepancy.criteria import Criteria
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.indexer.parameters import changed, read
from discrepancy.model import NONE
from discrepancy.search import Search
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env import OperatingPoint, Run, Signal, load_machine, simulate
from indexer_env.units import RPM


@pytest.mark.parametrize(("play_factor", "level"), [(0.0, 1.02), (1.0, 1.05), (23.0, 1.05)])
def test_calibration_reaches_the_noise_floor(records, play_factor: float, level: float) -> None:
    """Seed 5; no play, the healthy 2′ and 20° at the motor shaft: one start, and stiffness over inertia within 3 %."""
    model, _, truth = records(5, play_factor)
    search = Search(model, Criteria())
    base = search.fits.fit(search.fits.begun.place).place
    assert math.sqrt(base.squares.sum() / model.counts.sum()) < level
    values = model.values(NONE, base.z)
    found = values["output_joint.stiffness"] / values["table_inertia"]
    assert found == pytest.approx(read(truth, "output_joint.stiffness") / truth.table_inertia, rel=0.03)


def test_at_the_truth_windows_alone_reach_the_noise_floor(records) -> None:
    """Seed 6: with the true parameters only start states are unknown, so a window restarted in the dwell is enough."""
    from discrepancy.problem import Problem

    model, _, truth = records(6)
    problem = Problem(model, NONE)
    z = np.array([0.0 if p.of_record else p.coordinate(read(truth, p.name)) for p in problem.parameters])
    place = problem.searched(problem.point(z, np.zeros((len(model.counts), model.local_count(NONE)))))
    assert math.sqrt(place.squares.sum() / model.counts.sum()) < 1.3


def test_a_record_with_workpieces_on_the_table_has_an_inertia_of_its_own() -> None:
    """Seed 3: of two records one with 12 % more; where the inertia may differ from record to record it is found."""
    machine, rng, given = load_machine("smooth"), np.random.default_rng(3), []
    for inertia, rpm in ((1.0, 1500.0), (1.12, 1300.0)):
        loaded = changed(machine, {"table_inertia": inertia * machine.table_inertia})
        point = OperatingPoint(rpm * RPM, 5.0, start_angle=1.0)
        clean = simulate(loaded, point, Run(samples=9000)).table_acceleration
        signal = Signal(clean + 0.05 * rng.standard_normal(len(clean)), 1000.0, unit="rad/s^2", source=f"{rpm:g}.csv")
        given.append(Experiment(signal, point, noise=0.05, inertia_uncertainty=0.1))
    told = tuple(dataclasses.replace(one, inertia_uncertainty=0.0) for one in given)
    levels = []
    for records in (told, given):
        search = Search(IndexerModel(machine, records), Criteria())
        place = search.fits.fit(search.fits.begun.place).place
        levels.append(math.sqrt(place.squares.sum() / search.whole.counts.sum()))
    assert levels[0] > 3.0 and levels[1] < 1.05
    said = IndexerSubject.of_records(cast(Any, None), IndexerModel(machine, given), place)
    ratio = [float(re.search(r"([\d.]+) times the machine's", sentence)[1]) for sentence in said]
    assert ratio[1] / ratio[0] == pytest.approx(1.12, abs=0.01) and said[1].startswith("1300.csv: the table's inertia")
