"""The challenge: effects are hidden in a machine, the search gets records of it, and its answers are scored.

In reading order:
    laws        motion laws in closed form
    unlisted    physics that the library lacks, for the messy challenge
    equations   the machine's equations in compiled floats that share no code with the kernels
    solver      Dormand–Prince steps that stop at every edge of the joints
    parameters  a machine's numbers by their names
    truth       a machine at an operating point, solved by these
    running     what a sensor reads of a record that begins while it has long been running
    draw        what is hidden in case k: kind, effects, sizes, machine; a function of the seed and k alone
    records     the measured files of a case and what was known when they were taken
    case        one case from its draw to its scored answer
    criteria    what must be shown, beside what the cases show so far
    score       all tables: by kind, size, play and effect
    messy/      the same with machines of any size and disturbances that are in no library
    drives/     simulated drives with effects hidden, and a messy challenge of them
    plan        which cases a run solves, all groups in turns
    run         all cases, resumable one by one, on one process, several or Ray
    __main__    indexer challenge

Units are SI and rad. A gap is the base model's level: rms of its residuals over the noise, 1 where nothing is hidden.
"""
