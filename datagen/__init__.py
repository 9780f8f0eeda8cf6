"""Data sets: from one line on the command line to Parquet files that say how each of their rows was made.

In reading order, along the data flow:
    seeds          (seed, part, item) -> random stream, Sobol' point; item i never depends on item i-1
    quantities     the quantities that can be varied, by dotted path in SI units
    changes        fields of frozen objects by dotted path: read and replaced
    draws          a law for each varied quantity, a probability for each drawn effect
    labels         classes by the faults of the bench; subsets by machine draw
    base           what every item starts from, and its quantities by path
    campaign       item i -> label and what differs from the base machine; `build` makes the machine
    campaigns/     the families, one file each: table2 (the paper's six classes), bench (its 20 cases), random,
                   wear (run to failure), own (one's own machine), grid; cells (combinations of values)
    laws_in_place  laws written in a quantity's own place -> the campaign's draws
    preflight      laws that are mistakes, refused before anything is simulated
    order          all that decides the bytes of a data set, checked first
    produce        items -> simulate_batch -> sensor -> rows and records
    versions       which versions of what made a record
    rows           a machine, sensor and run as columns, and back
    schema         every column with type, unit and one sentence
    shard          rows <-> Parquet; `read_shards(folder)`
    store          the files of a data set, and who is writing it
    receipts       what became of a shard's items; all receipts together are the manifest
    make_shard     an order and a number -> a shard and its receipt: the task of every executor
    executors/     who does the tasks: threads of this process, a Ray cluster
    run_log        run.json: when, on what, with how many interruptions
    generate       an order -> a folder: shards, rejected items, example, manifest; continues where it was stopped
    recipes        data sets as command lines, made once and kept
    example        example.csv, as a data logger would write it, and its truth
    card           README.md with its pictures (`pictures`) and Croissant metadata (`croissant`)
    batches        a data set -> shuffled PyTorch batches, or single records by place
    publish        indexer publish: a copy for the Hugging Face Hub, with a split for each subset
    remake         a row -> its record again, bit for bit; a command
    audit/         what DATA.md promises, asserted
    check          indexer check: the verdict on a data set
    ingest/        measured files -> a data set of the same layout; indexer ingest
    progress       a bar or log lines
    simulate       one record of a machine as files; indexer simulate
    new            a machine as a commented YAML file; indexer new
    __main__       indexer generate

Units are SI and rad throughout; every numeric column carries its unit in the field metadata of the Parquet
files. Index conventions: items and machine draws count from 0, classes from 1 as in the paper. A row is one
record, whatever batch or shard it was made in. DATA.md shows the folder and the schema as one tree.
"""
