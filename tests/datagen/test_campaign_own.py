"""The campaign `own`: joint draws of a machine, faults on top of what it has, a common factor of all loads."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datagen.campaign import SUBSETS, Base, build
from datagen.campaigns.own import LOAD_FACTOR, Own
from indexer_env import OperatingPoint, load_machine, make_effect
from indexer_env.errors import ParameterError
from indexer_env.faults import Faults

FAULTS = {
    "friction": {"friction.coulomb": {"torque": {"uniform": [1.0, 2.0]}}},
    "crack": {"roller.crack": {"stiffness_loss": {"uniform": [0.1, 0.5]}}},
}
BASE = Base(load_machine("reference"), OperatingPoint())


def table(folder: Path, **columns: list[float]) -> str:
    path = folder / "posterior.parquet"
    pq.write_table(pa.table({name.replace("__", "."): values for name, values in columns.items()}), path)
    return str(path)


def test_a_machine_has_its_row_and_growing_friction_adds_to_what_was_there(tmp_path):
    there = {"machine__table_inertia": [4.0, 6.0, 8.0], "effects__friction__coulomb__torque": [5.0, 7.0, 9.0]}
    posterior = table(tmp_path, **there)
    own = Own(machines=40, posterior=posterior, faults={"friction": FAULTS["friction"]}, how_many=(0.5, 0.5))
    codes = set()
    for index in range(40):
        item = own.item(index, BASE, 3)
        machine = build(item, BASE).machine
        assert machine.table_inertia == (4.0, 6.0, 8.0)[index % 3]
        torque, had = machine.effects[0].torque, (5.0, 7.0, 9.0)[index % 3]
        if item.label.code == "1":
            assert had + 1.0 <= torque <= had + 2.0 and item.label.name == "friction"
        else:
            assert torque == had and item.label.name == "healthy"
        codes.add(item.label.code)
    assert codes == {"0", "1"}


def test_what_the_configured_machine_has_is_no_fault_and_grows():
    """As a machine that `indexer explain` has found friction on, without joint draws."""
    base = Base(
        load_machine("reference").with_effects(make_effect("friction.coulomb", {"torque": 20.0})), OperatingPoint()
    )
    own = Own(machines=40, faults={"friction": FAULTS["friction"]}, how_many=(0.5, 0.5))
    seen = set()
    for index in range(40):
        item = own.item(index, base, 3)
        torque = build(item, base).machine.effects[0].torque
        assert 21.0 <= torque <= 22.0 if item.label.name == "friction" else torque == 20.0
        seen.add(item.label.name)
    assert seen == {"healthy", "friction"}


def test_two_faults_of_one_quantity_add_up_and_a_place_is_the_faults():
    """A bump of the process that the machine has at 0.3, and that a fault has at 0.6."""
    effect = make_effect("load.process", {"torque": 50.0, "centre": 0.3, "half_width": 0.05})
    base = Base(load_machine("reference").with_effects(effect), OperatingPoint())
    bump = {"load.process": {"torque": {"uniform": [1.0, 1.0]}, "centre": {"uniform": [0.6, 0.6]}}}
    own = Own(machines=3, faults={"a": bump, "b": bump}, how_many=(0.0, 0.0, 1.0))
    for index in range(3):
        (there,) = build(own.item(index, base, 0), base).machine.effects
        assert (there.torque, there.centre, there.half_width) == (52.0, 0.6, 0.05)


def test_an_imbalance_that_is_there_grows_where_it_is(tmp_path):
    """As `twin.synthesis.effect_of` has it, which is fitted to such turns."""
    there = {"effects__load__imbalance__torque": [80.0], "effects__load__imbalance__phase": [1.0]}
    more = {"load.imbalance": {"torque": {"uniform": [1.0, 9.0]}, "phase": {"uniform": [0.0, 6.0]}}}
    own = Own(machines=9, posterior=table(tmp_path, **there), faults={"imbalance": more}, how_many=(0.0, 1.0))
    for index in range(9):
        (effect,) = build(own.item(index, BASE, 1), BASE).machine.effects
        assert 81.0 <= effect.torque <= 89.0 and effect.phase == 1.0
        assert own.item(index, BASE, 1).label.name == "imbalance"


def test_how_many_faults_are_there_is_drawn_by_its_law():
    own = Own(machines=600, faults=FAULTS, how_many=(0.25, 0.5, 0.25))
    names = Counter(own.item(index, BASE, 0).label.name for index in range(600))
    # binomial, standard deviation of 11
    assert abs(names["healthy"] - 150) < 40 and abs(names["friction, crack"] - 150) < 40
    assert names["friction"] > 80 and names["crack"] > 80
    assert own.item(7, BASE, 0) == own.item(7, BASE, 0) != own.item(7, BASE, 1)


def test_loads_are_the_rows_factor_times_what_is_stated(tmp_path):
    posterior = table(tmp_path, **{LOAD_FACTOR: [0.9, 1.1, 1.0]})
    own = Own(machines=4, posterior=posterior, points=[{"motor_speed": 150.0, "load_torque": 10.0}])
    loads = [own.item(index, BASE, 0).operating_point["load_torque"] for index in range(4)]
    assert loads == pytest.approx([9.0, 11.0, 10.0, 9.0])


def test_a_machine_of_the_joint_draws_is_in_one_subset(tmp_path):
    """Seed 0, ten times as many records as machines: a network would be judged on machines that it has seen."""
    own = Own(machines=70, posterior=table(tmp_path, machine__table_inertia=[4.0 + 0.1 * k for k in range(7)]))
    items = [own.item(index, BASE, 0) for index in range(70)]
    subsets = {(item.machine["table_inertia"], item.label.subset) for item in items}
    assert len(subsets) == 7 and {subset for _, subset in subsets} == set(SUBSETS)
    # what is counted as machines are machines
    assert {(item.machine["table_inertia"], item.label.machine_draw) for item in items} == {
        (4.0 + 0.1 * k, k) for k in range(7)
    }


def test_fewer_machines_than_subsets_are_refused_but_for_one(tmp_path):
    """One machine is in all subsets, as there is no other."""
    two = table(tmp_path, machine__table_inertia=[4.0, 5.0])
    with pytest.raises(ParameterError, match=r"one row, the machine of all subsets, or of 3, .* got '2 rows'"):
        Own(machines=9, posterior=two)
    one = Own(machines=9, posterior=table(tmp_path, machine__table_inertia=[4.0]))
    assert {one.item(index, BASE, 0).label.subset for index in range(9)} == set(SUBSETS)


def test_each_combination_of_faults_is_a_class_with_its_own_code():
    """Seed 0; a class of several faults would have several codes, which no network can be taught."""
    own = Own(machines=60, faults=FAULTS, how_many=(0.25, 0.5, 0.25))
    labels = {(one.number, one.name, one.code) for one in (own.item(k, BASE, 0).label for k in range(60))}
    assert labels == {(1, "healthy", "00"), (2, "crack", "01"), (3, "friction", "10"), (4, "friction, crack", "11")}
    assert own.classes() == ("healthy", "crack", "friction", "friction, crack")


@pytest.mark.parametrize("key", ["draws", "drift"])
def test_faults_of_the_bench_are_refused_beside_the_table(key):
    """A cracked machine would be labelled as healthy."""
    laws = {key: {"faults": {"roller_crack": {"uniform": [0.1, 0.5]}}}}
    with pytest.raises(ParameterError, match=rf"campaign\.{key}\.faults\.roller_crack must be left out"):
        Own(machines=10, faults=FAULTS, how_many=(0.5, 0.5), **laws)
    faulty = Base(BASE.machine, BASE.operating_point, Faults(roller_crack=0.4))
    own = Own(machines=10, faults=FAULTS, how_many=(0.5, 0.5))
    assert not build(own.item(0, faulty, 0), faulty).faults.roller_crack


def test_joint_draws_of_a_fault_of_the_bench_are_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"without a fault, .* give what healthy machines have as an effect"):
        Own(machines=1, posterior=table(tmp_path, faults__backlash=[0.1]))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"how_many": (0.5, 0.4)}, "that sum up to 1"),
        ({"how_many": (0.25, 0.25, 0.25, 0.25)}, "probabilities of 0 to 2 faults"),
        ({"faults": {"crack": {"roller.crac": {"stiffness_loss": 0.1}}}, "how_many": (1.0,)}, "roller.crack"),
        ({"posterior": "absent.parquet"}, "cannot be read"),
        ({"points": [{"motor_speed": -1.0}]}, r"points\[0\].motor_speed must be"),
    ],
)
def test_mistakes_end_in_a_sentence(given, said):
    with pytest.raises(ParameterError, match=said):
        Own(**{"machines": 10, "faults": FAULTS, "how_many": (0.5, 0.5), **given})


def test_a_posterior_that_was_changed_is_refused(tmp_path):
    posterior = table(tmp_path, machine__table_inertia=[4.0])
    before = Own(machines=1, posterior=posterior).posterior_sha256
    table(tmp_path, machine__table_inertia=[5.0])
    with pytest.raises(ParameterError, match="the file is another one now"):
        Own(machines=1, posterior=posterior, posterior_sha256=before)


def test_a_column_that_is_no_quantity_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="table_inertia"):
        Own(machines=1, posterior=table(tmp_path, machine__table_inertai=[4.0]))


def test_a_posterior_that_is_no_parquet_file_is_refused(tmp_path):
    (tmp_path / "draws.csv").write_text("machine.table_inertia\n4.0\n")
    said = r"posterior must be a Parquet file of joint draws, got '.*draws.csv'; indexer twin leaves one"
    with pytest.raises(ParameterError, match=said):
        Own(machines=1, posterior=str(tmp_path / "draws.csv"))


@pytest.mark.parametrize("law", [{"uniform": [0.5, 1.0]}, {"around": 0.1}, 3.0])
def test_what_a_fault_sets_cannot_be_drawn_beside_it(law):
    """A healthy machine with a drawn torque would be labelled as one with the fault."""
    draws = {"effects": {"friction.coulomb": {"torque": law}}}
    with pytest.raises(ParameterError, match=r"effects\.friction\.coulomb\.torque must be left to campaign\.faults"):
        Own(machines=10, faults=FAULTS, how_many=(0.5, 0.5), draws=draws)
    assert Own(machines=10, faults={"crack": FAULTS["crack"]}, how_many=(0.5, 0.5), draws=draws)
