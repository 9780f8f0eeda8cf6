import pytest

from indexer_cli.words import counted, plain_console


def test_one_is_one_and_others_are_many():
    assert [counted(n, "file") for n in (0, 1, 2)] == ["0 files", "1 file", "2 files"]
    assert counted(2, "file or turn", "files or turns") == "2 files or turns"


def test_what_is_said_is_neither_cut_nor_marked_up(capsys: pytest.CaptureFixture[str]):
    said = f"speed [rad/s] {'1200 ' * 60}rpm"
    plain_console().print(said)
    assert capsys.readouterr().out == said + "\n"
