"""One messy case: sizes are sought, records written, a method answers within its time, and the answer becomes a row."""

from __future__ import annotations

import dataclasses
import math
import signal
import tempfile
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.messy.answer import CaseAnswer, Solved
from indexer_experiments.challenge.messy.draw import MessyOrder, RecordDraw, messy_draw
from indexer_experiments.challenge.messy.judging import Judge
from indexer_experiments.challenge.messy.machines import KNOWN_TO
from indexer_experiments.challenge.messy.method import solved_by_explain
from indexer_experiments.challenge.messy.pieces import FITTED
from indexer_experiments.challenge.messy.records import write_messy
from indexer_experiments.challenge.messy.sizes import MessyCase, messy_case
from indexer_experiments.challenge.parameters import read

Method = Callable[[Path, Machine, Mapping[str, float]], Solved]
"""Folder of records, nominal machine, relative standard deviations of its parameters -> answer."""

Row = dict[str, Any]


class OutOfTime(BaseException):
    """A method's time is spent. No Exception, so that no method mistakes it for one of its own."""


def solve_messy(order: MessyOrder, number: int, method: Method = solved_by_explain) -> Row:
    """The row of one case, as it stands in its file."""
    begin = time.process_time()
    case = messy_case(messy_draw(order, number))
    with tempfile.TemporaryDirectory(prefix="messy-") as folder:
        write_messy(case, Path(folder))
        made = time.process_time()
        solved = answered(Path(folder), case.drawn.machines.nominal, order.limit, method)
        spent = time.process_time() - made
    gaps = dict(zip(("gap_before", "gap_after"), gaps_of(case, case.drawn.judging, solved), strict=True))
    # where none is held out, a method divides each of them
    held = [record for record in case.drawn.records if record.held_out] or case.drawn.records[-1:]
    answer = dataclasses.asdict(solved.answer) | gaps | {"cpu_s": spent}
    answer["gaps_held_out"] = [gaps_of(case, record, solved) for record in held]
    order_told = {"case": number, "seed": order.seed, "half": order.half, "limit": order.limit}
    return {**order_told, **_told(case), "answer": answer, "truth_s": made - begin}


def gaps_of(case: MessyCase, record: RecordDraw, solved: Solved) -> tuple[float, float | None]:
    """What the nominal machine and machine.yaml leave of a record; None, as NaN is no JSON, where there is none."""
    judge = Judge(case, record)
    after = None if solved.machine is None else judge.gap(solved.machine, solved.sensor or Sensor())
    return judge.gap(case.drawn.machines.nominal, Sensor()), after


def answered(folder: Path, nominal: Machine, limit: float | None, method: Method) -> Solved:
    """A method's answer, or why there is none: its time is spent, or it failed, which counts against it."""
    try:
        with time_limit(limit):
            return method(folder, nominal, dict.fromkeys(FITTED, KNOWN_TO))
    except OutOfTime:
        return Solved(CaseAnswer("out of time", f"no answer within {limit:g} s of processor time"))
    # whatever a user would see as a traceback must not end a run of hundreds of cases, and is told in the table
    except Exception as error:
        return Solved(CaseAnswer("failed", f"{type(error).__name__}: {error}"))


@contextmanager
def time_limit(limit: float | None) -> Generator[None]:
    """Raise `OutOfTime` in the block once it has taken so much processor time [s]; in a process's main thread."""
    if limit is None:
        yield
        return

    def stop(number: int, frame: Any) -> None:
        raise OutOfTime

    was = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, was)


def _told(case: MessyCase) -> Row:
    drawn = case.drawn
    truth = drawn.machines.truth
    return {
        "hidden": [
            {"name": h.effect.name, "level": h.level, "parameters": dataclasses.asdict(h.effect)}
            for h in case.hidden
        ],
        "to_hide": drawn.hidden,
        "disturbances": [
            {"name": d.wanted.name, "level": d.level, "size": d.size, "joint": d.wanted.kind.joint,
             "kinds": list(d.wanted.kind.kinds)}
            for d in case.disturbances
        ],
        "disturbed": case.disturbed,
        "machine": {name: read(truth, name) for name in FITTED},
        "size": drawn.machines.size, "stations": truth.stations, "law": truth.motion_law.name,
        "motion_share": truth.motion_share, "rate": drawn.rate, "clock": drawn.clock, "noise": drawn.noise,
        "correlation": drawn.correlation, "bits": drawn.bits,
        "records": [
            {"rpm_true": r.point.motor_speed * 30.0 / math.pi, "load": r.point.load_torque, "stated": r.stated_load,
             "turns": r.turns, "drift": r.drift, "held_out": r.held_out}
            for r in drawn.records
        ],
    }  # fmt: skip
