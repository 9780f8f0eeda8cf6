"""The ways to a diagnosis that the table sets side by side, each as a twin of some machine."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from benchmarks.twin.truth import Truth
from discrepancy.indexer import machine_yaml
from discrepancy.subjects.from_config import indexer_subject
from indexer_env.errors import refuse
from indexer_env.presets import load_yaml
from twin.bench import Bench
from twin.folder import PAPER, machine_and_sensor, networks_of, view_of
from twin.judge import Judge
from twin.make import Maker
from twin.settings import Settings
from twin.turns import Cells, Healthy
from twin.twin import Twin

METHODS = ("twin", "oracle", "nominal", "point", "unextended")
"""twin: as a user makes it; oracle: the true machine as drawing, known to 0.2 %; nominal: the drawing ±10 % without a
fit; point: no posterior, one machine; unextended: nothing is added that the drawing lacks."""

FAULTS = ("crack", "loose_base", "reducer_play")
_KNOWN = 2e-3


class _Fixed(Maker):
    """A maker whose posterior is changed after the calibration, before anything is simulated."""

    method = ""

    def _calibrate(self) -> None:
        super()._calibrate()
        path = self.out / "posterior.parquet"
        table = pq.read_table(path)
        if self.method == "point":
            pq.write_table(pa.table({name: [float(np.mean(table[name]))] for name in table.column_names}), path)
        elif self.method == "nominal":
            self._nominal(path, table.num_rows)

    def _nominal(self, path: Path, count: int) -> None:
        """Machines of the drawing, every parameter ±10 %, and the drawing as the healthy machine, with what the records
        leave of it."""
        from discrepancy.indexer.parameters import UNCERTAINTY, read

        drawing, rng = self.bench.subject.machine, np.random.default_rng(0)
        columns = {
            f"machine.{name}": read(drawing, name) * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, count)) for name in UNCERTAINTY
        }
        pq.write_table(pa.table(columns), path)
        (self.out / "machine.yaml").write_text(machine_yaml(drawing), encoding="utf-8")
        about = {**self.work.read("calibration"), "load_factor": 1.0}
        _, sensor = machine_and_sensor(self.out)
        remains = self._remains_of(Healthy(drawing, sensor, Cells(**about["cells"]), about["load_factor"]))
        self._keep_remains(remains)
        self.work.write("calibration", {**about, "noise": view_of(about, remains).noise})


def make_twin(method: str, truth: Truth, work: Path, **more: Any) -> Twin:
    """The twin of a bench in `work` by one of METHODS; `more` are settings other than the usual ones."""
    if method not in METHODS:
        raise refuse("benchmarks.twin", "methods", "some of " + ", ".join(METHODS), method)
    drawing = load_yaml("machine", "reference")
    if method == "oracle":
        drawing = yaml.safe_load(machine_yaml(truth.machine))
        drawing["uncertainty"] = {"table_inertia": _KNOWN, "cam_inertia": _KNOWN, "follower_inertia": _KNOWN} | {
            f"{joint}.{name}": _KNOWN for joint in ("input_joint", "output_joint") for name in ("stiffness", "damping")
        }
    keys = {
        "sensor": load_yaml("sensor", "ideal"), "records": None, "held_out": [], "known": {}, "pulse": {},
        "check_motion": True,
    }  # fmt: skip
    bench = Bench(indexer_subject({**keys, "machine": drawing, "measured": str(work / "bench")}))
    settings = Settings(faults=FAULTS, **more)
    maker = _Fixed(bench, settings, work / "twin")
    maker.method, maker.extend = method, method != "unextended"
    maker.make()
    return Twin.load(work / "twin")


def of_paper(twin: Twin) -> Twin:
    """The twin with the paper's network, taught on the same turns, in place of its own."""
    networks = networks_of(twin.folder, [PAPER], len(twin.faults), twin.healthy.cells)
    judge = Judge.restore(twin.about["paper_judge"])
    return dataclasses.replace(twin, networks=networks, judge=judge, synthesis=None, weights=None)
