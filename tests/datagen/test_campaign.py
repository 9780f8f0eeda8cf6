"""Which machine and label each item has: labels of the paper, draws within their laws."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from datagen.campaign import SUBSETS, build
from datagen.campaigns import make_campaign
from datagen.changes import value_at, with_changes
from indexer_env.effects import make_effect
from indexer_env.errors import ParameterError

# The paper, Table 2: class -> model, joint 2 has play, joint 2 is bilinear, code.
PAPER = {
    1: ("A", False, False, "01111"),
    2: ("A", True, False, "01110"),
    3: ("B", False, False, "11111"),
    4: ("B", True, False, "11110"),
    5: ("B", False, True, "11101"),
    6: ("B", True, True, "11100"),
}
DRAWN = ["input_joint.stiffness", "input_joint.damping", "output_joint.stiffness", "output_joint.damping"]


@pytest.fixture
def campaign(settings):
    return make_campaign(settings)


@pytest.fixture
def cases(campaign, base):
    return [build(campaign.item(index, base, 11), base) for index in range(180)]


def test_classes_are_those_of_the_paper(cases):
    for case in cases:
        model, play, bilinear, code = PAPER[case.item.label.number]
        joint = case.machine.output_joint
        assert (case.machine.model, joint.backlash > 0, joint.stiffness_ratio < 1) == (model, play, bilinear)
        assert case.item.label.code == code
        assert case.machine.input_joint.backlash == 0.0


def test_the_paper_s_126_are_shared_equally(campaign, base):
    labels = [campaign.item(index, base, 0).label for index in range(126)]
    assert Counter((label.number, label.subset) for label in labels) == {
        (number, subset): 7 for number in PAPER for subset in SUBSETS
    }
    assert len({label.machine_draw for label in labels}) == 126


def test_draws_fill_the_stated_range_and_no_more(cases, base, settings):
    ranges = {path: value_at(base.machine, path) for path in DRAWN[2:]}
    for path, nominal in ranges.items():
        ratios = np.array([value_at(case.machine, path) / nominal for case in cases])
        assert 0.9 <= ratios.min() < 0.91 and 1.09 < ratios.max() <= 1.1
        assert abs(ratios.mean() - 1.0) < 0.02
    for path, nominal in (
        ("output_joint.backlash", settings["output_backlash"]),
        ("output_joint.stiffness_ratio", settings["stiffness_ratio"]),
    ):
        drawn = {value_at(case.machine, path) / nominal for case in cases} - {0.0, 1.0 / nominal}
        assert 0.9 <= min(drawn) < 0.92 and 1.08 < max(drawn) <= 1.1


def test_joint_1_is_drawn_in_model_b_only(cases, base):
    for case in cases:
        for path in DRAWN[:2]:
            same = value_at(case.machine, path) == value_at(base.machine, path)
            assert same == (case.machine.model == "A")


def test_draws_are_uncorrelated(cases):
    values = np.array([[value_at(case.machine, path) for path in DRAWN] for case in cases if case.machine.model == "B"])
    correlation = np.corrcoef(values.T) - np.eye(len(DRAWN))
    assert np.abs(correlation).max() < 0.25


def test_item_depends_on_seed_and_index_alone(campaign, base):
    alone = campaign.item(17, base, 5)
    for index in range(17):
        campaign.item(index, base, 5)
    assert campaign.item(17, base, 5) == alone
    assert campaign.item(17, base, 6).machine != alone.machine
    assert campaign.item(23, base, 5).machine != alone.machine


def test_the_example_is_in_no_data_set(campaign, base):
    example = campaign.example(base, 5)
    assert example.label.number == 6
    stiffness = example.machine["output_joint.stiffness"]
    assert stiffness not in {campaign.item(index, base, 5).machine["output_joint.stiffness"] for index in range(600)}


def test_an_item_whose_machine_is_impossible_says_why(settings, base):
    settings["draws"]["machine"]["output_joint"]["stiffness"]["around"] = 5.0
    campaign = make_campaign(settings)
    with pytest.raises(ParameterError, match=r"stiffness must be .* got -"):
        for index in range(100):
            build(campaign.item(index, base, 0), base)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda s: s.update(name="tabel2"), "did you mean 'table2'"),
        (lambda s: s.pop("name"), "campaign.name must be one of"),
        (lambda s: s.update(output_backlash=-1e-3), "output_backlash must be"),
        (lambda s: s.update(stiffness_ratio=1.0), "stiffness_ratio must be"),
        (lambda s: s.update(stifness_ratio=0.5), "stiffness_ratio"),
        (lambda s: s["draws"]["machine"]["input_joint"].update(stiffness={"arond": 0.1}), "did you mean 'around'"),
        (
            lambda s: s["draws"]["machine"]["input_joint"]["stiffness"].update(around=-0.1),
            "must be a finite number >= 0",
        ),
        (lambda s: s["draws"]["machine"]["output_joint"].update(stifness={"around": 0.1}), "did you mean 'stiffness'"),
        (lambda s: s["draws"].update(machin={}), "did you mean 'machine'"),
        (lambda s: s["draws"]["machine"].update(model={"choice": ["A", "B"]}), "as the campaign table2 decides it"),
        (lambda s: s["draws"].update(faults={"roller": "cracked"}), "as the campaign table2 decides it"),
        (lambda s: s.update(draws=3), "campaign.draws must be a mapping"),
        (lambda s: s.update(split={"training": 1}), "campaign.split.key must be one of calibration, control"),
        (lambda s: s.update(split={"control": 0}), "campaign.split.sum must be from 1 to 1000 machine draws"),
    ],
)
def test_bad_settings_are_one_sentence(settings, change, sentence):
    change(settings)
    with pytest.raises(ParameterError) as caught:
        make_campaign(settings)
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("roller.crack", {"stiffness_loss": 0.4}),
        ("output.backlash", {"backlash": 1e-3}),
        ("base.looseness", {"compliance": 1e-6}),
    ],
)
def test_a_machine_with_an_effect_that_decides_the_class_is_refused(order, base, settings, name, parameters):
    """Its class 1 would have the play or the crack of another class."""
    faulty = replace(base, machine=base.machine.with_effects(make_effect(name, parameters)))
    with pytest.raises(ParameterError, match=rf"machine\.effects\.{name}.* must be left to the campaign table2"):
        replace(order, base=faulty)
    rubbing = replace(base, machine=base.machine.with_effects(make_effect("friction.coulomb", {"torque": 5.0})))
    assert replace(order, base=rubbing)
    settings["draws"]["effects"] = {name: parameters}
    with pytest.raises(ParameterError, match="as the campaign table2 decides it"):
        make_campaign(settings)


def test_with_changes_replaces_deep_fields_at_once(base):
    changed = with_changes(base.machine, {"output_joint.damping": 1.0, "output_joint.backlash": 2e-3, "model": "A"})
    assert (changed.output_joint.damping, changed.output_joint.backlash, changed.model) == (1.0, 2e-3, "A")
    assert changed.output_joint.stiffness == base.machine.output_joint.stiffness
    for path in ("modle", "output_joint.dampning", "model.x"):
        with pytest.raises(ParameterError, match="must be a field"):
            with_changes(base.machine, {path: 1.0})
