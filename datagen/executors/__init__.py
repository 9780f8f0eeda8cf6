"""Who makes the shards of a data set, one file each: threads of this process (`local`), or tasks of a Ray
cluster (`ray`); `base` says what both are."""

from __future__ import annotations

from datagen.executors.base import Executor, ExecutorError
from datagen.executors.local import LocalExecutor
from datagen.executors.ray import RayExecutor
from indexer_env.checks import check_choice
from indexer_env.errors import refuse

__all__ = ["EXECUTORS", "Executor", "ExecutorError", "LocalExecutor", "RayExecutor", "make_executor"]

EXECUTORS = ("local", "ray")


def make_executor(name: object, workers: int | None, address: str | None) -> Executor:
    """The executor of a composed `conf/generate.yaml`.

    Raises
    ------
    ParameterError
        An unknown name, a number of workers below 1, or an address where there is nobody to call.
    """
    check_choice("datagen", "executor", name, EXECUTORS)
    if name == "ray":
        return RayExecutor(address or "auto", workers)
    if address is not None:
        raise refuse("datagen", "address", "left out (null) with executor=local", address, "add executor=ray")
    return LocalExecutor(workers)
