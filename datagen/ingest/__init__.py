"""Measured files -> the same kind of folder that the generator writes: one row is one turn of the table.

In reading order, along the data flow:
    settings       all that decides the bytes of the data set, checked first
    sources        which files, each with its class, groups and known conditions
    survey         rate and length of the records, where they are left to the files
    split          groups of files -> subsets, never turn by turn
    cut            one file -> its turns, or the sentence that refuses it or one of them
    publish        turns -> shards, rejected.parquet and manifest: all contact with `datagen.store`
    __main__       indexer ingest

Files are read by `indexer_records.measured`, so what that refuses is refused here with the same sentence, as a row of
rejected.parquet. docs/how-to/measured_data.md says it to users.
"""
