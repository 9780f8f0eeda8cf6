"""Folders behind URLs: the same data set as on this machine, whole files, and one order at a time (seed 3)."""

from __future__ import annotations

import contextlib
import itertools
import pickle
from dataclasses import replace

import numpy as np
import pytest

import datagen
from datagen.batches import RecordStream
from datagen.check import check
from datagen.executors import LocalExecutor
from datagen.generate import generate, head
from datagen.shard import read_shards
from datagen.store import ORDER, as_json, making
from indexer_cli.places import LocalPlace, RemotePlace, StoreError, is_url, open_place
from indexer_env.errors import SignalError
from indexer_env.simulate import Run

BUCKET = "records"


@pytest.fixture(scope="module")
def small(order):
    return replace(order, run=Run(samples=60, warmup_turns=0), count=5, shard_items=2)


@pytest.fixture(scope="module")
def local(small, tmp_path_factory) -> dict[str, bytes]:
    """The data set in a folder of this machine."""
    folder = tmp_path_factory.mktemp("local") / "set"
    generate(small, folder)
    return files(folder)


def files(out) -> dict[str, bytes]:
    place = open_place(out)
    return {name: place.read(name) or b"" for name in place.names() if name not in ("run.json", "README.md")}


@pytest.fixture
def memory(request):
    fsspec = pytest.importorskip("fsspec")
    fsspec.filesystem("memory").store.clear()
    return f"memory://{BUCKET}/{request.node.name.partition('[')[0]}"


@pytest.fixture(scope="module")
def server():
    """A local S3 server."""
    reason = "needs an S3 server and client: pip install 'moto[server]' s3fs"
    moto = pytest.importorskip("moto.server", reason=reason)
    pytest.importorskip("s3fs", reason=reason)
    server = moto.ThreadedMotoServer(port=0)
    server.start()
    yield server
    server.stop()


@pytest.fixture
def s3(server, request, monkeypatch):
    for name, value in {
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    host, port = server.get_host_and_port()
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
    import s3fs

    s3fs.S3FileSystem.clear_instance_cache()
    s3fs.S3FileSystem(use_listings_cache=False).makedirs(BUCKET, exist_ok=True)
    return f"s3://{BUCKET}/{request.node.name.partition('[')[0]}"


@pytest.fixture(params=["memory", pytest.param("s3", marks=pytest.mark.filterwarnings("default"))])
def url(request):
    return request.getfixturevalue(request.param)


def test_the_same_files_behind_a_url(small, local, url):
    generate(small, url)
    assert files(url) == local


def test_a_data_set_behind_a_url_is_read_and_checked(small, tmp_path, url):
    generate(small, url)
    generate(small, tmp_path / "local")
    there, here = read_shards(url), read_shards(tmp_path / "local")
    assert there.table.equals(here.table)
    np.testing.assert_array_equal(there.records, here.records)
    items = [batch["item"].tolist() for batch in RecordStream(url, ("item",), batch_size=2, window=2)]
    assert sorted(itertools.chain(*items)) == [0, 1, 2, 3, 4]
    assert check(url).faults == []
    place, name = open_place(url), there.manifest["shards"][0]["name"]
    place.publish(name, (place.read(name) or b"")[:-1])
    assert any("it was cut or changed" in fault and fault.startswith(name) for fault in check(url).faults)
    with pytest.raises(SignalError, match=r"is no folder that holds a data set"):
        read_shards(f"{url}-none")


def test_a_stopped_run_goes_on_behind_a_url(small, local, url, monkeypatch):
    publish, calls = datagen.make_shard.Shard.publish, []

    def counted(self, place):
        calls.append(self)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return publish(self, place)

    monkeypatch.setattr("datagen.make_shard.Shard.publish", counted)
    with pytest.raises(KeyboardInterrupt, match="4 of 5 items are done"):
        generate(small, url, executor=LocalExecutor(1))
    assert ORDER in open_place(url).names()
    with pytest.raises(StoreError, match=r"seed is 3 there and 9 here"):
        generate(replace(small, seed=9), url)
    generate(small, url)
    assert files(url) == local and len(calls) == 4


def test_shards_that_another_run_of_the_same_order_has_made_count_once(small, local, url, monkeypatch):
    """It began and made its first shard while this one was making its own."""
    begin, other = datagen.generate._until_a_record, []

    def overtaken(*given):
        made = begin(*given)
        if not other:
            other.append(True)
            with contextlib.suppress(KeyboardInterrupt), monkeypatch.context() as patched:
                patched.setattr("datagen.generate._make_the_rest", stopped)
                generate(small, url)
        return made

    def stopped(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr("datagen.generate._until_a_record", overtaken)
    assert generate(small, url)["records"] == len(read_shards(url)) and files(url) == local


def test_a_data_set_behind_a_url_is_replaced_only_when_asked(small, local, url):
    generate(replace(small, seed=9), url)
    with pytest.raises(StoreError, match=r"\(seed is 9 there and 3 here\); add overwrite=true"):
        generate(small, url)
    generate(small, url, overwrite=True)
    assert files(url) == local


def test_an_order_is_claimed_once(small, url):
    place = open_place(url)
    assert place.claim(ORDER, b"mine") and not place.claim(ORDER, b"yours")
    assert place.read(ORDER) == b"mine"


def test_a_run_that_another_has_replaced_stops(small, url):
    place = open_place(url)
    with making(url, head(small), overwrite=False):
        place.publish(ORDER, as_json(head(replace(small, seed=9))))
        task = datagen.make_shard.MakeShard(small, head(small), place)
        with pytest.raises(StoreError, match=r"order\.json has gone or is another run's"):
            task(0)
    assert place.names() == [ORDER]


def test_a_place_behind_a_url_travels_to_other_processes(url):
    open_place(url).publish("a/b.txt", b"x")
    place = pickle.loads(pickle.dumps(open_place(url)))
    assert place.names() == ["a/b.txt"] and place.open("a/b.txt").read() == b"x"
    place.delete(["a/b.txt", "never.txt"])
    assert place.names() == [] and place.read("a/b.txt") is None and place.size("a/b.txt") is None


def test_a_server_that_does_not_answer_is_one_sentence(small, s3, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    import s3fs

    s3fs.S3FileSystem.clear_instance_cache()
    with pytest.raises(StoreError, match=r"s3://\S+ cannot be read \(.+\); check the connection") as caught:
        generate(small, s3)
    assert "\n" not in str(caught.value)


def test_a_protocol_that_is_not_there(small):
    with pytest.raises(StoreError, match="a URL that fsspec knows, got nosuch://x"):
        open_place("nosuch://x")


def test_what_is_a_url(tmp_path):
    assert is_url("s3://bucket/x") and not is_url("data/x") and not is_url(tmp_path) and not is_url(3)
    assert not is_url("file:///data/x") and isinstance(open_place("file:///data/x"), LocalPlace)
    assert isinstance(open_place("memory://x"), RemotePlace)
