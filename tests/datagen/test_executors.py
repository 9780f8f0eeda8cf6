"""The same bytes whoever makes the shards, in whatever order; clusters that lose a worker or a node (seed 3)."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import time
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, TypeVar

import pytest

from datagen.executors import EXECUTORS, Executor, ExecutorError, LocalExecutor, RayExecutor, make_executor
from datagen.generate import generate, head
from datagen.make_shard import MakeShard, Shard, make_shard
from indexer_cli.places import StoreError
from indexer_env.errors import ParameterError
from indexer_env.sensors import Sensor
from tests.patience import PATIENCE

from .test_generate import contents

T = TypeVar("T")


@dataclass(frozen=True)
class Shuffled(Executor):
    """Does the tasks in an order of chance and has the driver publish them, as a cluster does."""

    here: ClassVar[bool] = False

    seed: int

    def describe(self) -> str:
        return "shuffled"

    def threads(self, tasks: int) -> int:
        return 1

    def map(self, task: Callable[[int], T], numbers: Iterable[int]) -> Generator[T]:
        left = list(numbers)
        random.Random(self.seed).shuffle(left)
        yield from map(task, left)


@pytest.mark.parametrize("executor", [LocalExecutor(1), LocalExecutor(3), Shuffled(0), Shuffled(1)], ids=str)
def test_the_same_bytes_whoever_makes_the_shards(dataset, order, tmp_path, executor):
    generate(order, tmp_path / "set", executor=executor)
    assert contents(tmp_path / "set") == contents(dataset)


def test_threads_change_no_byte(order):
    assert make_shard(order, 1, threads=1) == make_shard(order, 1, threads=3)
    assert make_shard(order, 1) != make_shard(order, 0)


def test_an_error_of_a_task_comes_through_and_stops_the_others():
    done = []

    def task(number: int) -> int:
        if number == 2:
            raise ParameterError("two is refused.")
        done.append(number)
        return number

    with pytest.raises(ParameterError, match="two is refused"):
        list(LocalExecutor(1).map(task, range(100)))
    assert len(done) < 10


def test_no_more_tasks_are_taken_than_workers_can_do():
    """However many there are, few are in work: memory is that of the workers."""
    taken = []
    answers = LocalExecutor(2).map(lambda number: number, (taken.append(n) or n for n in range(1000)))
    for _ in range(10):
        next(answers)
    answers.close()
    assert len(taken) <= 10 + 2 * 2


def test_no_core_idles_where_shards_are_few():
    assert [LocalExecutor(8).threads(tasks) for tasks in (0, 1, 3, 8, 100)] == [8, 8, 2, 1, 1]


def test_a_node_with_other_versions_is_refused(order):
    marked = head(order)
    marked["versions"]["numpy"] = "1.0"
    with pytest.raises(StoreError, match=r"every node must have numpy 1\.0 as the one that started the run, got"):
        MakeShard(order, marked)(0)


def test_executors_by_name():
    assert make_executor("local", 2, None) == LocalExecutor(2)
    assert make_executor("ray", None, None) == RayExecutor("auto")
    assert set(EXECUTORS) == {"local", "ray"}
    for arguments, sentence in [
        (("rya", None, None), "executor must be one of local, ray, got 'rya'; did you mean 'ray'"),
        (("local", 0, None), "workers must be a whole number >= 1"),
        (("ray", 1.5, None), "workers must be a whole number"),
        (("ray", None, 7), "address must be auto, local or the address of a Ray cluster, got 7"),
        (("local", None, "auto"), "address must be left out .* add executor=ray"),
    ]:
        with pytest.raises(ParameterError, match=sentence):
            make_executor(*arguments)


def test_ray_that_is_not_installed_is_one_sentence(order, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ray", None)
    with pytest.raises(ExecutorError, match=r"pip install 'indexer-diagnosis\[ray\]'"):
        generate(order, tmp_path / "set", executor=RayExecutor())
    assert not (tmp_path / "set").exists()


@pytest.fixture
def cluster():
    """A head without cores and two nodes of one core each; gives the cluster and its two nodes."""
    ray = pytest.importorskip("ray", reason="needs the extra [ray]")
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    nodes = [cluster.add_node(num_cpus=1) for _ in range(2)]
    yield cluster, nodes
    ray.shutdown()
    cluster.shutdown()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_cluster_that_loses_a_worker_and_a_node_makes_the_same_data_set(cluster, order, tmp_path, monkeypatch):
    """20 shards; a worker process is killed after the third and a node after the sixth."""
    ray_cluster, nodes = cluster
    order = replace(order, count=40, shard_items=2)
    lost = []

    def losing(self, place, publish=Shard.publish):
        if self.receipt.number >= 3 and not lost:
            lost.append(kill_a_worker())
        elif len(lost) == 1 and self.receipt.number >= 6:
            ray_cluster.remove_node(nodes[0], allow_graceful=False)
            lost.append("node")
        return publish(self, place)

    with monkeypatch.context() as patch:
        patch.setattr("datagen.make_shard.Shard.publish", losing)
        generate(order, tmp_path / "ray", executor=RayExecutor(ray_cluster.address))
    assert lost == ["worker", "node"]
    generate(order, tmp_path / "local")
    assert contents(tmp_path / "ray") == contents(tmp_path / "local")


def kill_a_worker() -> str:
    """End a worker process of the cluster that is at a task of ours."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        for process in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if b"ray::_answer" in (process / "cmdline").read_bytes():
                    os.kill(int(process.name), signal.SIGKILL)
                    return "worker"
        time.sleep(0.001)
    raise AssertionError("no worker was at work")


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_an_error_on_a_cluster_is_the_same_sentence(cluster, order, tmp_path):
    with pytest.raises(ParameterError, match="fastest mode"):
        base = replace(order.base, sensor=Sensor())
        coarse = replace(order, base=base, run=replace(order.run, sample_rate=50.0, step=0.02))
        generate(coarse, tmp_path / "ray", executor=RayExecutor(cluster[0].address))
    assert not (tmp_path / "ray").exists()


def test_no_cluster_is_one_sentence(order, tmp_path, monkeypatch):
    """Whether a cluster runs on this machine is not for a test to say, so Ray's answer is given here."""
    ray = pytest.importorskip("ray", reason="needs the extra [ray]")

    def nobody(*_: object, **__: object) -> None:
        raise ConnectionError("Could not find any running Ray instance.\nPlease specify the one to connect to.")

    monkeypatch.setattr(ray, "init", nobody)
    with pytest.raises(
        ExecutorError, match=r"no Ray cluster answers at address auto .*start one with `ray start"
    ) as it:
        generate(order, tmp_path / "set", executor=RayExecutor("auto"))
    assert "\n" not in str(it.value) and not (tmp_path / "set").exists()
