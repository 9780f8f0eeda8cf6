"""Groups are left out whole, and what cannot be left out is said."""

import dataclasses
import json

import numpy as np
import pyarrow as pa
import pytest

from classifier import leaveout as command
from classifier.groups import groups_of, part
from classifier.leaveout import ACCURACY, KNOWN, MEAN, draw, judge, overall, side_by_side, splits
from classifier.leaveout_methods import CNN, LOGISTIC, METHODS, MLP, cnn, logistic, mlp
from classifier.train import train
from indexer_env.errors import ParameterError, SignalError

MACHINES = np.array(["M1", "M2", "M3"])


@pytest.fixture(scope="module")
def grouped(dataset):
    """The first half of the records of each subset is split among two machines, the rest is of a third."""
    machines = MACHINES[np.minimum(np.arange(len(dataset.classes)) % 24 // 6, 2)]
    table = pa.table({"groups": [json.dumps({"machine": machine}) for machine in machines], "class": dataset.classes})
    return dataclasses.replace(dataset, table=table), machines


def test_groups_come_from_the_labels_or_from_a_column(grouped):
    dataset, machines = grouped
    assert np.array_equal(groups_of(dataset, "machine"), machines)
    assert set(groups_of(dataset, "class")) == {"1", "2", "3"}


def test_an_unknown_group_is_answered_with_the_nearest(grouped):
    with pytest.raises(ParameterError, match="did you mean 'machine'"):
        groups_of(grouped[0], "machin")


def test_a_record_without_its_group_is_refused(grouped):
    dataset, _ = grouped
    texts = dataset.table.column("groups").to_pylist()
    texts[5] = "{}"
    table = pa.table({"groups": texts})
    with pytest.raises(SignalError, match="got none for record 5"):
        groups_of(dataclasses.replace(dataset, table=table), "machine")


def test_what_is_left_out_is_in_no_subset_of_the_rest(grouped):
    dataset, machines = grouped
    found, without = splits(dataset, machines)
    assert [split.group for split in found] == list(MACHINES) and not without
    for split in found:
        assert len(split.records) == (machines == split.group).sum()
        assert len(split.rest.records) == (machines != split.group).sum()
        assert split.rest.table.num_rows == len(split.rest.records)


def test_a_group_that_alone_has_a_class_is_not_left_out(grouped):
    dataset, machines = grouped
    by_class = np.where(dataset.classes == 3, "only one with class 3", machines)
    found, without = splits(dataset, by_class)
    # Without it two classes are left, and none of its own records can be judged.
    assert list(without) == ["only one with class 3"]
    assert "no other group has its classes" in without["only one with class 3"]
    assert len(found) == 3


def test_one_group_alone_is_refused(grouped):
    dataset, machines = grouped
    with pytest.raises(SignalError, match="two groups"):
        splits(dataset, np.full(len(machines), "M1"))


@pytest.fixture
def learners(features, trainer):
    def trained(rest, seed):
        return train(rest, features, trainer, hidden=6, seed=seed, restarts=2, parts=())

    return {MLP: mlp(trained), LOGISTIC: logistic(features), CNN: cnn(features)}


@pytest.mark.parametrize("method", METHODS)
def test_every_method_is_judged_on_the_group_that_it_did_not_see(grouped, learners, method):
    """The first group's classes are exchanged: a method that saw it would name half of them right."""
    dataset, machines = grouped
    first = machines == "M1"
    exchanged = dataclasses.replace(dataset, classes=np.where(first, dataset.classes % 3 + 1, dataset.classes))
    split = splits(exchanged, machines)[0][0]
    found = {row.metric: row.value for row in judge(split, method, learners[method], 0)}
    assert split.group == "M1" and found[ACCURACY] < 20 and found[KNOWN] > 90
    assert ("refused as novel [%]" in found) == (method == MLP)


def test_a_line_a_method_and_a_column_a_group(grouped, learners):
    dataset, machines = grouped
    names = (MLP, LOGISTIC)
    rows = [
        row for split in splits(dataset, machines)[0] for name in names for row in judge(split, name, learners[name], 0)
    ]
    right = [row.value for row in rows if row.metric == ACCURACY and row.method == MLP]
    means = [row for row in overall(rows) if row.metric == ACCURACY and row.method == MLP]
    assert [row.data for row in means] == [MEAN] and means[0].value == pytest.approx(np.mean(right))
    rows += overall(rows)
    head, _, *lines = side_by_side(rows).splitlines()
    assert head == f"| accuracy [%] on | M1 | M2 | M3 | {MEAN} |"
    assert [line.split(" | ")[0] for line in lines] == [f"| {name}" for name in names]
    assert lines[0].split(" | ")[1] == f"{right[0]:.1f}"
    assert len(draw(rows).axes) == 1


def test_what_cannot_be_refused_is_told(grouped, run_command, write_dataset, tmp_path):
    """Twelve records are too few to say of those of another campaign whether they are novel."""
    dataset, _ = grouped
    few = part(dataset, np.arange(72) % 24 < 6)
    write_dataset(few, tmp_path / "set", campaign="other")
    by = ("by=campaign", "seeds=1", "restarts=1", "features.resolution_hz=2", "features.maximum_hz=50")
    code, out, err = run_command(command, f"data={tmp_path}/set", f"out={tmp_path}/out", *by)
    assert (code, err) == (0, "")
    assert (
        "whether it is refused as novel cannot be told, 12 independent records of calibration and control, 19 needed"
        in out
    )


def test_an_unknown_key_of_the_network_is_one_sentence(run_command):
    code, _, err = run_command(command, "data=nowhere", "out=new", "by=machine", "+net.hiden=4")
    assert code == 2 and err == "error: net has no parameter 'hiden'; did you mean 'hidden'.\n"


def test_a_part_keeps_the_classes_that_are_left(grouped):
    dataset, _ = grouped
    found = part(dataset, dataset.classes != 2)
    assert found.codes.classes == (1, 3)
    assert found.codes.codes == (dataset.codes.codes[0], dataset.codes.codes[2])
