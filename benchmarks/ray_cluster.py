"""`python -m benchmarks.ray_cluster COUNT`: the same records by two Ray nodes of one core and by two local workers.

Prints the durations [s] as JSON. Both have made a shard on each core before the clock starts.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.data_sets import table2
from datagen.executors import Executor, LocalExecutor, RayExecutor
from datagen.generate import generate


def main() -> None:
    """Measure and print."""
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    for _ in range(2):
        cluster.add_node(num_cpus=1)
    count = int(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        found = {
            f"{name}_s": _duration(executor, count, Path(folder) / name)
            for name, executor in (("ray", RayExecutor(cluster.address)), ("local", LocalExecutor(2)))
        }
    print(json.dumps(found))


def _duration(executor: Executor, count: int, folder: Path) -> float:
    generate(table2(4 * 512), folder / "warm", executor=executor)
    begin = time.perf_counter()
    generate(table2(count), folder / "measured", executor=executor)
    return time.perf_counter() - begin


if __name__ == "__main__":
    main()
