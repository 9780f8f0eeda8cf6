"""The base model is found on machines with and without play: noise floor reached, parameters near the truth."""

import math

import numpy as np
import pytest

from discrepancy.criteria import Criteria
from discrepancy.indexer.parameters import read
from discrepancy.model import NONE
from discrepancy.search import Search


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
