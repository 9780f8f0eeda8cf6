"""The tables, for SQLite and PostgreSQL alike.

What users name (classes, modes, units, files) may be of any length: PostgreSQL refuses what is longer than its column.
"""

from __future__ import annotations

from sqlalchemy import BigInteger, Column, Float, Index, Integer, LargeBinary, MetaData, String, Table, Text

VERSION = 1
"""Of the schema; a store of another one is refused."""

METADATA = MetaData()

# SQLite counts rows up by itself in a column of this very type alone.
_ROW = BigInteger().with_variant(Integer, "sqlite")

META = Table(
    "monitor_meta", METADATA, Column("key", String(32), primary_key=True), Column("value", Text, nullable=False)
)

MACHINE = Table(
    "machine",
    METADATA,
    Column("name", String(64), primary_key=True),
    Column("body", LargeBinary, nullable=False),  # the pipeline, as compressed JSON
    Column("summary", Text, nullable=False),  # what the first view tells, as JSON
)

# Samples that arrived and may still be needed, in the order in which they came.
BLOCK = Table(
    "block",
    METADATA,
    Column("row", _ROW, primary_key=True, autoincrement=True),
    Column("machine", String(64), nullable=False),
    Column("end_ns", BigInteger, nullable=False),
    Column("content", LargeBinary, nullable=False),
    Index("block_of_machine", "machine", "row"),
)

TURN = Table(
    "turn",
    METADATA,
    Column("machine", String(64), primary_key=True),
    Column("number", BigInteger, primary_key=True),
    Column("start_ns", BigInteger, nullable=False),
    Column("duration", Float, nullable=False),
    Column("mode", Text, nullable=False),
    Column("problem", Text, nullable=False),
    Column("content", Text, nullable=False),  # finding, smoothed sizes, remaining time, as JSON
    Index("turn_by_time", "machine", "start_ns"),
)

# Records of turns that are not in an archive file yet, and those kept for good (`keep` says why).
RAW = Table(
    "raw",
    METADATA,
    Column("machine", String(64), primary_key=True),
    Column("number", BigInteger, primary_key=True),
    Column("rate", Float, nullable=False),
    Column("unit", Text, nullable=False),
    Column("keep", String(16), nullable=False),
    Column("record", LargeBinary, nullable=False),
)

ARCHIVE = Table(
    "archive",
    METADATA,
    Column("machine", String(64), primary_key=True),
    Column("first", BigInteger, primary_key=True),
    Column("last", BigInteger, nullable=False),
    Column("end_ns", BigInteger, nullable=False),
    Column("file", Text, nullable=False),  # below `out`
)

# What physics says of the last turns of a machine.
EXPLANATION = Table(
    "explanation",
    METADATA,
    Column("row", _ROW, primary_key=True, autoincrement=True),
    Column("machine", String(64), nullable=False),
    Column("turn", BigInteger, nullable=False),  # the newest of those explained
    Column("time_ns", BigInteger, nullable=False),  # of the answer, by the host's clock
    Column("content", Text, nullable=False),  # as JSON
    Index("explanation_of_machine", "machine", "row"),
)

EVENT = Table(
    "event",
    METADATA,
    Column("row", _ROW, primary_key=True, autoincrement=True),
    Column("machine", String(64), nullable=False),
    Column("time_ns", BigInteger, nullable=False),
    Column("turn", BigInteger, nullable=False),
    Column("quantity", Text, nullable=False),
    Column("kind", String(16), nullable=False),
    Column("level", String(16), nullable=False),
    Column("content", Text, nullable=False),  # the whole event, as JSON
    Index("event_of_machine", "machine", "row"),
)

# What must still be told to others; a row goes when it was delivered.
OUTBOX = Table(
    "outbox",
    METADATA,
    Column("row", _ROW, primary_key=True, autoincrement=True),
    Column("channel", String(16), nullable=False),
    Column("content", Text, nullable=False),
)

# How far each source has been read, in its own words: a file that is done, a place in a data set.
POSITION = Table(
    "position",
    METADATA,
    Column("source", Text, primary_key=True),
    Column("item", Text, primary_key=True),
    Column("value", Text, nullable=False),
)

# Which process has a machine, and until when unless it renews [ns since 1970]; the machine "" stands for what one
# process does for all.
LEASE = Table(
    "lease",
    METADATA,
    Column("machine", String(64), primary_key=True),
    Column("owner", String(64), nullable=False),
    Column("until_ns", BigInteger, nullable=False),
)

# Processes that live.
WORKER = Table(
    "worker",
    METADATA,
    Column("owner", String(64), primary_key=True),
    Column("until_ns", BigInteger, nullable=False),
)
