"""The command from end to end on a small setting, in this process; the whole quick study is slow."""

import dataclasses
import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from indexer_env.errors import ParameterError
from indexer_experiments.study import __main__ as study
from indexer_experiments.study.claims import CLAIMS
from indexer_experiments.study.claims.pairs import HIDDEN, Fig8
from indexer_experiments.study.verdicts import Interval, Line, deciding
from indexer_experiments.study.work import Finding, stored

TINY = ("size=quick", "size.others=1", "size.epochs=3", "threads=1")


@pytest.fixture(scope="module")
def run():
    def run(*overrides):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["study", *overrides])
            study.main()

    return run


@pytest.fixture(scope="module")
def settings(small):
    """The main one and another."""
    return small, dataclasses.replace(small, key="other", words="other data")


@pytest.fixture(scope="module")
def out(run, settings, tmp_path_factory):
    """A study of one claim."""
    folder = tmp_path_factory.mktemp("study") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Fig8, "settings", settings)
        run(f"out={folder}", "claims=fig8", *TINY)
    return folder


def test_a_claim_leaves_results_a_picture_and_the_page(out):
    assert {path.name for path in out.iterdir()} == {"study.json", "data", "fig8", "report.html", "verdicts.md"}
    table = pq.read_table(out / "fig8" / "results.parquet")
    assert table.num_rows == 2 * 10 * (2 + 1)  # data sets, variants, networks under both settings
    assert set(table.column("data_seed").to_pylist()) == {0, 1}
    assert (out / "fig8" / "figure.png").stat().st_size > 10_000


def test_the_page_needs_no_other_file_and_no_network(out):
    page = (out / "report.html").read_text(encoding="utf-8")
    HTMLParser().feed(page)
    assert "data:image/png;base64," in page
    assert not re.findall(r"""(?:src|href)=["'](?!#|data:)""", page)
    for words in (
        "A logistic output is better than a linear one",
        "The paper:",
        "over that of linear ones, at best",
        "logistic better (below 1)",
    ):
        assert words in page
    assert re.search(r">(reproduced|undecided|not reproduced)<", page)


def test_what_is_done_is_not_done_again(out, run, settings, monkeypatch):
    monkeypatch.setattr(Fig8, "settings", settings)
    before = (out / "fig8" / "results.parquet").stat().st_mtime_ns
    (out / "report.html").unlink()
    monkeypatch.setattr(Fig8, "collect", lambda *_: pytest.fail("worked on again"))
    run(f"out={out}", "claims=fig8", *TINY)
    assert (out / "fig8" / "results.parquet").stat().st_mtime_ns == before
    assert (out / "report.html").is_file()


def test_a_study_goes_on_with_the_setting_that_failed(run, small, trials, tmp_path, monkeypatch):
    """Seed 0 of the rows. The fourth setting fails once: the three before are kept and not done again."""
    keys = ["small", "second", "third", "fourth"]
    monkeypatch.setattr(Fig8, "settings", tuple(dataclasses.replace(small, key=key) for key in keys))
    levels = {f"{kind}, {hidden} hidden": 0.1 for kind in Fig8.networks for hidden in HIDDEN}
    worked = []

    def collect(self, lab, setting):
        worked.append((setting.key, lab.size.trainings))
        if worked == [(key, 2 if key == "small" else 1) for key in keys]:
            raise RuntimeError("the network file system went away")
        return [row | {"setting": setting.key} for row in trials(levels)]

    monkeypatch.setattr(Fig8, "collect", collect)
    given = (f"out={tmp_path}", "claims=fig8", *TINY)
    with pytest.raises(RuntimeError, match="went away"):
        run(*given)
    kept = stored(CLAIMS["fig8"], tmp_path)
    assert kept is not None and list(kept.rows) == keys[:3] and not (tmp_path / "report.html").exists()
    run(*given)
    assert [key for key, _ in worked] == [*keys, "fourth"]
    whole = stored(CLAIMS["fig8"], tmp_path)
    assert whole is not None and list(whole.rows) == keys and (tmp_path / "report.html").is_file()


