"""A reader of standard output that leaves stops nothing."""

import os
import sys

from indexer_cli.pipe import forgiving_output


def test_what_is_printed_after_the_reader_left_is_lost_and_nothing_else(monkeypatch):
    reader, writer = os.pipe()
    with open(writer, "w", buffering=1) as stream:
        monkeypatch.setattr("sys.stdout", stream)
        with forgiving_output():
            print("one")
            os.close(reader)
            print("two")
            print("three", end="")
            done = sys.stdout.fileno()
        assert done == writer and sys.stdout is stream


def test_what_was_printed_is_read(capsys):
    with forgiving_output():
        print("one")
        assert not sys.stdout.isatty()
    assert capsys.readouterr().out == "one\n"
