"""The command of the drives' challenge goes on where it was, and answers a mistake with one sentence."""

import json
from pathlib import Path

import pytest

from indexer_env.errors import SignalError
from indexer_experiments.challenge.drives import __main__ as command
from indexer_experiments.challenge.drives.score import Judged


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Seeds and numbers of the cases that are run, without the search; number 3 cannot be, number 7 is a fault."""
    found: list[tuple[int, int]] = []

    def judged(case: tuple[int, int]) -> Judged:
        found.append(case)
        if case[1] == 3:
            raise SignalError("A record is too short.")
        if case[1] == 7:
            raise ZeroDivisionError
        return Judged(case[1], ("offset",), (), (("offset", "cogging"),), ("delay",), 9.0, float("nan"), 1.0, 2.0)

    monkeypatch.setattr(command, "draw", lambda seed, number: (seed, number))
    monkeypatch.setattr(command, "judged", judged)
    return found


def test_a_case_in_the_file_is_not_run_again_and_the_table_is_of_the_file(ran, tmp_path, capsys) -> None:
    out = tmp_path / "cases.jsonl"
    assert command.main(["2", "--out", str(out)]) == 0
    first = capsys.readouterr().out
    assert command.main(["2", "--out", str(out)]) == 0
    assert ran == [(0, 0), (0, 1)] and len(out.read_text().splitlines()) == 2
    assert capsys.readouterr().out == first[first.index("cases 2:") :], "the same table"
    assert command.main(["1", "--first", "2", "--out", str(out)]) == 0
    assert "cases 3:" in capsys.readouterr().out


def test_a_line_that_a_stopped_run_did_not_end_is_run_again(ran, tmp_path) -> None:
    out = tmp_path / "cases.jsonl"
    command.main(["2", "--out", str(out)])
    whole = out.read_text()
    out.write_text(whole[:-20])
    assert command.main(["2", "--out", str(out)]) == 0
    assert ran == [(0, 0), (0, 1), (0, 1)] and out.read_text() == whole


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("0", "must be 1 or more, got 0"),
        ("2.5", "invalid whole number value: '2.5'"),
        ("2 --seed -1", "must be 0 or more, got -1"),
        ("2 --first -1", "must be 0 or more, got -1"),
        ("2 --out missing/cases.jsonl", "drives.out must be a file that can be written"),
        ("2 --out .", "drives.out must be a file that can be written"),
        ("2 --out other.jsonl", "it holds something else"),
        ("2 --out seed.jsonl", "it is of seed 5 and version"),
        ("2 --out version.jsonl", "it is of seed 0 and version old"),
    ],
)
def test_a_mistake_is_one_sentence_before_any_case(line, told, ran, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    command.main(["1", "--seed", "5", "--out", "seed.jsonl"])
    row = json.loads(Path("seed.jsonl").read_text())
    Path("version.jsonl").write_text(json.dumps({**row, "seed": 0, "version": "old"}) + "\n")
    Path("other.jsonl").write_text('{"a": 1}\nkept')
    ran.clear()
    with pytest.raises(SystemExit) as stopped:
        command.main(line.split())
    assert stopped.value.code == 2 and told in capsys.readouterr().err and not ran
    assert Path("other.jsonl").read_text() == '{"a": 1}\nkept', "another's file is left alone"


def test_a_case_that_cannot_be_answered_is_told_and_the_others_go_on(ran, tmp_path, capsys) -> None:
    assert command.main(["5", "--out", str(tmp_path / "cases.jsonl")]) == 1
    printed = capsys.readouterr()
    assert "cases 4:" in printed.out
    assert "3: A record is too short." in printed.err and "1 of 5 cases has no answer" in printed.err


def test_a_fault_of_the_software_leaves_the_table_of_what_is_done(ran, capsys) -> None:
    with pytest.raises(ZeroDivisionError):
        command.main(["3", "--first", "5"])
    assert "cases 2:" in capsys.readouterr().out


def test_a_run_that_is_stopped_from_the_keyboard_tells_its_table(ran, monkeypatch, capsys) -> None:
    def stopped(seed: int, number: int) -> tuple[int, int]:
        if number == 2:
            raise KeyboardInterrupt
        return seed, number

    monkeypatch.setattr(command, "draw", stopped)
    assert command.main(["4"]) == 130
    assert "cases 2:" in capsys.readouterr().out
