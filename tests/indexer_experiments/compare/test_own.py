"""Methods of a user's own file join a comparison, and their results a leaderboard. Random choices are seeded."""

import numpy as np
import pytest

from classifier.results import Row, write_results
from indexer_env.errors import ParameterError
from indexer_experiments.compare import __main__ as command
from indexer_experiments.compare.baselines import LEARNING, NAMING, WRONG, rows_of
from indexer_experiments.compare.leaderboard import COLUMNS, page, read
from indexer_experiments.compare.methods.own import method_of
from indexer_experiments.compare.studies import STUDIES
from indexer_experiments.compare.study import Setting

MINE = """
import numpy as np

class First:
    def fit(self, dataset, seed):
        self.classes = len(dataset.codes.classes)
        return self

    def logits(self, records):
        return np.tile(np.eye(self.classes)[0], (len(records), 1))

class NotFinite(First):
    def logits(self, records):
        return np.full((len(records), self.classes), np.nan)

class TooMany(First):
    def logits(self, records):
        return np.zeros((len(records), self.classes + 1))

class TooFew(First):
    def logits(self, records):
        return np.zeros((len(records), self.classes - 1))

class OneRow(First):
    def logits(self, records):
        return np.zeros((1, self.classes))

class NoLogits:
    def fit(self, dataset, seed):
        return None

class NoFit:
    def fit(self, dataset, seed):
        raise KeyError("first line\\nsecond line")

class Asks:
    def __init__(self, size):
        pass

    def fit(self, dataset, seed):
        pass

class LooksUp:
    def fit(self, dataset, seed):
        self.dataset = dataset
        return self

    def logits(self, records):
        classes = self.dataset.codes.positions(self.dataset.classes)
        found = [classes[np.flatnonzero((self.dataset.records == record).all(axis=1))[0]] for record in records]
        return 10.0 * np.eye(len(self.dataset.codes.classes))[found]

first = First()
nothing = 3
"""
"""Methods of a user's file; `LooksUp` gives the labels of records that it has been shown."""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MINE)
    return path


@pytest.mark.parametrize("name", ["First", "first"])
def test_a_method_of_ones_own_is_measured_like_the_others(mine, tones, tmp_path, name: str) -> None:
    """It names the first of three tones always, so that two thirds are wrong."""
    rows = rows_of("benchmark", "tones", tones, Setting(0, 200, tmp_path, (f"{mine}:{name}",)))
    found = {row.metric: row.value for row in rows}
    assert {row.method for row in rows} == {f"{mine}:{name}"}
    assert found[WRONG] == pytest.approx(200 / 3) and {LEARNING, NAMING} <= set(found)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("{mine}:nothing", "which nothing of .* is not"),
        ("{mine}:Second", "which Second of .* is not"),
        ("gone.py:First", "names of methods in files that exist"),
        ("{broken}:First", "raised NameError"),
    ],
)
def test_what_is_no_method_is_refused_in_a_sentence(mine, tmp_path, name: str, sentence: str) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("undefined\n")
    with pytest.raises(ParameterError, match=sentence):
        method_of(name.format(mine=mine, broken=broken))


@pytest.mark.parametrize(
    ("name", "rule", "remedy"),
    [
        ("NotFinite", r"whose logits are an array \(n, classes\) of finite numbers", "they have what is not finite"),
        ("TooMany", r"whose logits are .* of finite numbers, here \(60, 3\)", r"they have the shape \(60, 4\)"),
        ("TooFew", r"whose logits are .* of finite numbers, here \(60, 3\)", r"they have the shape \(60, 2\)"),
        ("OneRow", r"whose logits are .* of finite numbers, here \(60, 3\)", r"they have the shape \(1, 3\)"),
        ("NoLogits", "that give an array .* as logits", "it raised AttributeError"),
        ("NoFit", "that can fit", r"it raised KeyError: 'first line\\nsecond line'; HYDRA_FULL_ERROR=1 shows where"),
        ("Asks", "that can be made without arguments", "it raised TypeError"),
    ],
)
def test_what_a_method_does_amiss_is_a_sentence(mine, tones, tmp_path, name: str, rule: str, remedy: str) -> None:
    said = rf"compare.methods must be names of methods {rule}.*, got '.*mine.py:{name}'; {remedy}"
    with pytest.raises(ParameterError, match=said):
        rows_of("benchmark", "tones", tones, Setting(0, 200, tmp_path, (f"{mine}:{name}",)))


def test_a_method_of_ones_own_does_not_see_the_records_that_judge_it(mine, tones, tmp_path) -> None:
    with pytest.raises(ParameterError, match="it raised IndexError"):
        rows_of("benchmark", "tones", tones, Setting(0, 200, tmp_path, (f"{mine}:LooksUp",)))
    assert np.isfinite(tones.records).all()


def test_only_studies_that_say_so_take_methods_of_ones_own(mine) -> None:
    name = f"{mine}:First"
    assert command._methods(["mlp", name], STUDIES["benchmark"]) == ("mlp", name)
    with pytest.raises(ParameterError, match="methods must be one of"):
        command._methods([name], STUDIES["severity"])


def _results(folder, method: str, wrong: float, study: str = "benchmark"):
    folder.mkdir()
    values = {metric: 1.0 for metric, _ in COLUMNS} | {WRONG: wrong}
    rows = [
        Row(study, split, method, metric, seed, value)
        for split in ("machine", "fault_size")
        for seed in (0, 1)
        for metric, value in values.items()
    ]
    write_results(folder, rows, "", {})
    return str(folder)


def test_the_leaderboard_ranks_what_several_folders_hold(tmp_path) -> None:
    text = page(read([_results(tmp_path / "a", "poor", 30.0), _results(tmp_path / "b", "good", 10.0)]))
    assert text.count("## Split by") == 2 and "## Split by fault size" in text
    assert text.index("| good | 10.00 ± 0.00 |") < text.index("| poor | 30.00 ± 0.00 |")


def test_the_leaderboard_refuses_what_is_no_result_of_the_benchmark(tmp_path) -> None:
    first = _results(tmp_path / "a", "poor", 30.0)
    for folder in (str(tmp_path / "gone"), _results(tmp_path / "c", "poor", 1.0, study="baselines")):
        with pytest.raises(ParameterError, match="folders must be results of indexer compare study=benchmark"):
            read([folder])
    with pytest.raises(ParameterError, match=r"different methods, got .*poor in .* again"):
        read([first, first])
