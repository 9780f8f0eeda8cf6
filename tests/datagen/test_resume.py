"""Nothing is lost: wherever a run stops, the same command goes on and ends with the same bytes (seed 3)."""

from __future__ import annotations

import contextlib
import errno
import json
import logging
import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import datagen
import datagen.__main__
from datagen.executors import LocalExecutor
from datagen.generate import generate
from datagen.shard import read_shards
from indexer_cli.places import StoreError, local
from indexer_env.errors import SignalError
from indexer_env.simulate import Run
from tests.patience import PATIENCE

from .test_generate import contents

ONE = LocalExecutor(workers=1)
"""One worker, so that the n-th step of a run is always the same."""


@pytest.fixture(scope="module", autouse=True)
def plain_pictures():
    """Data cards whose pictures take no time: some hundred data sets are made here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("datagen.pictures.picture", lambda row, title: f"picture of item {row['item']}".encode())
        yield


@pytest.fixture(scope="module")
def small(order):
    return replace(order, run=Run(samples=60, warmup_turns=0), count=5, shard_items=2)


@pytest.fixture(scope="module")
def whole(small, tmp_path_factory) -> dict[str, str]:
    """Checksums of the data set that no one has stopped."""
    folder = tmp_path_factory.mktemp("whole") / "set"
    generate(small, folder, executor=ONE)
    return contents(folder)


class Breaking:
    """The module os of a filesystem whose n-th step fails; counts the steps."""

    STEPS = ("fsync", "replace", "open")

    def __init__(self, fails_at: int, error: BaseException) -> None:
        self.fails_at, self.error, self.steps = fails_at, error, 0

    def __getattr__(self, name: str):
        # Nothing here cuts the power, so nobody waits for the disk.
        step = (lambda handle: None) if name == "fsync" else getattr(os, name)
        return self.counted(step) if name in self.STEPS else step

    def counted(self, step):
        def call(*arguments, **keywords):
            self.steps += 1
            if self.steps == self.fails_at:
                raise self.error
            return step(*arguments, **keywords)

        return call


@contextlib.contextmanager
def broken(monkeypatch, fails_at: int, error: BaseException):
    """A filesystem whose step number `fails_at` raises: of opening, syncing, renaming, writing and deleting."""
    with monkeypatch.context() as patch:
        breaking = Breaking(fails_at, error)
        patch.setattr(local, "os", breaking)
        for name in ("unlink", "write_bytes", "mkdir"):
            patch.setattr(Path, name, breaking.counted(getattr(Path, name)))
        yield breaking


class Killed(BaseException):
    """Ends a run as a kill does: nothing of ours catches it."""


REFUSED = OSError(errno.EIO, "Input/output error")


@pytest.mark.parametrize(
    ("error", "every"),
    [
        pytest.param(REFUSED, 3, id="error"),
        pytest.param(Killed(), 1, id="kill"),
        pytest.param(REFUSED, 1, id="error, every step", marks=pytest.mark.slow),
    ],
)
def test_every_step_that_fails_once_leaves_a_run_that_goes_on(small, tmp_path, monkeypatch, error, every):
    """Two shards; the second run has a disk that works. A kill is the harder one, as nothing is tidied after it."""
    small, steps, stopped = replace(small, count=3), 0, 0
    generate(small, tmp_path / "whole", executor=ONE)
    whole = contents(tmp_path / "whole")
    for fails_at in range(1, 1000, every):
        folder = tmp_path / str(fails_at)
        with broken(monkeypatch, fails_at, error) as breaking:
            try:
                generate(small, folder, executor=ONE)
            except (StoreError, Killed):
                stopped += 1
        steps = breaking.steps
        if steps < fails_at:
            break
        with broken(monkeypatch, 0, error):
            generate(small, folder, executor=ONE)
        assert contents(folder) == whole, fails_at
    assert 60 < steps < 1000 and stopped > 50 // every


def stop_after(monkeypatch, shards: int) -> None:
    """Ctrl-C when so many shards are published."""
    publish, done = datagen.make_shard.Shard.publish, 0

    def counted(self, place):
        nonlocal done
        if done == shards:
            raise KeyboardInterrupt
        done += 1
        return publish(self, place)

    monkeypatch.setattr("datagen.make_shard.Shard.publish", counted)


@pytest.fixture
def stopped(small, tmp_path, monkeypatch) -> Path:
    """A data set of three shards, stopped after two of them."""
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt, match=r"4 of 5 items are done and kept in"):
        stop_after(patch, 2)
        generate(small, tmp_path / "set", executor=ONE)
    return tmp_path / "set"


def test_a_stopped_run_goes_on_where_it_was(small, whole, stopped, monkeypatch, caplog):
    with pytest.raises(SignalError, match="unfinished data set; run the command that began it again"):
        read_shards(stopped)
    made = []
    monkeypatch.setattr(
        "datagen.generate.MakeShard.__call__",
        lambda self, number, call=datagen.make_shard.MakeShard.__call__: made.append(number) or call(self, number),
    )
    with caplog.at_level(logging.INFO, "datagen.progress"):
        generate(small, stopped, executor=ONE)
    assert made == [2] and contents(stopped) == whole
    assert "4 of 5 records are done" in caplog.text and "5 of 5 records" in caplog.text
    run = json.loads((stopped / "run.json").read_text())
    assert run["interruptions"] == 1 and [session["items"] for session in run["sessions"]] == [4, 1]


def test_overwrite_goes_on_with_the_same_order_and_makes_anew_what_is_finished(small, whole, stopped, monkeypatch):
    made = []
    monkeypatch.setattr(
        "datagen.generate.MakeShard.__call__",
        lambda self, number, call=datagen.make_shard.MakeShard.__call__: made.append(number) or call(self, number),
    )
    generate(small, stopped, overwrite=True, executor=ONE)
    assert made == [2] and contents(stopped) == whole
    made.clear()
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt, match="which goes on where this run stopped"):
        stop_after(patch, 2)
        generate(small, stopped, overwrite=True, executor=ONE)
    generate(small, stopped, overwrite=True, executor=ONE)
    assert made[-1] == 2 and sorted(set(made)) == [0, 1, 2] and made.count(0) == 1 and contents(stopped) == whole


def test_a_finished_data_set_without_a_shard_is_told_and_made_anew(small, whole, tmp_path):
    folder = tmp_path / "set"
    generate(small, folder, executor=ONE)
    shard = folder / "data" / "shard-00001.parquet"
    size = shard.stat().st_size
    shard.write_bytes(b"torn")
    with pytest.raises(StoreError, match=rf"of {size} bytes, got .*set with data/shard-00001.parquet of 4 bytes; put"):
        generate(small, folder, executor=ONE)
    shard.unlink()
    with pytest.raises(StoreError, match=r"set without data/shard-00001.parquet; .* add overwrite=true"):
        generate(small, folder, executor=ONE)
    generate(small, folder, overwrite=True, executor=ONE)
    assert contents(folder) == whole


def test_a_torn_shard_or_receipt_is_made_again(small, whole, stopped):
    shard = stopped / "data" / "shard-00000.parquet"
    shard.write_bytes(shard.read_bytes()[:-1] + b"x")
    (stopped / "unfinished" / "shard-00001.json").write_text('{"number": 1, "ord')
    (stopped / "data" / "shard-00002.parquet.part").write_bytes(b"half")
    generate(small, stopped, executor=ONE)
    assert contents(stopped) == whole


def test_another_order_may_not_go_on_and_is_told_which_key_differs(small, stopped):
    before = contents(stopped)
    other = replace(small, config={"note": "mine"})
    with pytest.raises(StoreError, match=r"unfinished .* another order \(note is 'test' there and 'mine' here\)"):
        generate(other, stopped)
    with pytest.raises(StoreError, match=r"\(seed is 3 there and 9 here\)"):
        generate(replace(small, seed=9), stopped)
    assert contents(stopped) == before


def test_overwriting_an_unfinished_data_set_leaves_nothing_of_it(small, whole, stopped, monkeypatch):
    with monkeypatch.context() as patch, pytest.raises(Killed):
        patch.setattr("indexer_cli.places.local.LocalPlace.delete", lambda *_: (_ for _ in ()).throw(Killed))
        generate(replace(small, seed=8), stopped, overwrite=True, executor=ONE)
    generate(replace(small, seed=8), stopped, executor=ONE)
    assert set(read_shards(stopped).table.column("seed").to_pylist()) == {8}
    generate(small, stopped, overwrite=True, executor=ONE)
    assert contents(stopped) == whole


def test_a_finished_data_set_of_the_same_order_is_left_as_it_is(small, whole, tmp_path, caplog):
    manifest = generate(small, tmp_path / "set")
    with caplog.at_level(logging.INFO, "datagen.generate"):
        assert generate(small, tmp_path / "set") == manifest
    assert "nothing is left to do" in caplog.text and contents(tmp_path / "set") == whole


@pytest.mark.parametrize(
    ("number", "words"),
    [(errno.ENOSPC, "No space left"), (errno.EROFS, "Read-only"), (errno.ESTALE, "[Ss]tale"), (errno.EIO, "output")],
)
def test_what_a_filesystem_refuses_is_one_sentence(small, whole, stopped, monkeypatch, number, words):
    with broken(monkeypatch, 12, OSError(number, os.strerror(number))), pytest.raises(StoreError) as caught:
        generate(small, stopped, executor=ONE)
    caught.match(words)
    caught.match(r"run the same command again, which goes on where this run stopped\.$")
    assert "\n" not in str(caught.value)
    generate(small, stopped, executor=ONE)
    assert contents(stopped) == whole


def test_a_filesystem_that_vanishes_is_noticed_before_the_next_shard(small, whole, tmp_path, monkeypatch):
    folder, away = tmp_path / "set", tmp_path / "away"
    publish = datagen.make_shard.Shard.publish

    def vanish_after(self, place):
        receipt = publish(self, place)
        if not away.exists():
            folder.rename(away)
            folder.mkdir()
        return receipt

    with monkeypatch.context() as patch, pytest.raises(StoreError, match="see that the filesystem is there"):
        patch.setattr("datagen.make_shard.Shard.publish", vanish_after)
        generate(small, folder, executor=ONE)
    assert contents(folder) == {}
    folder.rmdir()
    away.rename(folder)
    generate(small, folder, executor=ONE)
    assert contents(folder) == whole


def test_a_full_disk_ends_the_command_in_one_sentence(tmp_path, monkeypatch, run_command):
    """A real refusal of the system: no file may grow beyond 20 kB."""
    root = str(Path(datagen.__file__).parents[1])
    given = ["campaign=table2", "out=set", "run.warmup_turns=0", "count=6"]
    keywords = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": root}, "capture_output": True, "text": True}
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))  # noqa: E731
    command = [sys.executable, "-m", "datagen", *given]
    done = subprocess.run(command, preexec_fn=limit, timeout=PATIENCE, check=False, **keywords)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert "shard-00000.parquet cannot be written (File too large)" in done.stderr
    monkeypatch.chdir(tmp_path)
    code, _, err = run_command(datagen.__main__, *given)
    assert code == 0 and len(read_shards(tmp_path / "set")) == 6, err
