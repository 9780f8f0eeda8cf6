"""Every training is a row of a table; a sweep has one table of all its runs; trials find settings."""

import sys

import numpy as np
import optuna
import pyarrow.parquet as pq
import pytest
import yaml
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from classifier import __main__ as training
from classifier import tune
from classifier.model import load_model
from classifier.runs import RUNS, collect, write_runs
from indexer_env.errors import ParameterError

pytestmark = pytest.mark.usefixtures("plain_pictures")

SMALL = ("features.maximum_hz=50", "features.resolution_hz=2", "net.hidden=6", "trainer.epochs=60", "restarts=2")


@pytest.fixture(scope="module")
def place(dataset, write_dataset, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    write_dataset(dataset, folder / "set")
    return folder


@pytest.fixture
def start(place, monkeypatch, run_command):
    """Run a command in the place; its exit code, what it printed and what it complained of."""
    monkeypatch.chdir(place)

    def run(command, *overrides, flags=()):
        return run_command(command, *flags, "data=set", *SMALL, *overrides)

    return run


def test_a_run_leaves_its_row_and_its_curves(place, start):
    code, _, err = start(training, "out=one", "seed=7", "parts=[]", "tensorboard=true")
    assert (code, err) == (0, "")
    (row,) = pq.read_table(place / "one" / RUNS).to_pylist()
    assert (row["run"], row["seed"], row["net.hidden"], row["trainer.kind"], row["parts"]) == (
        "one",
        7,
        6,
        "traingdx",
        "",
    )
    model = load_model(place / "one")
    assert row["validation_mse_percent"] == model.metrics["validation"]["mse_percent"]
    assert row["manifest_sha256"] == model.provenance["data"]["manifest_sha256"]
    events = EventAccumulator(str(place / "one" / "tensorboard")).Reload()
    control = [event.value for event in events.Scalars("training_mse_percent/control")]
    assert len(control) == row["epochs"] + 1
    assert min(control) == pytest.approx(row["control_mse_percent"], rel=1e-5)
    assert set(path.name for path in (place / "one").iterdir()) <= set(training.FILES)


def test_pictures_are_left_out_when_asked(place, start, monkeypatch):
    monkeypatch.setattr("classifier.pictures.draw_training", lambda *_: pytest.fail("drawn"))
    code, _, err = start(training, "out=bare", "parts=[]", "pictures=false")
    assert (code, err) == (0, "")
    assert {path.name for path in (place / "bare").iterdir()} == set(training.FILES) - {
        "tensorboard",
        *training.PICTURES,
    }


def test_a_sweep_has_one_table_of_all_runs(place, start):
    code, out, err = start(
        training,
        "out=sweep",
        "trainer=traingdx,trainscg",
        "net.hidden=4,6",
        "trainer.epochs=30",
        "parts=[]",
        flags=["-m"],
    )
    assert (code, err) == (0, "")
    assert "4 runs in " in out and "sweep/results.parquet" in out
    rows = pq.read_table(place / "sweep" / RUNS).to_pylist()
    wanted = [("traingdx", 4), ("traingdx", 6), ("trainscg", 4), ("trainscg", 6)]
    assert sorted((row["trainer.kind"], row["net.hidden"]) for row in rows) == wanted
    assert {(row["trainer.kind"], row["trainer.momentum"]) for row in rows} == {("traingdx", 0.9), ("trainscg", None)}


def test_a_failed_run_leaves_no_row_and_the_others_theirs(place, start):
    code, _, err = start(training, "out=half", "net.hidden=0,4", flags=["-m"])
    assert code == 2 and "net.hidden must be" in err
    assert [row["net.hidden"] for row in pq.read_table(place / "half" / RUNS).to_pylist()] == [4]


def test_runs_of_an_earlier_sweep_are_left_out(place, start):
    start(training, "out=twice", "net.hidden=3,4,5", flags=["-m"])
    code, out, _ = start(training, "out=twice", "net.hidden=6,7", "overwrite=true", flags=["-m"])
    assert code == 0 and "2 runs in " in out
    assert [row["net.hidden"] for row in pq.read_table(place / "twice" / RUNS).to_pylist()] == [6, 7]


def test_a_trial_that_is_refused_does_not_take_the_others_away(place, start):
    """Records of 2 s have no resolution of 0.1 Hz."""
    search = "search={features.resolution_hz:{choices:[0.1,2.0]}}"
    code, out, err = start(tune, "out=partly", "trials=6", "seed=1", search)
    assert code == 0, err
    tried, refused = out.count("control error") - 1, out.count("refused, trial")
    assert tried + refused == 6 and refused > 0
    assert len(pq.read_table(place / "partly" / RUNS)) == tried
    code, _, err = start(tune, "out=none", "trials=2", "search={features.resolution_hz:{choices:[0.1]}}")
    assert code == 2 and "every trial was refused, the last one: trial 1" in err and not (place / "none").exists()


def test_runs_are_collected_in_the_order_of_their_numbers(tmp_path):
    for number in (10, 9, 1):
        (tmp_path / str(number)).mkdir()
        write_runs(
            [{"run": str(number), **({"share": 0.5} if number == 9 else {"words": "a"})}], tmp_path / str(number) / RUNS
        )
    assert collect(tmp_path) == 3
    rows = pq.read_table(tmp_path / RUNS).to_pylist()
    assert [(row["run"], row["share"], row["words"]) for row in rows] == [
        ("1", None, "a"),
        ("9", 0.5, None),
        ("10", None, "a"),
    ]


SEARCH = (
    "search={net.hidden: {low: 3, high: 8}, trainer: {choices: [traingdx, trainscg]}, "
    "trainer.momentum: {low: 0.5, high: 0.95}}"
)


def test_trials_end_with_the_best_settings_and_their_model(place, start):
    code, out, err = start(tune, "out=tuned", "trials=4", "restarts=1", "parts=[]", "~search", f"+{SEARCH}")
    assert (code, err) == (0, ""), err
    rows = pq.read_table(place / "tuned" / RUNS).to_pylist()
    assert [row["run"] for row in rows] == ["0", "1", "2", "3"]
    assert all(3 <= row["net.hidden"] <= 8 for row in rows) and len({row["net.hidden"] for row in rows}) > 1
    best = min(rows, key=lambda row: row["control_mse_percent"])
    model = load_model(place / "tuned")
    assert model.metrics["control"]["mse_percent"] == best["control_mse_percent"]
    settings = yaml.safe_load((place / "tuned" / "best.yaml").read_text())
    assert (settings["net"]["hidden"], settings["trainer"]["kind"]) == (best["net.hidden"], best["trainer.kind"])
    assert "trial 3: control error" in out and out.splitlines()[-1].startswith("best: control error")


def test_proposals_keep_to_their_ranges():
    trial = optuna.create_study(sampler=optuna.samplers.RandomSampler(0)).ask()
    assert isinstance(tune.propose(trial, "a", {"low": 2, "high": 5}), int)
    assert 1e-3 <= tune.propose(trial, "b", {"low": 1e-3, "high": 1.0, "log": True}) <= 1.0
    assert tune.propose(trial, "c", {"choices": ["x"]}) == "x"


def test_a_setting_of_a_choice_that_is_not_proposed_is_left_out():
    config = {"trainer": {"kind": "trainscg", "sigma": 1.0}, "net": {"hidden": 3}, "seed": 0}
    tried = tune.applied(config, {"trainer.momentum": 0.5, "trainer": "traingdx", "net.hidden": 9, "seed": 4})
    assert (tried["trainer"]["momentum"], tried["net"]["hidden"], tried["seed"]) == (0.5, 9, 4)
    tried = tune.applied(config, {"trainer.momentum": 0.5, "trainer": "trainscg"})
    assert tried["trainer"]["kind"] == "trainscg" and "momentum" not in tried["trainer"]
    assert config["net"]["hidden"] == 3


def test_what_is_given_on_the_line_goes_with_a_trial_to_another_rule():
    given = tune._choice("trainer", "traingdx") | {"epochs": 50, "momentum": 0.5}
    tried = tune.applied({"trainer": given}, {"trainer": "trainscg"})
    assert tried["trainer"] == tune._choice("trainer", "trainscg") | {"epochs": 50}
    assert tune.applied({"trainer": given}, {"trainer": "traingdx"})["trainer"] == given


CONFIG = {"features": {"kind": "psd"}, "net": {"hidden": 5}, "trainer": {"kind": "traingdx", "momentum": 0.9}}


@pytest.mark.parametrize(
    ("search", "words"),
    [
        ({}, r"tune\.search must be a mapping"),
        ({"net.hiden": {"low": 1, "high": 2}}, r"did you mean 'net\.hidden'"),
        ({"layers": {"low": 1, "high": 2}}, "settings such as"),
        ({"net.hidden": 5}, r"tune\.search\.net\.hidden must be \{low"),
        ({"net.hidden": {"low": 5, "high": 5}}, "must be below high = 5, got 5"),
        ({"net.hidden": {"low": 5}}, r"net\.hidden\.high must be a finite number"),
        ({"net.hidden": {"low": 0, "high": 5, "log": True}}, "> 0 on a logarithmic scale"),
        ({"net.hidden": {"low": 1, "high": 5, "log": 3}}, "true or false"),
        ({"net.hidden": {"low": 1, "high": 5, "step": 3}}, "got 'step'"),
        ({"net.hidden": {"choices": []}}, "a list of values"),
        ({"trainer": {"choices": ["traingdy"]}}, "did you mean 'traingd"),
        ({"trainer": {"low": 1, "high": 5}}, "must be of choices alone, got 'high'"),
    ],
)
def test_a_search_that_cannot_be_made_is_refused_in_one_sentence(search, words):
    with pytest.raises(ParameterError, match=words) as caught:
        tune.check_search(search, CONFIG)
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")


SIGMA = {"trainer.sigma": {"low": 1e-6, "high": 1e-3, "log": True}}


def test_settings_of_another_rule_may_be_sought_where_a_trial_takes_it():
    assert tune.check_search({**SIGMA, "trainer": {"choices": ["traingdx", "trainscg"]}}, CONFIG)
    for search in (SIGMA, {**SIGMA, "trainer": {"choices": ["trainrp", "trainbfg"]}}):
        with pytest.raises(ParameterError, match=r"this one is of trainer=trainscg\), got 'trainer\.sigma'"):
            tune.check_search(search, CONFIG)


def test_a_search_for_settings_that_no_trial_has_is_refused(run_command):
    code, _, err = run_command(tune, "data=nowhere", "out=new", "features=fft")
    assert code == 2 and err.count("\n") == 1 and "search must be settings that some trial has (this one is of" in err
    assert (
        "features=auto or psd), got 'features.resolution_hz'; for a search without it write ~search '+search={…}'"
        in err
    )


def test_what_a_trial_does_not_have_is_not_told():
    tried = {"trainer": {"kind": "trainscg", "sigma": 0.5}, "seed": 3}
    assert tune._told({"trainer": "trainscg", "trainer.momentum": 0.7, "seed": 3}, tried) == "trainer=trainscg, seed=3"


@pytest.mark.parametrize(
    ("command", "overrides", "words"),
    [
        (tune, ("out=new", "trials=0"), "error: trials must be a whole number >= 1"),
        (tune, ("out=new", "search=null"), "error: search must be a mapping"),
        (tune, ("out=set",), "other files"),
        (training, ("out=new", "tensorboard=5"), "error: tensorboard must be true or false"),
        (training, ("out=new", "pictures=few"), "error: pictures must be true or false"),
        (training, ("out=new", "parts=novelty"), "error: parts must be a list of"),
        (training, ("out=new", "parts=[noveltie]"), "error: parts must be one of"),
    ],
)
def test_bad_input_is_one_sentence_and_nothing_is_written(place, start, command, overrides, words):
    before = set(place.iterdir())
    code, _, err = start(command, *overrides)
    assert code == 2 and err.startswith("error: ") and len(err.strip().splitlines()) == 1
    assert words in err
    assert set(place.iterdir()) == before


@pytest.mark.parametrize(
    ("command", "module", "overrides"), [(tune, "optuna", ()), (training, "tensorboard", ("tensorboard=true",))]
)
def test_without_the_extra_a_command_says_which(start, monkeypatch, command, module, overrides):
    for name in [name for name in sys.modules if name.partition(".")[0] == module or name == "torch.utils.tensorboard"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    code, _, err = start(command, "out=new", *overrides)
    assert code == 2 and "pip install 'indexer-diagnosis[" in err
    assert np.isscalar(code)
