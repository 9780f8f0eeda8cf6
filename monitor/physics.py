"""Physics behind the networks: the last turns of a machine explained by its twin, in a process of its own.

A machine is looked at when an alarm of it is raised, and again after `every` hours of this host's clock. What waits is
a machine's name, at most once, so that however many ask, nothing piles up; the stream never waits for an answer.
"""

from __future__ import annotations

import dataclasses
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from indexer_env.errors import IndexerError
from monitor.analysis.twin import in_true_time
from monitor.intake.blocks import NANO
from monitor.intake.cutter import Mode
from monitor.plan import Change
from monitor.store import Store, StoreDown
from monitor.store.archive import record_of

_log = logging.getLogger(__name__)

TURNS = 3
"""Turns that are explained together: physics needs whole cam turns in the half that is fitted and in the one that is
held out, and one turn of the table has too few."""

_LOOKED_THROUGH = 30
"""Newest turns among which diagnosed ones of one speed are looked for."""

_LONGEST_S = 600.0
"""Time after which a process that does not answer is ended: an answer takes seconds to a minute."""

_PRIORITY = 10
"""By which the process steps back behind the stream (nice)."""

_HOUR_NS = 3600 * NANO


class Question(NamedTuple):
    """Turns of one machine, all of the same speed.

    folder       of the twin
    load_torque  [N m]
    motor_speeds [rad/s] of each turn
    rate         [Hz]
    unit         of the records
    radius       of the sensor about the table's axis [m]; None: that of the twin's
    start_angles of the cam at the first sample of each turn [rad]; None: it is not known
    records      in the time they took, (n,) each
    """

    folder: Path
    load_torque: float
    motor_speeds: tuple[float, ...]
    rate: float
    unit: str
    radius: float | None
    start_angles: tuple[float | None, ...]
    records: tuple[np.ndarray, ...]


class Physics:
    """Asks a process about machines and keeps its answers.

    Parameters
    ----------
    store : Store
    folder : Path
        Of the twin.
    load_torque : float
        Under which machines run [N m].
    modes : sequence of Mode
    every_h : float
        Hours after which a machine is looked at again.
    radius : float or None
        Of the sensors about the table's axis [m]; None: that of the twin's.
    pulse_angle : float or None
        Cam angle at the pulse [rad]; None: it is not known.
    changed : callable
        Called from this thread with a `Change` once an answer is kept.
    """

    def __init__(
        self, store: Store, folder: Path, load_torque: float, modes: tuple[Mode, ...], every_h: float,
        radius: float | None, pulse_angle: float | None, changed: Callable[[Change], None],
    ) -> None:  # fmt: skip
        self._store, self._folder, self._load, self._changed = store, folder.resolve(), load_torque, changed
        self._modes = {mode.name: mode for mode in modes}
        self._every_ns, self._radius, self._pulse_angle = round(every_h * _HOUR_NS), radius, pulse_angle
        self._wanted: dict[str, None] = {}
        self._looked_ns: dict[str, int] = {}
        self._news, self._stopping = threading.Condition(), False
        self._worker: _Worker | None = None
        self._thread = threading.Thread(target=self._run, name="physics", daemon=True)
        self.answers = 0

    def start(self) -> None:
        """Begin; what was kept says when each machine was last looked at."""
        self._looked_ns = self._store.explained()
        self._thread.start()

    def stop(self) -> None:
        """End, also in the middle of an answer."""
        with self._news:
            self._stopping = True
            self._news.notify()
        if self._worker is not None:
            self._worker.end()
        if self._thread.is_alive():
            self._thread.join(timeout=30.0)

    def consider(self, change: Change) -> None:
        """Ask about a machine where an alarm was raised, or its answer is old; returns at once."""
        if not change.own:
            return
        machine = str(change.summary["machine"])
        due = time.time_ns() - self._looked_ns.get(machine, 0) >= self._every_ns
        raised = any(event.kind == "raised" for event in change.events)
        told = int(change.summary["turns"]) >= TURNS and not change.summary["last"].get("problem")
        if told and (due or raised):
            with self._news:
                self._wanted[machine] = None
                self._news.notify()

    @property
    def waiting(self) -> int:
        """Machines that wait for an answer."""
        return len(self._wanted)

    def _run(self) -> None:
        while True:
            with self._news:
                while not self._wanted and not self._stopping:
                    self._news.wait()
                if self._stopping:
                    return
                machine = next(iter(self._wanted))
                del self._wanted[machine]
                before_ns, self._looked_ns[machine] = self._looked_ns.get(machine, 0), time.time_ns()
            try:
                if not self._look_at(machine):
                    # There was nothing to explain yet.
                    self._looked_ns[machine] = before_ns
            except StoreDown as error:
                self._looked_ns[machine] = before_ns
                _log.warning("physics has left out %s, as the store cannot be used (%s)", machine, error)
            except Exception:
                _log.exception("physics has left out %s", machine)

    def _look_at(self, machine: str) -> bool:
        """Ask about a machine and keep the answer; False: there is none."""
        found = self._question(machine)
        if found is None:
            return False
        number, question = found
        began = time.monotonic()
        content = self._ask(question)
        if self._stopping:
            return False
        content |= {"turns": len(question.records), "took_s": time.monotonic() - began}
        self._store.write_explanation(machine, number, time.time_ns(), content)
        self.answers += 1
        summary = self._store.summary(machine)
        if summary is not None:
            self._changed(Change(summary, ()))
        return True

    def _question(self, machine: str) -> tuple[int, Question] | None:
        """The newest turn and those before it at the same speed, newest first; None where there are too few."""
        turns = [one for one in self._store.turns(machine, count=_LOOKED_THROUGH) if not one["problem"]]
        mine = [one for one in turns if one["mode"] == turns[0]["mode"]][:TURNS]
        mode = self._modes.get(mine[0]["mode"]) if len(mine) == TURNS else None
        if mode is None or mode.motor_speed is None:
            return None
        records, speeds = [], []
        for one in mine:
            found = record_of(self._store, machine, one["number"])
            if found is None:
                return None
            longer = one["duration"] / mode.duration
            records.append(in_true_time(found[0], longer))
            speeds.append(mode.motor_speed / longer)
        # of turns that an earlier version has stored it is not known what cut them
        begins = tuple(self._pulse_angle if one.get("by_pulse") else None for one in mine)
        return mine[0]["number"], Question(
            self._folder, self._load, tuple(speeds), mode.rate, mode.unit, self._radius, begins, tuple(records)
        )

    def _ask(self, question: Question) -> dict[str, Any]:
        """The answer as plain values; where there is none, one sentence under "problem"."""
        if self._worker is None:
            self._worker = _Worker()
        answer = self._worker.ask(question)
        if answer is None:
            self._worker.end()
            self._worker = None
            return {
                "problem": "The process that computes the physics has ended or took too long; a new one is started."
            }
        return answer


