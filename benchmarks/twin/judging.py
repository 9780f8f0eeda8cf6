"""Records asked of a twin, by the networks alone, by networks and synthesis, and with physics."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.twin.records import Recorded, recorded
from benchmarks.twin.table import Judged
from benchmarks.twin.truth import Truth
from indexer_env.errors import SignalError
from twin.answer import answer_of
from twin.diagnosis import NOT_COMPARABLE, UNKNOWN
from twin.faults import FAULTS
from twin.twin import Twin

NETWORKS, REFINED, PHYSICS = "networks", "networks and synthesis", "networks, synthesis and physics"
"""Ways to judge a record."""

AGAIN = "physics, of what networks and synthesis misname"
"""The row of the records of which physics would have to mend the answer."""


def ways_of(twin: Twin) -> dict[str, Twin]:
    """The twin with and without synthesis."""
    alone = {NETWORKS: dataclasses.replace(twin, synthesis=None)}
    return alone if twin.synthesis is None else {**alone, REFINED: twin}


def judged(ways: Mapping[str, Twin], truth: Truth, records: Sequence[Recorded], file: Path) -> dict[str, list[Judged]]:
    """Each record by each way; `file` keeps them, a line for each record."""
    done = _kept(file)
    with file.open("a") as kept:
        for one in records[len(done) :]:
            rows = {}
            for name, twin in ways.items():
                begun = time.process_time()
                seen = twin.diagnose_turn(one.signal, one.stated)
                spent = time.process_time() - begun
                rows[name] = row_of(one, seen.faults, seen.verdict, twin, truth, spent).plain()
            kept.write(json.dumps(rows) + "\n")
            kept.flush()
            done.append(rows)
    return {name: [Judged.restore(rows[name]) for rows in done] for name in ways}


def _kept(file: Path) -> list[dict[str, dict]]:
    """What the finished lines of a file hold; the file loses a last one that a killed run did not finish."""
    if not file.exists():
        return []
    held = file.read_bytes()
    finished = held[: held.rfind(b"\n") + 1]
    os.truncate(file, len(finished))
    return [json.loads(line) for line in finished.splitlines()]


def by_physics(twin: Twin, truth: Truth, records: Sequence[Recorded]) -> list[Judged]:
    """Each record by all that a twin has; where physics cannot take a record, the networks answer, as for a user."""
    rows = []
    for one in records:
        begun = time.process_time()
        seen, found = twin.diagnose_turn(one.signal, one.stated), None
        if seen.verdict != NOT_COMPARABLE:
            with contextlib.suppress(SignalError):
                found = twin.explain([(one.signal, one.stated)], seen.suspected)
        answer = answer_of(seen, found, twin.machine, twin.matters, twin.faults)
        rows.append(row_of(one, answer.faults, answer.verdict, twin, truth, time.process_time() - begun))
    return rows


def misnamed(records: Sequence[Recorded], rows: Sequence[Judged]) -> list[Recorded]:
    """The records with known faults, or none, that rows misname."""
    return [one for one, row in zip(records, rows, strict=True) if row.wrong and not row.left_out]


def at_stated_size(twin: Twin, truth: Truth, count: int, rng: np.random.Generator) -> list[Judged]:
    """Whether an alarm is raised on records with one fault of the smallest size that the twin says it sees."""
    stated = [one for one in twin.seen if one.size is not None]
    rows = []
    for _ in range(count if stated else 0):
        one = stated[int(rng.integers(len(stated)))]
        assert one.size is not None
        record = recorded(truth, one.motor_speed_rpm, one.load_torque, {one.fault: one.size}, rng)
        alarm = twin.diagnose_turn(record.signal, record.stated).alarm > 0.0
        none = frozenset()
        rows.append(Judged(frozenset(record.sizes), none, none, False, True, at_size=alarm))
    return rows


def row_of(one: Recorded, faults: Sequence, verdict: str, twin: Twin, truth: Truth, spent: float) -> Judged:
    """What is counted of a record."""
    told = {name: FAULTS[name].told(size, truth.machine) for name, size in one.sizes.items()}
    stated = {seen.fault for seen in twin.seen if seen.size is not None}
    above = all(name in stated and size >= twin.matters[name] for name, size in one.sizes.items())
    held = tuple(found.low <= told[found.name] <= found.high for found in faults if found.name in told)
    named = frozenset(found.name for found in faults)
    large = frozenset(found.name for found in faults if found.matters)
    refused = verdict in (UNKNOWN, NOT_COMPARABLE)
    return Judged(frozenset(one.sizes), named, large, refused, above, held, one.stranger, None, dict(one.sizes), spent)
