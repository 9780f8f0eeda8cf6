"""Drawing and healthy records -> twin, stage by stage; what a stage has left in the folder is not done again.

calibrate   machine.yaml, sensor.yaml, calibration.yaml, posterior.parquet, remains.safetensors
data        data/*.safetensors; removed once everything is learned
learn       modes_0, modes_1, paper_0, synthesis (.safetensors), learned.yaml
detect      detection.yaml
check       check.yaml
report      report.html, and twin.yaml last: the folder is a twin from then on
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from safetensors.numpy import save

from datagen.progress import progress
from discrepancy.indexer import machine_yaml
from indexer_cli.command import check_flag
from indexer_env.units import RPM
from twin import data, detection, first_look
from twin.bench import Bench, no_whole_turn
from twin.calibrate import calibrated
from twin.card import calibration_card, span, turns_of
from twin.check import Check, checked
from twin.faults import BY_SPEED, check_matters, chosen
from twin.folder import (
    FORMAT,
    NETWORKS,
    PAPER,
    VERSION,
    about_of,
    machine_and_sensor,
    networks_of,
    reading,
    stored_remains,
    synthesis_of,
    view_of,
)  # fmt: skip
from twin.judge import Judge
from twin.learn import View
from twin.moved import as_before, gone_on, moved_since
from twin.posterior import Uncertain, simulated
from twin.remains import Remains, remains_of
from twin.settings import Settings
from twin.teach import learned
from twin.turns import Cells, Healthy
from twin.weigh import Weights
from twin.workplace import Workplace, keep

_log = logging.getLogger(__name__)

STAGES = ("calibrate", "data", "learn", "detect", "check", "report")


class Maker:
    """Makes a twin in a folder."""

    extend = True
    """Whether what the drawing lacks is added; a benchmark leaves it out to tell what it is worth."""

    def __init__(
        self, bench: Bench, settings: Settings, out: Path, *, overwrite: bool = False, before: Path | None = None
    ) -> None:
        """`before` is the folder of the twin that this one continues: its posterior is the bench's prior."""
        check_flag("twin", "overwrite", overwrite)
        self.bench, self.settings, self.out, self.before = bench, settings, out, before
        bench.check([rpm * RPM for rpm in settings.motor_speed_rpm or ()])
        known = [f for f in chosen(settings.faults, sensor=bench.subject.sensor) if f.name not in BY_SPEED]
        check_matters(settings.matters, known, bench.subject.machine)
        self.work = Workplace(out, self._fingerprint(), overwrite)

    def _fingerprint(self) -> str:
        subject = self.bench.subject
        told = hashlib.sha256(json.dumps(self.settings.plain(), sort_keys=True).encode())
        told.update(machine_yaml(subject.machine).encode())
        told.update(repr((sorted(subject.uncertainty.items()), subject.sensor, self.extend)).encode())
        if subject.model.known:
            told.update(repr(subject.model.known).encode())
        if self.before is not None:
            told.update((self.before / "twin.yaml").read_bytes())
        for part in (subject.model, subject.held_out):
            told.update(f"{len(part.experiments)} records".encode())
            for e in part.experiments:
                told.update(e.signal.values.tobytes())
                told.update(repr((e.signal.sample_rate, e.signal.unit, e.operating_point, e.noise)).encode())
                known_to = e.start_uncertainty, e.speed_uncertainty, e.inertia_uncertainty, e.estimate
                told.update(repr(known_to).encode())
        return told.hexdigest()

    def make(self, begin: Callable[[str], None] = lambda stage: None) -> Check:
        """All stages that are left; `begin` is told each as it begins."""
        begin("calibrate")
        self._calibrate()
        machine, sensor = machine_and_sensor(self.out)
        about = self.work.read("calibration")
        self.healthy = Healthy(machine, sensor, Cells(**about["cells"]), about["load_factor"])
        self.remains = stored_remains(self.out)
        self.view = view_of(about, self.remains)
        self.speeds, self.loads = about["range"]["motor_speed_rpm"], about["range"]["load_torque"]
        self.faults = chosen(list(self.settings.faults), self.speeds[1] * RPM, sensor, machine)
        check_matters(self.settings.matters, self.faults, machine)
        begin("data")
        learned = self.work.has(["learned.yaml"])
        turns = None if learned else self._data()
        begin("learn")
        if turns is not None:
            self._learn(turns)
        found = self.work.read("learned")
        self.networks = networks_of(self.out, NETWORKS, len(self.faults), self.healthy.cells)
        self.judge, self.weights = Judge.restore(found["judge"]), Weights.restore(found["weights"])
        self.synthesis = synthesis_of(self.out, self.faults, self.healthy, self.view)
        begin("detect")
        if not self.work.has(["detection.yaml"]):
            self._detect()
        begin("check")
        if not self.work.has(["check.yaml"]):
            self.work.write("check", self._check().plain())
        check = Check(**self.work.read("check"))
        begin("report")
        self._report(about)
        self.work.finished()
        return check

    def sentences(self) -> list[str]:
        """What was found, for the command line."""
        about = self.work.read("twin")
        moved = about["calibration"].get("moved")
        first = [] if moved is None else [moved["sentence"]]
        return [*first, about["calibration"]["headline"], *about["calibration"]["notes"]]

    # ------------------------------------------------------------------------------------------ stages

    def _calibrate(self) -> None:
        if self.work.has(
            ["calibration.yaml", "posterior.parquet", "remains.safetensors", "machine.yaml", "sensor.yaml"]
        ):
            return
        # of an update that was stopped as it took them over
        self.work.forget("learned.yaml", "detection.yaml", *(f"{name}.safetensors" for name in (*NETWORKS, PAPER)))
        s = self.settings
        before = None if self.before is None else about_of(self.before)
        scale = 0.0 if before is None else before["calibration"]["scale_spread"]
        uncertain = Uncertain(s.load_uncertainty, s.gain_uncertainty, s.housing_uncertainty, scale)
        fresh = calibrated(self.bench.subject, uncertain, s.draws, s.seed, extend=self.extend)
        found = fresh if before is None else as_before(fresh, before["calibration"])
        columns = dict(zip(found.paths, found.draws.T, strict=True))
        pq.write_table(pa.table(simulated(columns)), self.out / "posterior.parquet")
        (self.out / "machine.yaml").write_text(machine_yaml(found.machine), encoding="utf-8")
        values = {n: float(v) if isinstance(v, float) else v for n, v in dataclasses.asdict(found.sensor).items()}
        self.work.write("sensor", values)
        points = [e.operating_point for e in self.bench.experiments]
        # a twin that is brought up to date stays one for the range that it had
        past = {"motor_speed_rpm": (), "load_torque": ()} if before is None else before["range"]
        speeds = list(s.motor_speed_rpm or span([*(p.motor_speed / RPM for p in points), *past["motor_speed_rpm"]]))
        loads = list(s.load_torque or span([*(p.load_torque for p in points), *past["load_torque"]]))
        asked = s.motor_speed_rpm or past["motor_speed_rpm"]
        fastest = max([*(p.motor_speed for p in points), *(rpm * RPM for rpm in asked)])
        cells = Cells.of(found.machine, self.bench.rate, fastest)
        healthy = Healthy(found.machine, found.sensor, cells, found.load_factor)
        remains = self._remains_of(healthy)
        told = {
            **calibration_card(found), "cells": dataclasses.asdict(cells), "shift": self.bench.shift,
            "range": {"motor_speed_rpm": speeds, "load_torque": loads},
            "load_factor": found.load_factor, "unit": found.sensor.unit, "radius": found.sensor.radius,
            "sample_noise": found.noise_share * float(np.median([e.noise_level for e in self.bench.experiments])),
            "recorded": [[p.motor_speed / RPM, p.load_torque] for p in self.bench.points],
            "start_compared": self.bench.start_compared,
        }  # fmt: skip
        told["noise"] = view_of(told, remains).noise
        self._look(told, healthy, view_of(told, remains))
        if before is not None and self.before is not None:
            noisier = told["sample_noise"] / before["sample_noise"]
            moved = moved_since(before["calibration"], self.bench.subject.machine, fresh, noisier)
            told, kept = gone_on(before, told, moved)
            if kept:
                self._take_over(before)
                remains = remains.with_those_of(stored_remains(self.before))
                told["noise"] = view_of(told, remains).noise
        self._keep_remains(remains)
        # last: a run that was stopped before it calibrates again
        self.work.write("calibration", told)

    def _look(self, told: dict[str, Any], healthy: Healthy, view: View) -> None:
        """Say what is left of each file while there is time to stop, and note a load that was another than stated."""
        fitted = first_look.by_file(self.bench.subject.model.experiments, healthy)
        files = first_look.by_file(self.bench.experiments, healthy)
        line, warning = first_look.sentences(first_look.levels(fitted, files, healthy, view))
        notes = first_look.wrong_load(files, healthy, view, self.settings.load_uncertainty)
        told["notes"] += notes
        _log.info(line)
        for caution in filter(None, (*notes, warning)):
            _log.warning(caution)

    def _remains_of(self, healthy: Healthy) -> Remains:
        """What the records that were fitted leave of this machine."""
        fitted = self.bench.subject.model.experiments
        turns = [(turns_of(e, healthy), e.operating_point) for e in fitted]
        whole = [(mine, point) for mine, point in turns if len(mine)]
        if not whole:
            raise no_whole_turn()
        return remains_of([mine for mine, _ in whole], [point for _, point in whole], self.bench.shift, healthy)

    def _keep_remains(self, remains: Remains) -> None:
        arrays = {name: np.ascontiguousarray(array) for name, array in remains.arrays().items()}
        keep(self.out / "remains.safetensors", save(arrays))

    def _take_over(self, before: dict[str, Any]) -> None:
        """The networks of the twin before, and what was learned of them."""
        assert self.before is not None
        for name in (*NETWORKS, PAPER, "synthesis"):
            file = self.before / f"{name}.safetensors"
            if name == PAPER and not file.exists():
                continue  # it stands beside the others for comparison alone
            with reading(file):
                content = file.read_bytes()
            keep(self.out / file.name, content)
        keys = ("judge", "paper_judge", "weights", "records", "scores", "taught")
        self.work.write("learned", {key: before[key] for key in keys})
        self.work.write("detection", before["detection"])

    def _order(self, count: int, seed: int, **more: Any) -> Any:
        points = more.pop("points")
        faults, posterior = more.pop("faults", self.faults), more.pop("posterior", self.out / "posterior.parquet")
        return data.order_of(
            posterior, faults, points, self.healthy.machine, self.healthy.sensor, self.healthy.cells,
            self.settings.load_uncertainty, count, seed, **more,
        )  # fmt: skip

    def _data(self) -> tuple[data.Turns, data.Turns]:
        """Turns to learn from, and healthy ones for the thresholds."""
        s = self.settings
        points = data.points_of(self.speeds, self.loads, s.seed)
        with progress("simulating", s.simulated + s.healthy, "turns") as advance:
            order = self._order(s.simulated, s.seed, points=points)
            turns = data.made(order, self.faults, self.healthy, points, self.out / "data" / "faulty", advance)
            order = self._order(s.healthy, s.seed + 1, points=points, how_many=(1.0,), posterior=self._untaught())
            healthy = data.made(order, self.faults, self.healthy, points, self.out / "data" / "healthy", advance)
        return turns, healthy

    def _untaught(self) -> Path:
        """Machines that no network was taught on."""
        return data.untaught(self.out / "posterior.parquet", self.out / "data" / "untaught.parquet")

    def _learn(self, turns: tuple[data.Turns, data.Turns]) -> None:
        self.work.write("learned", learned(self.out, *turns, self.faults, self.healthy, self.view, self.settings))

    def _detect(self) -> None:
        s, points = self.settings, detection.points_of(self.speeds, self.loads)
        count, untaught = detection.TRIED * len(points), self._untaught()
        found: list[dict[str, Any]] = []
        with progress("detection sizes", len(self.faults), "faults") as advance:
            for k, fault in enumerate(self.faults):
                more = {"points": points, "faults": (fault,), "how_many": (0.0, 1.0), "smallest": detection.SMALLEST}
                order = self._order(count, s.seed + 100 + k, posterior=untaught, **more)
                turns = data.made(order, self.faults, self.healthy, points)
                found += [
                    seen.plain()
                    for seen in detection.seen_of(
                        self.networks, turns, fault, k, self.view, self.judge, self.healthy.machine, s.power, s.seed
                    )
                ]
                advance(1)
        self.work.write("detection", found)

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
            turns, points, files, self.healthy, self.view, self.networks, self.judge, self.synthesis, self.weights,
            self.settings.false_alarms, own, not self.bench.start_compared,
        )  # fmt: skip

    def _report(self, calibration: dict[str, Any]) -> None:
        from twin.report import page

        about = {
            "format": FORMAT, "version": VERSION, "settings": self.settings.plain(), "networks": list(NETWORKS),
            **{key: calibration.pop(key) for key in ("cells", "shift", "range", "load_factor")},
            **{key: calibration.pop(key) for key in ("noise", "sample_noise", "unit", "recorded")},
            "calibration": calibration, **self.work.read("learned"), "detection": self.work.read("detection"),
            "check": self.work.read("check"),
        }  # fmt: skip
        (self.out / "report.html").write_text(page(about, self.healthy.machine, self.remains), encoding="utf-8")
        self.work.write("twin", about)
