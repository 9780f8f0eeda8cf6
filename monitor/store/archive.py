"""Turns from the database to Parquet files, and how long they are kept.

Whole runs of turns of a machine go into one file, which appears whole and before the rows leave the database: a kill
in between leaves them twice, never not at all, and the next run replaces the file. Rows marked `keep` stay.
"""

from __future__ import annotations

import hashlib
import logging
import re
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from sqlalchemy import delete, func, insert, select

from indexer_cli.places.local import whole_file
from monitor.intake.blocks import NANO
from monitor.store.schema import ARCHIVE, EXPLANATION, MACHINE, METADATA, RAW, TURN
from monitor.store.store import Store

_log = logging.getLogger(__name__)

FILE_TURNS = 256
"""Turns of a file: 8 MB of an 8.2 s turn at 1 kHz."""

FOLDER = "turns"

DAY_NS = 24 * 3600 * NANO


def keep(store: Store, raw_days: float, turn_days: float) -> None:
    """Forget what is older than so many days, then archive: on a full disk only the first makes room."""
    expire(store, time.time_ns(), round(raw_days * DAY_NS), round(turn_days * DAY_NS))
    archive(store)


def archive(store: Store, file_turns: int = FILE_TURNS) -> int:
    """Move whole files of turns of every machine out of the database; returns how many files were written."""
    with store.transaction() as connection:
        query = select(RAW.c.machine, func.count()).where(RAW.c.keep == "").group_by(RAW.c.machine)
        full = [row[0] for row in connection.execute(query) if row[1] >= 2 * file_turns]
    return sum(_archive_one(store, machine, file_turns) for machine in full)


def expire(store: Store, now_ns: int, raw_ns: int, turns_ns: int) -> None:
    """Forget archived records and findings of turns, networks' and physics', that are older than this. Where a
    machine's newest turn is of the past, as in files measured long ago, it counts from there."""
    old: list[str] = []
    with store.transaction() as connection:
        # By machine, so that the index finds them: all turns of a year are too many to look through.
        for machine in connection.execute(select(MACHINE.c.name)).scalars().all():
            newest = connection.execute(select(func.max(TURN.c.start_ns)).where(TURN.c.machine == machine)).scalar()
            now = now_ns if newest is None else min(now_ns, newest)
            files = (ARCHIVE.c.machine == machine) & (ARCHIVE.c.end_ns < now - raw_ns)
            old += connection.execute(select(ARCHIVE.c.file).where(files)).scalars()
            connection.execute(delete(ARCHIVE).where(files))
            young = select(TURN.c.number).where(TURN.c.machine == machine, TURN.c.start_ns >= now - raw_ns)
            raw = (RAW.c.machine == machine) & (RAW.c.keep == "") & RAW.c.number.not_in(young)
            connection.execute(delete(RAW).where(raw))
            # a record that is kept for good needs its turn
            kept = select(RAW.c.number).where(RAW.c.machine == machine, RAW.c.keep != "")
            turns = (TURN.c.machine == machine) & (TURN.c.start_ns < now - turns_ns)
            connection.execute(delete(TURN).where(turns, TURN.c.number.not_in(kept)))
        connection.execute(delete(EXPLANATION).where(EXPLANATION.c.time_ns < now_ns - turns_ns))
    for file in old:
        _path(store, file).unlink(missing_ok=True)


def forgotten(store: Store, machine: str) -> str:
    """Delete a machine with all that is stored of it, its files too; what came of it, as a sentence. Alarms that still
    wait to be delivered are, and how far sources were read stays."""
    with store.transaction() as connection:
        known = sorted(connection.execute(select(MACHINE.c.name)).scalars().all())
        if machine not in known:
            return f"There is no machine {machine!r} to forget; known are: {', '.join(known) or 'none'}."
        files = connection.execute(select(ARCHIVE.c.file).where(ARCHIVE.c.machine == machine)).scalars().all()
        turns = connection.execute(select(func.count()).where(TURN.c.machine == machine)).scalar()
        for table in METADATA.sorted_tables:
            if "machine" in table.c:
                connection.execute(delete(table).where(table.c.machine == machine))
        connection.execute(delete(MACHINE).where(MACHINE.c.name == machine))
    for file in files:
        _path(store, file).unlink(missing_ok=True)
    return f"The machine {machine!r} is forgotten, with {turns} turns."


def archived(path: Path, number: int) -> tuple[np.ndarray, float, str] | None:
    """Record, rate [Hz] and unit of a turn in a file; None where it is not there, or cannot be read, which the log
    tells."""
    if not path.is_file():
        return None
    try:
        table = pq.read_table(path, filters=[("number", "=", number)], page_checksum_verification=True)
        if not table.num_rows:
            return None
        row = table.to_pylist()[0]
        return np.array(row["record"], dtype=np.float32), float(row["rate"]), str(row["unit"])
    except (OSError, pa.ArrowException, LookupError, ValueError) as error:
        _log.warning("the record of turn %d cannot be read from %s: %s", number, path, error)
        return None


def record_of(store: Store, machine: str, number: int) -> tuple[np.ndarray, float, str] | None:
    """Record, rate [Hz] and unit of a turn, from the database or a file; None where it is not kept."""
    found = store.raw(machine, number)
    if found is not None:
        return found
    file = store.archive_of(machine, number)
    return None if file is None else archived(_path(store, file), number)


def _archive_one(store: Store, machine: str, file_turns: int) -> int:
    query = select(RAW).where(RAW.c.machine == machine, RAW.c.keep == "").order_by(RAW.c.number).limit(file_turns)
    with store.transaction() as connection:
        rows = connection.execute(query).all()
        numbers = [row.number for row in rows]
        times = connection.execute(
            select(TURN.c.number, TURN.c.start_ns).where(TURN.c.machine == machine, TURN.c.number.in_(numbers))
        ).all()
    starts = {row.number: row.start_ns for row in times}
    table = pa.table(
        {
            "machine": [machine] * len(rows),
            "number": pa.array(numbers, pa.int64()),
            "start_ns": pa.array([starts.get(number) for number in numbers], pa.int64()),
            "rate": [float(row.rate) for row in rows],
            "unit": [row.unit for row in rows],
            "record": pa.array([np.frombuffer(bytes(row.record), "<f4") for row in rows], pa.list_(pa.float32())),
        }
    )
    file = f"{FOLDER}/{folder_name(machine)}/{numbers[0]:09d}-{numbers[-1]:09d}.parquet"
    path = store.out / file
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as temporary:
        pq.write_table(table, temporary, compression="zstd", write_page_checksum=True)
    with store.transaction() as connection:
        connection.execute(
            insert(ARCHIVE).values(
                machine=machine,
                first=numbers[0],
                last=numbers[-1],
                file=file,
                end_ns=max(starts.values(), default=0),
            )
        )
        connection.execute(delete(RAW).where(RAW.c.machine == machine, RAW.c.number.in_(numbers), RAW.c.keep == ""))
    return 1


def _path(store: Store, file: str) -> Path:
    """A file of the archive; what it says of folders above the archive's was true before `out` was moved or copied."""
    return store.out.joinpath(*Path(file).parts[-3:])


def folder_name(machine: str) -> str:
    """A machine's name as that of a folder: what no file system minds, and a mark so that no two names meet."""
    plain = re.sub(r"[^A-Za-z0-9-]+", "_", machine)[:40]
    return f"{plain}-{hashlib.sha256(machine.encode()).hexdigest()[:8]}"