def test_a_picture_that_fails_costs_no_results(run, small, trials, tmp_path, monkeypatch):
    """Seed 0 of the rows. The next run draws it, and does no more."""
    monkeypatch.setattr(Fig8, "settings", (small,))
    levels = {f"{kind}, {hidden} hidden": 0.1 for kind in Fig8.networks for hidden in HIDDEN}
    monkeypatch.setattr(Fig8, "collect", lambda *_: [row | {"setting": "small"} for row in trials(levels)])
    given = (f"out={tmp_path}", "claims=fig8", *TINY)
    with monkeypatch.context() as patch, pytest.raises(RuntimeError, match="no font"):
        patch.setattr(Finding, "picture", lambda _: (_ for _ in ()).throw(RuntimeError("no font")))
        run(*given)
    assert {path.name for path in (tmp_path / "fig8").iterdir()} == {"results.parquet"}
    monkeypatch.setattr(Fig8, "collect", lambda *_: pytest.fail("worked on again"))
    run(*given)
    assert (tmp_path / "fig8" / "figure.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("claims=fig44",), "did you mean 'fig4'"),
        (("claims=[]",), "claims must be all, or one or a list"),
        (("claims=fig4,fig5",), "write it in [] for a list"),
        (("size.trainings=-1",), "size.trainings must be a whole number >= 1, got -1"),
        (("size.data_sets=1",), "size.data_sets must be a whole number >= 2, got 1"),
        (("size.others=-1",), "size.others must be a whole number >= 0, got -1"),
        (("size=huge",), "size must be one of"),
        (("size.epoch=5",), "did you mean 'epochs'"),
        (("seed=-1",), "seed must be a whole number"),
        (("threads=0",), "threads must be a whole number"),
        (("size.trainings=3",), "it holds one with size.trainings 2 instead of 3; name another"),
        (("seed=5",), "it holds one with seed 0 instead of 5; name another"),
        (("out=null",), "out must be a path"),
    ],
)
def test_bad_input_is_one_sentence(out, run, capsys, overrides, words):
    before = sorted(out.rglob("*"))
    with pytest.raises(SystemExit) as stopped:
        run(f"out={out}", *TINY, *overrides)
    err = capsys.readouterr().err
    assert stopped.value.code == 2 and err.startswith("error: ") and len(err.strip().splitlines()) == 1, err
    assert words in err
    assert sorted(out.rglob("*")) == before


def test_a_folder_with_other_files_is_left_alone(run, tmp_path, capsys):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(SystemExit):
        run(f"out={tmp_path}", *TINY)
    assert "it holds other files" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_study_of_other_versions_is_not_gone_on_with(out, run, tmp_path, capsys):
    marked = json.loads((out / "study.json").read_text())
    marked["versions"]["numpy"] = "1.0"
    (tmp_path / "study.json").write_text(json.dumps(marked))
    with pytest.raises(SystemExit):
        run(f"out={tmp_path}", "claims=fig8", *TINY)
    assert "of the same size, seed and versions, got" in (err := capsys.readouterr().err)
    assert "it holds one with numpy 1.0 instead of " in err and err.count("\n") == 1


@pytest.mark.parametrize("content", ["", "{", "[]"])
def test_a_mark_that_is_cut_off_is_refused(run, tmp_path, capsys, content):
    (tmp_path / "study.json").write_text(content)
    with pytest.raises(SystemExit):
        run(f"out={tmp_path}", "claims=fig8", *TINY)
    err = capsys.readouterr().err
    assert "out must be a folder whose study.json is whole, got" in err and err.count("\n") == 1


