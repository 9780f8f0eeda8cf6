"""Reading and writing of all that is kept."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection, Engine, create_engine, delete, event, func, insert, select, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError, NoSuchModuleError
from sqlalchemy.exc import TimeoutError as NoConnection

from indexer_cli.json_values import finite
from indexer_env.errors import IndexerError
from monitor.intake.blocks import Block
from monitor.store.codec import block_bytes, block_from, pack, unpack
from monitor.store.schema import (
    ARCHIVE,
    BLOCK,
    EVENT,
    EXPLANATION,
    MACHINE,
    META,
    METADATA,
    OUTBOX,
    POSITION,
    RAW,
    TURN,
    VERSION,
)  # fmt: skip

_PATIENCE_S = 30.0


class StoreDown(Exception):
    """The database cannot be reached or has broken off; what was not committed must be done again."""


class StoreConflict(StoreDown):
    """What is written does not go with what is there, as another process has written it meanwhile."""


class StoreError(IndexerError, ValueError):
    """A store cannot be used; the message says why."""


class Store:
    """The database at a URL of SQLAlchemy: `sqlite:///PATH` or `postgresql+psycopg://…`.

    Archived turns lie below `out`.

    Raises
    ------
    StoreError
        No such kind of database, a driver that is not installed, or a store of another version.
    StoreDown
        The database cannot be reached.
    """

    def __init__(self, url: str, out: Path = Path()) -> None:
        self.out = out.resolve()
        self.url = url.replace("postgresql://", "postgresql+psycopg://", 1)
        self._engine = _engine(self.url)
        with self.transaction() as connection:
            METADATA.create_all(connection)
            found = connection.execute(select(META.c.value).where(META.c.key == "version")).scalar()
            if found is None:
                connection.execute(insert(META).values(key="version", value=str(VERSION)))
            elif found != str(VERSION):
                raise StoreError(f"the store must be of version {VERSION}, got {found}; use a new one.")

    @contextlib.contextmanager
    def transaction(self) -> Iterator[Connection]:
        """One transaction: all of it is kept or nothing. Raises StoreDown where the database breaks off,
        and StoreConflict where another process has written the same."""
        try:
            with self._engine.begin() as connection:
                yield connection
        except (DBAPIError, NoConnection) as error:
            self._engine.dispose()
            said = str(getattr(error, "orig", None) or error).splitlines()[0]
            if isinstance(error, IntegrityError):
                remedy = "begin with another out, and give monitors that share a store a lease.owner each"
                raise StoreConflict(f"another monitor has written to the store ({said}); {remedy}") from None
            raise StoreDown(said) from None

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    # ------------------------------------------------------------------------------------------------ machines

    def machines(self) -> list[dict[str, Any]]:
        """Summaries of all machines, by name."""
        with self.transaction() as connection:
            rows = connection.execute(select(MACHINE.c.summary).order_by(MACHINE.c.name))
            return [json.loads(row[0]) for row in rows]

    def summary(self, machine: str) -> dict[str, Any] | None:
        """Summary of one machine."""
        with self.transaction() as connection:
            row = connection.execute(select(MACHINE.c.summary).where(MACHINE.c.name == machine)).first()
        return None if row is None else json.loads(row[0])

    def machine(self, name: str) -> tuple[dict[str, Any] | None, list[Block]]:
        """What is known of a machine, and its samples that may still be needed."""
        with self.transaction() as connection:
            row = connection.execute(select(MACHINE.c.body).where(MACHINE.c.name == name)).first()
            blocks = connection.execute(select(BLOCK.c.content).where(BLOCK.c.machine == name).order_by(BLOCK.c.row))
            return None if row is None else unpack(row[0]), [block_from(block[0]) for block in blocks]

    # ------------------------------------------------------------------------------------------------ turns

    def turns(self, machine: str, before: int | None = None, count: int = 100) -> list[dict[str, Any]]:
        """The last turns before a number, newest first."""
        query = select(TURN).where(TURN.c.machine == machine)
        if before is not None:
            query = query.where(TURN.c.number < before)
        with self.transaction() as connection:
            return [_turn(row) for row in connection.execute(query.order_by(TURN.c.number.desc()).limit(count))]

    def turn(self, machine: str, number: int) -> dict[str, Any] | None:
        """One turn."""
        with self.transaction() as connection:
            row = connection.execute(select(TURN).where(TURN.c.machine == machine, TURN.c.number == number)).first()
        return None if row is None else _turn(row)

    def raw(self, machine: str, number: int) -> tuple[np.ndarray, float, str] | None:
        """Record, rate [Hz] and unit of a turn that is still in the database."""
        query = select(RAW).where(RAW.c.machine == machine, RAW.c.number == number)
        with self.transaction() as connection:
            row = connection.execute(query).first()
        return None if row is None else (np.frombuffer(bytes(row.record), "<f4"), float(row.rate), str(row.unit))

    def reference(self, machine: str, mode: str, number: int) -> int | None:
        """Number of the turn that was the healthy one of a mode when this one was taken: they are renewed."""
        query = (
            select(RAW.c.number)
            .join(TURN, (TURN.c.machine == RAW.c.machine) & (TURN.c.number == RAW.c.number))
            .where(RAW.c.machine == machine, RAW.c.keep == "reference", TURN.c.mode == mode, RAW.c.number <= number)
        )
        with self.transaction() as connection:
            return connection.execute(query.order_by(RAW.c.number.desc())).scalar()

    def archive_of(self, machine: str, number: int) -> str | None:
        """File that holds a turn."""
        query = select(ARCHIVE.c.file).where(
            ARCHIVE.c.machine == machine, ARCHIVE.c.first <= number, ARCHIVE.c.last >= number
        )
        with self.transaction() as connection:
            return connection.execute(query).scalar()

    # ------------------------------------------------------------------------------------------------ physics

    def explanations(self, machine: str, count: int = 5) -> list[dict[str, Any]]:
        """What physics has said of a machine, newest first."""
        query = select(EXPLANATION).where(EXPLANATION.c.machine == machine)
        with self.transaction() as connection:
            rows = connection.execute(query.order_by(EXPLANATION.c.row.desc()).limit(count))
            return [{"turn": row.turn, "time_ns": row.time_ns, **json.loads(row.content)} for row in rows]

    def explained(self) -> dict[str, int]:
        """When physics last spoke of each machine [ns since 1970]."""
        query = select(EXPLANATION.c.machine, func.max(EXPLANATION.c.time_ns)).group_by(EXPLANATION.c.machine)
        with self.transaction() as connection:
            return {row[0]: row[1] for row in connection.execute(query)}

    def write_explanation(self, machine: str, turn: int, time_ns: int, content: dict[str, Any]) -> None:
        """Keep what physics says of the turns up to this one."""
        values = {"machine": machine, "turn": turn, "time_ns": time_ns, "content": json.dumps(finite(content))}
        with self.transaction() as connection:
            connection.execute(insert(EXPLANATION).values(**values))

    # ------------------------------------------------------------------------------------------------ events

    def events(self, machine: str | None = None, count: int = 200) -> list[dict[str, Any]]:
        """What happened to alarms, newest first."""
        query = select(EVENT)
        if machine is not None:
            query = query.where(EVENT.c.machine == machine)
        with self.transaction() as connection:
            rows = connection.execute(query.order_by(EVENT.c.row.desc()).limit(count))
            return [
                {"id": row.row, "machine": row.machine, "turn": row.turn, **json.loads(row.content)} for row in rows
            ]

    def outbox(self, channel: str, count: int = 50) -> list[tuple[int, dict[str, Any]]]:
        """What must still be told on a channel, oldest first: its row, and the message, with its event's number under
        "delivery" (what an earlier version has left has that of its row)."""
        query = select(OUTBOX).where(OUTBOX.c.channel == channel).order_by(OUTBOX.c.row).limit(count)
        with self.transaction() as connection:
            return [(row.row, {"delivery": row.row, **json.loads(row.content)}) for row in connection.execute(query)]

    def drop_outbox(self, channels: Sequence[str]) -> int:
        """Forget what was to be told on other channels than these; returns how many messages."""
        with self.transaction() as connection:
            return connection.execute(delete(OUTBOX).where(OUTBOX.c.channel.not_in(channels))).rowcount

    def delivered(self, rows: Sequence[int]) -> None:
        """These were told."""
        with self.transaction() as connection:
            connection.execute(delete(OUTBOX).where(OUTBOX.c.row.in_(list(rows))))

    # ------------------------------------------------------------------------------------------------ sources

    def positions(self, source: str) -> dict[str, str]:
        """How far a source has been read, by item."""
        with self.transaction() as connection:
            rows = connection.execute(select(POSITION.c.item, POSITION.c.value).where(POSITION.c.source == source))
            return {row[0]: row[1] for row in rows}

    def counts(self) -> dict[str, int]:
        """Rows of each table, for tests and /metrics."""
        with self.transaction() as connection:
            return {
                table.name: int(connection.execute(text(f"SELECT COUNT(*) FROM {table.name}")).scalar() or 0)
                for table in METADATA.sorted_tables
            }


def write_block(connection: Connection, block: Block) -> None:
    """Keep samples that arrived."""
    connection.execute(insert(BLOCK).values(machine=block.machine, end_ns=block.end_ns, content=block_bytes(block)))


def drop_blocks(connection: Connection, machine: str, before_ns: int, newest_ns: int) -> None:
    """Forget samples that end before a time, and what came before them but ends after the newest: it has its time by a
    clock that was set back since."""
    old = (BLOCK.c.machine == machine) & (BLOCK.c.end_ns < before_ns)
    last = select(func.max(BLOCK.c.row)).where(old).scalar_subquery()
    ahead = (BLOCK.c.machine == machine) & (BLOCK.c.end_ns > newest_ns) & (BLOCK.c.row < last)
    connection.execute(delete(BLOCK).where(ahead))
    connection.execute(delete(BLOCK).where(old))


def write_machine(connection: Connection, name: str, body: dict[str, Any], summary: dict[str, Any]) -> None:
    """Keep what is known of a machine."""
    values = {"body": pack(body), "summary": json.dumps(finite(summary))}
    found = connection.execute(MACHINE.update().where(MACHINE.c.name == name).values(**values))
    if not found.rowcount:
        connection.execute(insert(MACHINE).values(name=name, **values))


def write_position(connection: Connection, source: str, item: str, value: str) -> None:
    """Keep how far a source has been read."""
    where = (POSITION.c.source == source) & (POSITION.c.item == item)
    if not connection.execute(POSITION.update().where(where).values(value=value)).rowcount:
        connection.execute(insert(POSITION).values(source=source, item=item, value=value))


def _turn(row: Any) -> dict[str, Any]:
    return {
        "number": row.number,
        "start_ns": row.start_ns,
        "duration": row.duration,
        "mode": row.mode,
        "problem": row.problem,
        **json.loads(row.content),
    }


def _engine(url: str) -> Engine:
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() not in ("sqlite", "postgresql"):
            raise StoreError(f"store must be sqlite:///PATH or postgresql://..., got {parsed.get_backend_name()}.")
        if parsed.get_backend_name() == "sqlite":
            if not parsed.database:
                raise StoreError("store must name a file, sqlite:///PATH.")
            Path(parsed.database).parent.mkdir(parents=True, exist_ok=True)
            engine = create_engine(url, connect_args={"timeout": _PATIENCE_S})
            event.listen(engine, "connect", _sqlite_settings)
            return engine
        return create_engine(url, pool_pre_ping=True, connect_args={"connect_timeout": 5})
    except StoreError:
        raise
    except (ArgumentError, NoSuchModuleError, ModuleNotFoundError, ValueError):
        # The URL may hold a password, so it is not repeated.
        raise StoreError("store must be sqlite:///PATH or postgresql://USER@HOST/NAME, got another URL.") from None


def _sqlite_settings(connection: Any, _record: Any) -> None:
    cursor = connection.cursor()
    # Readers do not wait for the writer; what is committed survives a kill.
    cursor.execute("PRAGMA journal_mode=WAL")
    cursor.execute("PRAGMA synchronous=NORMAL")
    cursor.close()
