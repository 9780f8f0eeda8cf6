"""What is like the training is accepted as promised, what is not is refused."""

import dataclasses

import numpy as np
import pytest

from classifier.features import Scaling
from classifier.tasks.need import NotAvailable
from classifier.tasks.novelty import ACCEPTED, NEIGHBOURS, SCORES, Novelty
from classifier.transfer import in_turns
from indexer_env.errors import ParameterError
from tests.classifier.tasks.turns import turned

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


def thinned(dataset, calibration, control, seed):
    """The data set with so many calibration and control records, of all classes alike; the others are to be judged."""
    order = in_turns(dataset, np.random.default_rng(seed).permutation(len(dataset.classes)))
    subsets = np.full(len(order), "validation", dtype=dataset.subsets.dtype)
    subsets[order[:calibration]], subsets[order[calibration:][:control]] = "calibration", "control"
    return dataclasses.replace(dataset, subsets=subsets)


def test_too_few_records_make_no_part(known):
    dataset, features = known
    with pytest.raises(NotAvailable, match="18 independent records of calibration and control, 19 needed"):
        Novelty.fit(thinned(dataset, 12, 6, seed=0), features, NOTHING, seed=0)
    assert len(Novelty.fit(thinned(dataset, 12, 7, seed=0), features, NOTHING, seed=0).reference) == 19


def test_few_control_records_are_helped_by_those_of_the_calibration(known, strange):
    """Ten drawings of 30 calibration and 10 control records, seeds 0 to 9, judged by all other records."""
    dataset, features = known
    refused, found = [], []
    for seed in range(10):
        drawn = thinned(dataset, 30, 10, seed)
        scaling = Scaling.fit(features[drawn.rows("calibration")])
        scaled = scaling.apply(features)
        part = Novelty.fit(drawn, scaled, NOTHING, seed=0)
        assert len(part.reference) == 40
        refused.append(np.mean(part.assess(scaled[drawn.rows("validation")], NOTHING, NOTHING)["is_novel"]))
        found.append(np.mean(part.assess(scaling.apply(strange), NOTHING, NOTHING)["is_novel"]))
    # Were each record judged by what was fitted to it too, scaling or distances, more of the others would be refused.
    assert np.mean(refused) <= 1.0 - ACCEPTED and np.mean(found) > 0.8


@pytest.mark.parametrize("score", SCORES)
def test_turns_of_few_machines_set_the_threshold_for_new_machines(known, score):
    """Nineteen control machines of twenty turns: 95 % of new ones need a threshold above every turn of the nineteen;
    seed 1."""
    dataset, _ = known
    machines = np.flatnonzero(dataset.rows("control"))[:19]
    others = np.flatnonzero(~dataset.rows("control"))
    drawn, features = turned(*known, np.concatenate([np.repeat(machines, 20), others]), seed=1)
    part = Novelty.fit(drawn, features, NOTHING, seed=0, score=score)
    assert not part.assess(features[drawn.rows("control")], NOTHING, NOTHING)["is_novel"].any()


def test_machines_count_alike_where_calibration_and_control_are_one(known):
    """Forty drawings of 20 calibration and 12 control machines with 1 to 30 turns, seeds 0 to 39, judged by all other
    machines."""
    dataset, features = known
    refused = []
    for seed in range(40):
        few = thinned(dataset, 20, 12, seed)
        turns = np.where(few.rows("validation"), 1, np.random.default_rng(seed).integers(1, 31, len(few.classes)))
        drawn, values = turned(few, features, np.repeat(np.arange(len(turns)), turns), seed)
        scaled = Scaling.fit(values[drawn.rows("calibration")]).apply(values)
        part = Novelty.fit(drawn, scaled, NOTHING, seed=0, score="residual")
        refused.append(np.mean(part.assess(scaled[drawn.rows("validation")], NOTHING, NOTHING)["is_novel"]))
    # Were each turn counted, 6.5 % would be refused.
    assert np.mean(refused) <= 1.0 - ACCEPTED


def test_an_unknown_score_is_refused(known):
    with pytest.raises(ParameterError, match="did you mean 'neighbours'"):
        Novelty.fit(*known, NOTHING, seed=0, score="neighbors")
