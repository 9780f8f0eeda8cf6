"""Drawing and healthy records -> twin, stage by stage; what a stage has left in the folder is not done again.

calibrate   machine.yaml, sensor.yaml, calibration.yaml, posterior.parquet, remains.safetensors
data        data/*.safetensors; removed once everything is learned
learn       cnn_0, cnn_1, paper (.safetensors), learned.yaml
detect      detection.yaml
check       check.yaml
report      report.html, and twin.yaml last: the folder is a twin from then on
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import logging
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch
import yaml
from safetensors.numpy import load_file, save_file
from safetensors.torch import save_file as save_weights

from datagen.progress import progress
from discrepancy.indexer import Experiment, machine_yaml
from discrepancy.subjects.indexer import IndexerSubject
from indexer_cli.command import check_flag
from indexer_env.errors import ParameterError, SignalError
from indexer_env.units import RPM
from twin import data, detection
from twin.card import calibration_card, scores, span, turns_of
from twin.check import Check, checked
from twin.faults import chosen
from twin.folder import FORMAT, VERSION, about_of, machine_and_sensor, networks_of, view_of
from twin.judge import Judge, judge_of, looked_at
from twin.learn import trained
from twin.moved import as_before, moved_since
from twin.physics import Calibrated, Uncertain, calibrated
from twin.settings import Settings
from twin.turns import Cells, Healthy, Remains, remains_of

_log = logging.getLogger(__name__)

STAGES = ("calibrate", "data", "learn", "detect", "check", "report")

NETWORKS = ("cnn_0", "cnn_1")
"""Networks that diagnose together: two, as many as most machines have cores to teach them side by side."""

PAPER = "paper_0"
"""The paper's network, taught beside them and shown beside them, which takes no part in a diagnosis."""

_HEALTHY_SHARE = 1.0 / 8.0
"""Healthy turns for the thresholds, as share of the records that the networks learn from."""

