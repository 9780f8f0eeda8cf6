from indexer_cli.words import counted


def test_one_is_one_and_others_are_many():
    assert [counted(n, "file") for n in (0, 1, 2)] == ["0 files", "1 file", "2 files"]
    assert counted(2, "file or turn", "files or turns") == "2 files or turns"
