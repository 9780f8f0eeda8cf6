"""The command from end to end on a small setting, in this process; the whole quick study is slow."""

import re
import subprocess
import sys
from html.parser import HTMLParser

import pyarrow.parquet as pq
import pytest

from classifier.study import __main__ as study
from classifier.study.claims.pairs import Fig8

TINY = ("size=quick", "size.trainings=2", "size.epochs=3", "threads=1")


@pytest.fixture(scope="module")
def run():
    def run(*overrides):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["study", *overrides])
            study.main()

    return run


@pytest.fixture(scope="module")
def out(run, small, tmp_path_factory):
    """A study of one claim."""
    folder = tmp_path_factory.mktemp("study") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Fig8, "settings", (small,))
        run(f"out={folder}", "claims=fig8", *TINY)
    return folder


def test_a_claim_leaves_results_a_picture_and_the_page(out):
    assert {path.name for path in out.iterdir()} == {"study.json", "data", "fig8", "report.html", "verdicts.md"}
    table = pq.read_table(out / "fig8" / "results.parquet")
    assert table.num_rows == 2 * 10 * 2  # data sets, variants, networks
    assert set(table.column("data_seed").to_pylist()) == {0, 1}
    assert (out / "fig8" / "figure.png").stat().st_size > 10_000


def test_the_page_needs_no_other_file_and_no_network(out):
    page = (out / "report.html").read_text(encoding="utf-8")
    HTMLParser().feed(page)
    assert "data:image/png;base64," in page
    assert not re.findall(r"""(?:src|href)=["'](?!#|data:)""", page)
    for words in ("A logistic output is better than a linear one", "The paper:", "logistic better at best", "ratio"):
        assert words in page
    assert re.search(r"holds|does not hold", page)


def test_what_is_done_is_not_done_again(out, run, small, monkeypatch):
    monkeypatch.setattr(Fig8, "settings", (small,))
    before = (out / "fig8" / "results.parquet").stat().st_mtime_ns
    (out / "report.html").unlink()
    monkeypatch.setattr(Fig8, "collect", lambda *_: pytest.fail("worked on again"))
    run(f"out={out}", "claims=fig8", *TINY)
    assert (out / "fig8" / "results.parquet").stat().st_mtime_ns == before
    assert (out / "report.html").is_file()


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("claims=fig44",), "did you mean 'fig4'"),
        (("claims=[]",), "claims must be all, or one or a list"),
        (("claims=fig4,fig5",), "write it in [] for a list"),
        (("size.trainings=-1",), "size.trainings must be a whole number >= 1, got -1"),
        (("size.data_seeds=1",), "size.data_seeds must be a whole number >= 2, got 1"),
        (("size=huge",), "size must be one of"),
        (("size.epoch=5",), "did you mean 'epochs'"),
        (("seed=-1",), "seed must be a whole number"),
        (("threads=0",), "threads must be a whole number"),
        (("size.trainings=3",), "of another size or seed"),
        (("seed=5",), "of another size or seed"),
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


@pytest.mark.slow
def test_the_whole_quick_study(tmp_path):
    command = [
        sys.executable,
        "-m",
        "classifier.study",
        f"out={tmp_path}",
        "size=quick",
        "size.others=true",
        "threads=1",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("<h2") == 10 and page.count("Does the verdict hang on these choices?") == 10


def test_the_verdicts_as_markdown_are_those_of_the_page(out):
    page, text = ((out / name).read_text(encoding="utf-8") for name in ("report.html", "verdicts.md"))
    verdict = re.search(r"\| \*\*(holds|holds in part|does not hold)\*\* \|", text)
    assert verdict and f">{verdict[1]}</span>" in page
    assert "- logistic better at best? Rule: the ratio's whole interval lies below 1." in text
