"""The comparison's command: bad input in a sentence, and what it leaves."""

import dataclasses
import json

import pyarrow.parquet as pq
import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from classifier.results import Row
from indexer_env.errors import ParameterError
from indexer_env.presets import config_dir
from indexer_experiments.compare import __main__ as command
from indexer_experiments.compare import studies
from indexer_experiments.compare.draw import dots, matrix
from indexer_experiments.compare.study import Study


def configured(**given):
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("compare", [f"{key}={value}" for key, value in given.items()]))
    assert isinstance(config, dict)
    return {str(key): value for key, value in config.items()}


@pytest.fixture
def study(monkeypatch):
    """A study of two methods that costs nothing."""

    def run(setting):
        return [
            Row("toy", "data", name, metric, setting.seed, setting.seed + len(name))
            for name in setting.methods
            for metric in ("error [%]", "learning [s]")
        ]

    pictures = {"dots": lambda rows: dots(rows, "error [%]"), "matrix": lambda rows: matrix(rows, ["error [%]"])}
    monkeypatch.setitem(
        studies.STUDIES,
        "toy",
        Study("Which?", ("a", "bb"), run, (("error [%]", 1), ("learning [s]", 1)), pictures, ("error [%]", "a")),
    )


def test_methods_are_set_beside_one_of_them(study, tmp_path):
    command.run(configured(study="toy", out=tmp_path / "out", seeds=3))
    text = (tmp_path / "out" / "table.md").read_text()
    assert "error [%] minus a" in text and "| data | bb | 1.00 ± 0.00 |" in text


def test_it_leaves_rows_a_table_pictures_and_its_configuration(study, tmp_path, capsys):
    out = tmp_path / "out"
    command.run(configured(study="toy", out=out, seeds=3, methods="[bb]"))
    assert {path.name for path in out.iterdir()} == {
        "results.parquet",
        "table.md",
        "config.json",
        "dots.png",
        "matrix.png",
    }
    assert pq.read_table(out / "results.parquet").column("value").to_pylist() == [2.0, 2.0, 3.0, 3.0, 4.0, 4.0]
    assert "| data | bb | 3.0 ± 2.5 | 3.0 ± 2.5 |" in (out / "table.md").read_text()
    assert json.loads((out / "config.json").read_text())["seeds"] == 3
    shown = capsys.readouterr().out
    assert "Which?" in shown and "| error [%] | learning [s] |" in shown


def test_seeds_that_are_done_are_kept_when_a_later_one_fails(study, tmp_path, monkeypatch, capsys):
    toy = studies.STUDIES["toy"]

    def run(setting):
        if setting.seed == 2:
            raise RuntimeError("out of memory")
        return toy.run(setting)

    monkeypatch.setitem(studies.STUDIES, "toy", dataclasses.replace(toy, run=run))
    out, part = tmp_path / "out", tmp_path / "out.part"
    with pytest.raises(RuntimeError, match="out of memory"):
        command.run(configured(study="toy", out=out, seeds=3))
    assert not out.exists() and f"kept in {part}" in " ".join(capsys.readouterr().out.split())
    assert pq.read_table(part / "results.parquet").column("seed").to_pylist() == [0] * 4 + [1] * 4
    assert (part / "table.md").read_text().startswith("2 of 3 seeds so far.\n")
    with pytest.raises(ParameterError, match=r"set overwrite=true to replace the earlier result"):
        command.run(configured(study="toy", out=out, seeds=3))
    monkeypatch.setitem(studies.STUDIES, "toy", toy)
    command.run(configured(study="toy", out=out, seeds=3, overwrite=True))
    assert pq.read_table(out / "results.parquet").num_rows == 12 and not part.exists()


def test_an_earlier_result_stays_until_a_new_one_is_whole(study, tmp_path, monkeypatch):
    command.run(configured(study="toy", out=tmp_path / "out", seeds=2))
    before = (tmp_path / "out" / "results.parquet").read_bytes()

    def run(setting):
        raise RuntimeError("out of memory")

    monkeypatch.setitem(studies.STUDIES, "toy", dataclasses.replace(studies.STUDIES["toy"], run=run))
    with pytest.raises(RuntimeError, match="out of memory"):
        command.run(configured(study="toy", out=tmp_path / "out", seeds=3, overwrite=True))
    assert (tmp_path / "out" / "results.parquet").read_bytes() == before


def test_a_picture_that_fails_costs_no_results(study, tmp_path, monkeypatch):
    def draw(rows):
        raise RuntimeError("no font")

    toy = studies.STUDIES["toy"]
    broken = dataclasses.replace(toy, pictures={"dots": toy.pictures["dots"], "matrix": draw})
    monkeypatch.setitem(studies.STUDIES, "toy", broken)
    with pytest.raises(RuntimeError, match="no font"):
        command.run(configured(study="toy", out=tmp_path / "out", seeds=3))
    held = {path.name for path in (tmp_path / "out").iterdir()}
    assert held == {"results.parquet", "table.md", "config.json", "dots.png"}
    assert not (tmp_path / "out.part").exists()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"study": "severty"}, "did you mean 'severity'"),
        ({"study": "toy", "methods": "[c]"}, "methods must be one of a, bb"),
        ({"study": "toy", "methods": "a"}, "null or a list of some of a, bb"),
        ({"study": "toy", "seeds": 0}, "seeds must be a whole number >= 1"),
        ({"study": "toy", "records": 10}, "records must be a whole number >= 200"),
    ],
)
def test_bad_input_is_one_sentence_before_anything_is_made(study, tmp_path, given, said):
    with pytest.raises(ParameterError, match="compare") as caught:
        command.run(configured(out=tmp_path / "out", **given))
    assert said in str(caught.value) and "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_file_where_the_data_sets_should_be_is_told_as_data(run_command, tmp_path):
    (tmp_path / "table.csv").touch()
    given = ("study=benchmark", "methods=[logistic]", f"data={tmp_path / 'table.csv'}", f"out={tmp_path / 'out'}")
    code, _, err = run_command(command, *given)
    assert code == 2 and err.startswith("error: data must be a folder, got ") and err.count("\n") == 1


def test_a_number_of_records_is_refused_where_they_are_always_the_same(run_command, tmp_path):
    out = tmp_path / "out"
    code, _, err = run_command(command, "study=benchmark", "records=300", f"out={out}")
    assert code == 2 and err == (
        "error: records must be left out with study=benchmark, whose records are always the same, got 300; leave it "
        "out, or compare on data sets of that size with study=baselines.\n"
    )
    assert not out.exists()
    assert [name for name, study in studies.STUDIES.items() if not study.sized] == ["benchmark"]


@pytest.mark.slow
@pytest.mark.parametrize("study", ["baselines", "severity", "novelty", "robustness"])
def test_every_study_runs(study, tmp_path_factory, tmp_path):
    data = tmp_path_factory.getbasetemp() / "compare"
    methods = {"baselines": "[logistic]", "robustness": "['logistic, log']"}.get(study, "null")
    command.run(configured(study=study, out=tmp_path / "out", data=data, seeds=2, records=300, methods=methods))
    rows = pq.read_table(tmp_path / "out" / "results.parquet").to_pylist()
    assert {row["seed"] for row in rows} == {0, 1}
    shown = {metric for metric, _ in studies.STUDIES[study].metrics}
    assert shown <= {row["metric"] for row in rows}