class _Worker:
    """A process that answers one question after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_answer_all, args=(other,), name="physics", daemon=True)
        self._process.start()
        other.close()

    def ask(self, question: Question) -> dict[str, Any] | None:
        """The answer; None where the process has ended or took too long."""
        try:
            self._pipe.send(question)
            return self._pipe.recv() if self._pipe.poll(_LONGEST_S) else None
        except (OSError, EOFError):
            return None

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join(timeout=10.0)


def _answer_all(pipe: Connection) -> None:
    """Answer what comes through a pipe until it is closed; what the monitor is told from the keyboard is not for us."""
    import torch

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_PRIORITY)
    torch.set_num_threads(1)
    while True:
        try:
            question = pipe.recv()
        except EOFError:
            return
        pipe.send(answer_to(question))


def answer_to(question: Question) -> dict[str, Any]:
    """What networks and physics say of turns together, as plain values."""
    from discrepancy.records.conditions import Conditions
    from discrepancy.records.reading import Record
    from indexer_env.signal import Signal
    from twin.diagnose import diagnosed
    from twin.twin import Twin

    records = [
        Record(
            f"turn {place + 1}",
            Signal(values, question.rate, unit=question.unit, source=f"turn {place + 1}"),
            Conditions(speed, question.load_torque, start_angle=start, sensor_radius=question.radius),
        )
        for place, (values, speed, start) in enumerate(
            zip(question.records, question.motor_speeds, question.start_angles, strict=True)
        )
    ]
    try:
        answer, _ = diagnosed(Twin.load(question.folder), records, physics=True)
    except IndexerError as error:
        return {"problem": str(error)}
    faults = [{**dataclasses.asdict(fault), "told": fault.told} for fault in answer.faults]
    physics = answer.physics
    return {
        "verdict": answer.verdict,
        "headline": answer.headline,
        "remarks": list(answer.remarks),
        "faults": faults,
        "level": None if physics is None else physics.level,
        "before": None if physics is None else physics.before,
    }