_OWN_FILES = (
    "stage.yaml", "machine.yaml", "sensor.yaml", "calibration.yaml", "posterior.parquet", "remains.safetensors",
    "learned.yaml", "detection.yaml", "check.yaml", "twin.yaml", "report.html", "data",
    *(f"{name}.safetensors" for name in (*NETWORKS, PAPER)),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Bench:
    """The healthy records of a machine, checked: those fitted, then those held out."""

    subject: IndexerSubject

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """All of them."""
        return (*self.subject.model.experiments, *self.subject.held_out.experiments)

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return self.experiments[0].signal.sample_rate

    @property
    def shift(self) -> float:
        """Standard deviation of the cam angle at a record's first sample [rad]."""
        return max(e.start_uncertainty for e in self.experiments)


class Maker:
    """Makes a twin in a folder."""

    def __init__(
        self, bench: Bench, settings: Settings, out: Path, *, overwrite: bool = False, before: Path | None = None
    ) -> None:
        """`before` is the folder of the twin that this one continues: its posterior is the bench's prior."""
        check_flag("twin", "overwrite", overwrite)
        self.bench, self.settings, self.out, self.before = bench, settings, out, before
        self.faults = chosen(list(settings.faults))
        self._open(overwrite)

    def _open(self, overwrite: bool) -> None:
        """Take the folder, or go on with what it holds of the same twin."""
        mark = {"format": FORMAT, "version": VERSION, "made_of": self._fingerprint()}
        if self.out.exists():
            held = sorted(path.name for path in self.out.iterdir())
            foreign = [name for name in held if name not in _OWN_FILES]
            if foreign or (held and "stage.yaml" not in held):
                raise ParameterError(
                    f"twin.out must be a new folder, an empty one or that of a twin, got {self.out}, which holds "
                    f"{(foreign or held)[0]}; name another."
                )
            if held and self._read("stage") != mark:
                if not overwrite:
                    raise ParameterError(
                        "twin.out must be a new folder, or that of a twin of the same records and settings, got "
                        f"{self.out}, which is of others; set overwrite=true to make it anew, or name another."
                    )
                for path in self.out.iterdir():
                    shutil.rmtree(path) if path.is_dir() else path.unlink()
        self.out.mkdir(parents=True, exist_ok=True)
        self._write("stage", mark)

    def _fingerprint(self) -> str:
        told = hashlib.sha256(json.dumps(self.settings.plain(), sort_keys=True).encode())
        told.update(machine_yaml(self.bench.subject.machine).encode())
        told.update(repr(sorted(self.bench.subject.uncertainty.items())).encode())
        for experiment in self.bench.experiments:
            told.update(experiment.signal.values.tobytes())
            told.update(repr((experiment.operating_point, experiment.noise, experiment.start_uncertainty)).encode())
        return told.hexdigest()

    def _read(self, name: str) -> Any:
        return yaml.safe_load((self.out / f"{name}.yaml").read_text(encoding="utf-8"))

    def _write(self, name: str, content: Any) -> None:
        fresh = self.out / f".{name}.part"
        fresh.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")
        fresh.rename(self.out / f"{name}.yaml")

    def _has(self, *names: str) -> bool:
        return all((self.out / name).exists() for name in names)

    def make(self, begin: Callable[[str], None] = lambda stage: None) -> Check:
        """All stages that are left; `begin` is told each as it begins."""
        begin("calibrate")
        self._calibrate()
        machine, sensor = machine_and_sensor(self.out)
        about = self._read("calibration")
        self.healthy = Healthy(machine, sensor, Cells(**about["cells"]), about["load_factor"])
        self.remains = Remains.restore(load_file(self.out / "remains.safetensors"))
        self.view = view_of(about, self.remains)
        self.speeds, self.loads = about["range"]["motor_speed_rpm"], about["range"]["load_torque"]
        begin("data")
        learned = self._has("learned.yaml")
        turns = None if learned else self._data()
        begin("learn")
        if turns is not None:
            self._learn(turns)
        cells = self.healthy.cells.count
        self.networks = networks_of(self.out, NETWORKS, len(self.faults), cells)
        self.judge = Judge.restore(self._read("learned")["judge"])
        begin("detect")
        if not self._has("detection.yaml"):
            self._detect()
        begin("check")
        if not self._has("check.yaml"):
            self._write("check", self._check().plain())
        check = Check(**self._read("check"))
        begin("report")
        self._report(about)
        shutil.rmtree(self.out / "data", ignore_errors=True)
        return check

    def sentences(self) -> list[str]:
        """What was found, for the command line."""
        about = self._read("twin")
        moved = about["calibration"].get("moved")
        first = [] if moved is None else [moved["sentence"]]
        return [*first, about["calibration"]["headline"], *about["calibration"]["notes"]]

    # ------------------------------------------------------------------------------------------ stages

    def _calibrate(self) -> None:
        if self._has("calibration.yaml", "posterior.parquet", "remains.safetensors", "machine.yaml", "sensor.yaml"):
            return
        s = self.settings
        before = None if self.before is None else about_of(self.before)
        scale = 0.0 if before is None else before["calibration"]["scale_spread"]
        uncertain = Uncertain(s.load_uncertainty, s.gain_uncertainty, s.housing_uncertainty, scale)
        found = calibrated(self.bench.subject, uncertain, s.draws, s.seed)
        if before is not None:
            found = as_before(found, before["calibration"])
        columns = {path: found.draws[:, k] for k, path in enumerate(found.paths)}
        pq.write_table(pa.table(columns), self.out / "posterior.parquet")
        (self.out / "machine.yaml").write_text(machine_yaml(found.machine), encoding="utf-8")
        values = {n: float(v) if isinstance(v, float) else v for n, v in dataclasses.asdict(found.sensor).items()}
        self._write("sensor", values)
        points = [e.operating_point for e in self.bench.experiments]
        fastest = max(p.motor_speed for p in points)
        cells = Cells.of(found.machine, self.bench.rate, fastest)
        healthy = Healthy(found.machine, found.sensor, cells, found.load_factor)
        turns = [turns_of(e, healthy) for e in self.bench.experiments]
        fitted = [k for k, mine in enumerate(turns) if len(mine) and k < len(self.bench.subject.model.experiments)]
        if not fitted:
            raise SignalError(
                "One healthy record or more must hold a whole turn of the table in the part that is fitted, got none; "
                "record for longer, or hold whole records out."
            )
        remains = remains_of([turns[k] for k in fitted], [points[k] for k in fitted], self.bench.shift, healthy)
        save_file({k: np.ascontiguousarray(v) for k, v in remains.arrays().items()}, self.out / "remains.safetensors")
        speeds = list(s.motor_speed_rpm or span([p.motor_speed / RPM for p in points]))
        loads = list(s.load_torque or span([p.load_torque for p in points]))
        self._write("calibration", {
            **calibration_card(found), "cells": dataclasses.asdict(cells), "shift": self.bench.shift,
            "range": {"motor_speed_rpm": speeds, "load_torque": loads},
            "load_factor": found.load_factor, "noise": remains.noise, "unit": found.sensor.unit,
            "sample_noise": float(np.median([e.noise_level for e in self.bench.experiments])),
            "recorded": [[p.motor_speed / RPM, p.load_torque] for p in points],
        })  # fmt: skip
        if before is not None:
            self._go_on(before, found)

    def _go_on(self, before: dict[str, Any], found: Calibrated) -> None:
        """Compare with the twin before, and take its networks over where the machine has not moved."""
        assert self.before is not None
        moved = moved_since(before["calibration"], self.bench.subject.machine, found)
        about = self._read("calibration")
        self._write("calibration", {**about, "moved": moved})
        same = before["range"] == about["range"] and before["cells"] == about["cells"]
        if moved["since"] or not same:
            return
        for name in (*NETWORKS, PAPER):
            shutil.copy(self.before / f"{name}.safetensors", self.out)
        self._write("learned", {key: before[key] for key in ("judge", "paper_judge", "records", "scores")})
        self._write("detection", before["detection"])

    def _order(self, count: int, seed: int, **more: Any) -> Any:
        points = more.pop("points")
        faults = more.pop("faults", self.faults)
        return data.order_of(
            self.out / "posterior.parquet", faults, points, self.healthy.machine, self.healthy.sensor,
            self.healthy.cells, self.settings.load_uncertainty, count, seed, **more,
        )  # fmt: skip

    def _data(self) -> tuple[data.Turns, data.Turns]:
        """Turns to learn from, and healthy ones for the thresholds."""
        s = self.settings
        points = data.points_of(self.speeds, self.loads, s.seed)
        sound = int(_HEALTHY_SHARE * s.simulated)
        with progress("simulating", s.simulated + sound, "turns") as advance:
            order = self._order(s.simulated, s.seed, points=points)
            turns = data.made(order, self.faults, self.healthy, points, self.out / "data" / "faulty", advance)
            order = self._order(sound, s.seed + 1, points=points, how_many=(1.0,))
            healthy = data.made(order, self.faults, self.healthy, points, self.out / "data" / "healthy", advance)
        return turns, healthy

    def _learn(self, turns: tuple[data.Turns, data.Turns]) -> None:
        faulty, healthy = turns
        s = self.settings
        # Each network is taught by one thread: several threads on one batch wait for each other more than they work.
        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            with progress("learning", len(NETWORKS) * s.epochs, "epochs") as advance:

                def teach(name: str) -> None:
                    kind, _, number = name.partition("_")
                    tell = (lambda epoch: advance(1)) if kind == "cnn" else (lambda epoch: None)
                    network = trained(kind, faulty, self.view, epochs=s.epochs, seed=s.seed + int(number), advance=tell)
                    save_weights(network.state_dict(), self.out / f"{name}.safetensors")

                with ThreadPoolExecutor(len(NETWORKS)) as pool:
                    missing = [n for n in (*NETWORKS, PAPER) if not self._has(f"{n}.safetensors")]
                    list(pool.map(teach, missing))
        finally:
            torch.set_num_threads(threads)
        cells = self.healthy.cells.count
        networks = networks_of(self.out, NETWORKS, len(self.faults), cells)
        told = {"false_alarms": s.false_alarms, "coverage": s.coverage, "seed": s.seed}
        judge = judge_of(networks, faulty, healthy, self.view, **told)
        paper = networks_of(self.out, [PAPER], len(self.faults), cells)
        control = np.flatnonzero(faulty.subset == 1)
        self._write("learned", {
            "judge": judge.plain(),
                "paper_judge": judge_of(paper, faulty, healthy, self.view, **told).plain(), "records": len(faulty.x),
            "scores": {
                "cnn": scores(*looked_at(networks, faulty, self.view, control, s.seed + 2, 1), faulty),
                "paper": scores(*looked_at(paper, faulty, self.view, control, s.seed + 2, 1), faulty),
            },
        })  # fmt: skip

    def _detect(self) -> None:
        s, points = self.settings, detection.points_of(self.speeds, self.loads)
        count = detection.TRIED * len(points)
        found: list[dict[str, Any]] = []
        with progress("detection sizes", len(self.faults), "faults") as advance:
            for k, fault in enumerate(self.faults):
                more = {"points": points, "faults": (fault,), "how_many": (0.0, 1.0), "smallest": detection.SMALLEST}
                order = self._order(count, s.seed + 100 + k, **more)
                turns = data.made(order, self.faults, self.healthy, points)
                found += [
                    seen.plain()
                    for seen in detection.seen_of(
                        self.networks, turns, fault, k, self.view, self.judge, self.healthy.machine, s.power, s.seed
                    )
                ]
                advance(1)
        self._write("detection", found)

    def _check(self) -> Check:
        held = self.bench.subject.held_out.experiments
        turns = [turns_of(e, self.healthy) for e in held]
        own = not any(len(mine) for mine in turns)
        if own:
            held = self.bench.subject.model.experiments
            turns = [turns_of(e, self.healthy) for e in held]
        points = [e.operating_point for e in held]
        files = [e.signal.source for e in held]
        return checked(
            turns, points, files, self.healthy, self.view, self.networks, self.judge, self.settings.false_alarms, own
        )

    def _report(self, calibration: dict[str, Any]) -> None:
        from twin.report import page

        about = {
            "format": FORMAT, "version": VERSION, "settings": self.settings.plain(), "networks": list(NETWORKS),
            **{key: calibration.pop(key) for key in ("cells", "shift", "range", "load_factor")},
            **{key: calibration.pop(key) for key in ("noise", "sample_noise", "unit", "recorded")},
            "calibration": calibration, **self._read("learned"), "detection": self._read("detection"),
            "check": self._read("check"),
        }  # fmt: skip
        (self.out / "report.html").write_text(page(about, self.healthy.machine, self.remains), encoding="utf-8")
        self._write("twin", about)
