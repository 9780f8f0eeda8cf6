"""What DATA.md promises, asserted: each module gives the faults it finds, one sentence each.

In reading order:
    words      how a fault is said
    values     null, range and choice of every column, row by row
    records    the samples of each record, and what is known of them from other columns
    rebuild    a row's machine, faults, operating point, run and sensor exist
    together   what must agree between the rows of a data set: items, classes, codes, subsets, counts
    files      which files there are, their sizes, checksums and schemas
    again      a sample of rows made again, bit for bit

`datagen.check` runs them over a data set, a shard at a time.
"""
