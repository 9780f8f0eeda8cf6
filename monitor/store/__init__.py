"""What is kept: one database, and whole turns as Parquet beside it.

schema   the tables
codec    samples and plain values <-> bytes
store    reading and writing, one transaction a batch
writing  what came of a block -> rows
archive  turns from the database to Parquet files, and how long they are kept
"""

from monitor.store.store import Store, StoreConflict, StoreDown

__all__ = ["Store", "StoreConflict", "StoreDown"]
