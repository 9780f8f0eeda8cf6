"""What came of a block -> rows, within the transaction of its batch."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from sqlalchemy import Connection, insert

from indexer_cli.json_values import finite
from monitor.alarms.condition import plain
from monitor.pipeline import Pipeline
from monitor.plan import Outcome, Turn
from monitor.store.schema import EVENT, OUTBOX, RAW, TURN


def write_outcome(connection: Connection, pipeline: Pipeline, outcome: Outcome, channels: tuple[str, ...]) -> None:
    """Keep the turns of an outcome with their records, and what happened to alarms, also for each channel."""
    machine = pipeline.machine
    raising = {one.turn for one in outcome.events if one.kind == "raised"}
    for turn in outcome.turns:
        connection.execute(insert(TURN).values(machine=machine, **_turn_values(turn)))
        record = turn.cut.turn.record
        if record is not None:
            keep = "reference" if _is_reference(pipeline, turn) else "alarm" if turn.number in raising else ""
            connection.execute(
                insert(RAW).values(
                    machine=machine,
                    number=turn.number,
                    rate=turn.cut.mode.rate,
                    unit=turn.cut.mode.unit,
                    keep=keep,
                    record=np.asarray(record, "<f4").tobytes(),
                )
            )
    for happened in outcome.events:
        # An operator's act belongs to the newest turn.
        number = pipeline.turns if happened.turn is None else happened.turn
        body = {**plain(happened), "turn": number}
        written = connection.execute(
            insert(EVENT).values(
                machine=machine,
                turn=number,
                time_ns=happened.time_ns,
                quantity=happened.quantity,
                kind=happened.kind,
                level=happened.level,
                content=json.dumps(body),
            )
        )
        if happened.told:
            # events stay, so that no number comes twice; those of the outbox do, on SQLite
            assert written.inserted_primary_key is not None
            message = {"delivery": written.inserted_primary_key[0], "machine": machine, **body}
            for channel in channels:
                connection.execute(insert(OUTBOX).values(channel=channel, content=json.dumps(message)))


def _is_reference(pipeline: Pipeline, turn: Turn) -> bool:
    """The first turn of a mode whose verdict is healthy is kept to compare later ones with."""
    if turn.finding is None or not turn.finding.healthy:
        return False
    mode = turn.cut.mode.name
    if mode in pipeline.watch.references:
        return False
    pipeline.watch.references[mode] = turn.number
    return True


def _turn_values(turn: Turn) -> dict[str, Any]:
    finding = turn.finding
    content: dict[str, Any] = {"state": turn.problem[0] if turn.problem else None, "by_pulse": turn.cut.by_pulse}
    if finding is not None:
        content |= {
            "verdict": finding.verdict,
            "healthy": finding.healthy,
            "probability": finding.probability,
            "novelty": finding.novelty,
            "level": finding.level,
            "sizes": {name: list(size) for name, size in finding.sizes.items()},
            "smooth": {name: list(size) for name, size in turn.sizes.items()},
            "remaining": {name: [one.median, one.low, one.high] for name, one in turn.remaining.items()},
            "more": dict(finding.more),
        }
    return {
        "number": turn.number,
        "start_ns": turn.cut.start_ns,
        "duration": turn.cut.turn.duration,
        "mode": turn.cut.mode.name,
        "problem": turn.problem[1] if turn.problem else "",
        "content": json.dumps(finite(content)),
    }