def _without(table: pa.Table, setting: str) -> pa.Table:
    return table.filter(pc.field("setting") != setting)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:-100]), "in which results.parquet of each claim is whole"),
        (lambda path: pq.write_table(pq.read_table(path).replace_schema_metadata(), path), "of each claim is whole"),
        (lambda path: pq.write_table(pq.read_table(path).drop(["setting"]), path), "of each claim is whole"),
        (lambda path: pq.write_table(_without(pq.read_table(path), "small"), path), "got “other” in"),
        (lambda path: pq.write_table(pq.read_table(path)[:0], path), "“small”, “other”, got none in"),
    ],
)
def test_results_that_are_damaged_are_refused(out, settings, tmp_path, monkeypatch, spoil, said):
    monkeypatch.setattr(Fig8, "settings", settings)
    shutil.copytree(out / "fig8", tmp_path / "fig8")
    spoil(tmp_path / "fig8" / "results.parquet")
    with pytest.raises(ParameterError, match=r"study\.out must be a folder .*; delete .*fig8, and the claim") as told:
        stored(CLAIMS["fig8"], tmp_path)
    assert said in str(told.value)


def test_results_under_settings_that_a_claim_has_no_longer_are_refused(out, settings, monkeypatch):
    monkeypatch.setattr(Fig8, "settings", settings[:1])
    with pytest.raises(ParameterError, match="of its settings, “small”, got “small”, “other” in"):
        stored(CLAIMS["fig8"], out)


@pytest.mark.slow
def test_the_whole_quick_study(tmp_path):
    given = (f"out={tmp_path}", "size=quick", "size.others=1", "threads=1")
    command = [sys.executable, "-m", "indexer_experiments.study", *given]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("<h2") == page.count("What it hangs on") == len(CLAIMS)


def test_the_verdicts_as_markdown_are_those_of_the_page(out):
    page, text = ((out / name).read_text(encoding="utf-8") for name in ("report.html", "verdicts.md"))
    verdict = re.search(r"\| \*\*(reproduced|undecided|not reproduced)\*\* \|", text)
    assert verdict and f">{verdict[1]}</span>" in page
    assert "over 2 data sets (seeds 0 to 1). On each there are 2 networks of each kind" in text
    assert "| **small**: small data |" in text and "| **other**: other data |" in text


def test_the_page_begins_with_what_a_minute_needs(out, settings, monkeypatch):
    """The paper's number, ours with its interval, the verdict and why, of the line that decides; then the rule."""
    monkeypatch.setattr(Fig8, "settings", settings)
    top = (out / "report.html").read_text(encoding="utf-8").split("<h2")[0]
    line = deciding(stored(CLAIMS["fig8"], out).main)
    for words in (line.paper, line.found, line.says, line.why.split(":")[0], line.verdict):
        assert words in top
    assert "A line is reproduced where the interval lies wholly inside the range" in " ".join(top.split())


@pytest.mark.parametrize(
    ("main", "others", "sentence"),
    [
        ("reproduced", {}, ""),
        ("reproduced", {"noise": "reproduced", "raw": "reproduced"}, "The same under all other settings."),
        (
            "not reproduced",
            {"noise": "undecided", "raw": "reproduced", "log": "not reproduced", "mild": "undecided"},
            "Otherwise reproduced: “raw”; undecided: “noise”, “mild”.",
        ),
    ],
)
def test_a_sentence_says_where_the_verdict_is_another_one(main, others, sentence):
    intervals = {
        "reproduced": Interval(0.5, 0.4, 0.6),
        "undecided": Interval(1.0, 0.5, 1.5),
        "not reproduced": Interval(3.0, 2.0, 4.0),
    }

    class Judged(Fig8):
        def judge(self, rows):
            return tuple(
                Line("what", "logistic better (below 1)", intervals[verdict], "Why.", high=1.0) for verdict in rows
            )

    claim = Judged()
    rows = {claim.settings[0].key: [main], **{key: [verdict] for key, verdict in others.items()}}
    assert Finding(claim, rows, 0.0).elsewhere == sentence
