import errno
import fcntl
import os
from pathlib import Path

import pytest

from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.places import StoreError
from indexer_cli.places.local import LocalPlace
from indexer_env.errors import ParameterError

OWN = ("mark.txt", "more.txt")


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


def write(out, text, overwrite=False):
    with output_folder(out, OWN, overwrite) as folder:
        (folder / "mark.txt").write_text(text)
    return out


@pytest.mark.parametrize("prepare", [lambda out: None, lambda out: out.mkdir()])
def test_a_new_or_empty_folder_is_filled(tmp_path, prepare):
    out = tmp_path / "a" / "b"
    out.parent.mkdir()
    prepare(out)
    write(out, "first")
    assert files(tmp_path) == {"a/b/mark.txt": "first"}


def test_an_error_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError), output_folder(tmp_path / "out", OWN) as folder:
        (folder / "half.txt").write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_result_is_replaced_only_when_asked(tmp_path):
    out = write(tmp_path / "out", "first")
    (out / "more.txt").write_text("of the first")
    with pytest.raises(ParameterError, match="overwrite=true"):
        write(out, "second")
    assert files(out) == {"mark.txt": "first", "more.txt": "of the first"}
    write(out, "second", overwrite=True)
    assert files(tmp_path) == {"out/mark.txt": "second"}


def test_an_error_while_replacing_keeps_the_earlier_result(tmp_path):
    out = write(tmp_path / "out", "first")
    with pytest.raises(RuntimeError), output_folder(out, OWN, True) as folder:
        (folder / "mark.txt").write_text("second")
        raise RuntimeError
    assert files(tmp_path) == {"out/mark.txt": "first"}


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_foreign_folder_is_never_touched(tmp_path, overwrite):
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(ParameterError, match="it holds other files"):
        write(tmp_path, "second", overwrite)
    assert files(tmp_path) == {"thesis.txt": "mine"}


def test_a_file_added_to_an_earlier_result_is_never_lost(tmp_path):
    out = write(tmp_path / "out", "first")
    (out / "notes.txt").write_text("mine")
    with pytest.raises(ParameterError, match=r"notes\.txt"):
        write(out, "second", overwrite=True)
    assert files(out) == {"mark.txt": "first", "notes.txt": "mine"}


def test_of_two_runs_the_first_to_end_wins(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(ParameterError, match="overwrite=true"), output_folder(out, OWN) as folder:
        (folder / "mark.txt").write_text("second")
        write(out, "first")
    assert files(tmp_path) == {"out/mark.txt": "first"}


def test_of_two_runs_that_end_at_once_one_result_stays_whole(tmp_path, monkeypatch):
    """The second takes the place in the moment in which the first has put the earlier result aside."""
    out, rename = write(tmp_path / "out", "earlier"), Path.rename

    def overtaken(path, target):
        rename(path, target)
        if Path(target).name == "old" and not (tmp_path / "out").exists():
            write(out, "second", overwrite=True)

    monkeypatch.setattr(Path, "rename", overtaken)
    with pytest.raises(StoreError, match=r"no other run is writing to, got .*out, where another has just ended"):
        write(out, "first", overwrite=True)
    assert files(tmp_path) == {"out/mark.txt": "second"}


def test_a_result_that_cannot_take_its_place_leaves_the_earlier_one(tmp_path, monkeypatch):
    out, rename = write(tmp_path / "out", "earlier"), Path.rename

    def failing(path, target):
        if path.name == "new":
            raise OSError(errno.EIO, "Input/output error")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(OSError, match="Input/output error"):
        write(out, "first", overwrite=True)
    assert files(tmp_path) == {"out/mark.txt": "earlier"}


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path):
    write(tmp_path / "disk" / "out", "first")
    (tmp_path / "link").symlink_to(tmp_path / "disk" / "out")
    write(tmp_path / "link", "second", overwrite=True)
    assert (tmp_path / "link").is_symlink() and files(tmp_path / "disk") == {"out/mark.txt": "second"}


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(StoreError, match="must be a folder"):
        check_output_folder(tmp_path / "out" / "below", OWN, False)
    with pytest.raises(StoreError, match="must be a folder"):
        check_output_folder(tmp_path / "out", OWN, True)


@pytest.mark.parametrize("below", ["", "inner"])
def test_the_working_folder_and_those_above_it_are_not_replaced(tmp_path, monkeypatch, below):
    (tmp_path / "here" / below).mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here" / below)
    with pytest.raises(StoreError, match="which is the working folder or one above it; name a folder in it"):
        check_output_folder(tmp_path / "here", OWN, False)


def test_a_folder_that_cannot_be_replaced_is_refused_before_the_work(tmp_path, monkeypatch):
    out = write(tmp_path / "out", "first")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "is_mount", lambda path: path.name == "out")
        with pytest.raises(StoreError, match=r"got .*out, where a disk is mounted; name a folder in it"):
            check_output_folder(out, OWN, True)
    monkeypatch.setattr(os, "access", lambda path, _: Path(path) != tmp_path)
    with pytest.raises(StoreError, match=r"got .*out, in .*, which may not be written to; name a folder in it"):
        check_output_folder(out, OWN, True)
    assert files(out) == {"mark.txt": "first"}


def test_a_folder_that_cannot_be_locked_is_told_in_a_sentence(tmp_path, monkeypatch):
    """As on a network file system without locks."""

    def no_locks(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    told = r"can be locked, got .* \(No locks available\); choose one on a local disk"
    with pytest.raises(StoreError, match=told), LocalPlace(tmp_path / "out").exclusive():
        pass
