"""What is like the training is accepted as promised, what is not is refused."""

import dataclasses

import numpy as np
import pytest

from classifier.tasks.novelty import ACCEPTED, NEIGHBOURS, SCORES, Novelty
from indexer_env.errors import ParameterError

NOTHING = np.empty(0)


@pytest.mark.parametrize("score", SCORES)
def test_known_records_are_accepted_and_strange_ones_refused(known, strange, score):
    """200 validation and 200 control records: standard errors of 1.5 % each."""
    dataset, features = known
    part = Novelty.fit(dataset, features, NOTHING, seed=0, score=score)
    assert part is not None
    like = part.assess(features[dataset.rows("validation")], NOTHING, NOTHING)
    assert np.mean(~like["is_novel"]) > ACCEPTED - 0.07
    assert np.array_equal(like["is_novel"], like["novelty"] > 1.0)
    assert np.mean(part.assess(strange, NOTHING, NOTHING)["is_novel"]) > 0.9


def test_distances_to_neighbours_are_those_of_a_plain_search(known):
    dataset, features = known
    part = Novelty.fit(dataset, features, NOTHING, seed=0)
    assert part is not None
    components = part.whitening.apply(part.compression.apply(features))
    apart = np.linalg.norm(components[:7, None] - components[None, dataset.rows("calibration")], axis=-1)
    plain = np.sort(apart, axis=1)[:, :NEIGHBOURS].mean(axis=1)
    assert part.scores(features[:7]) == pytest.approx(plain)


@pytest.mark.parametrize("score", SCORES)
def test_it_comes_back_bit_for_bit(known, score):
    part = Novelty.fit(*known, NOTHING, seed=0, score=score)
    assert part is not None
    again = Novelty.restore(part.body(), part.arrays())
    assert np.array_equal(part.scores(known[1]), again.scores(known[1]))


def test_too_few_control_records_make_no_part(known):
    dataset, features = known
    control = np.flatnonzero(dataset.rows("control"))
    subsets = dataset.subsets.copy()
    subsets[control[18:]] = "calibration"
    few = dataclasses.replace(dataset, subsets=subsets)
    assert Novelty.fit(few, features, NOTHING, seed=0) is None


def test_an_unknown_score_is_refused(known):
    with pytest.raises(ParameterError, match="did you mean 'neighbours'"):
        Novelty.fit(*known, NOTHING, seed=0, score="neighbors")
