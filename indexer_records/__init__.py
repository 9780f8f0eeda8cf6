"""Measured files and the turns in them: what ingest, diagnosis and the search for missing effects all begin with.

In reading order:
    formats/     measured files of all formats as named columns, one reader a file
    time_grid    a column of time -> one sampling rate, or the place where it is not even
    acceleration_units  units as files write them
    column_choice  which columns are meant: the record, and the time that belongs to it
    measured     `read_signal(file)`: a measured file -> Signal, or one sentence that says why not
    channels     several channels as one record
    file_table   measured files that a folder, a pattern or a list names, and a table that says more about each
    conditions   what is known of a record beside its samples; the pulse that marks turns; the records turns become
    turns        a pulse or a period -> where turns begin and end
    resample     samples at one rate -> a turn at another, without aliases
    stream       samples as they come -> turns with their records as from a file, bit for bit where none is resampled
    quality      flat tops and dead stretches of a record

Units are SI; times count from a file's first sample.
"""
