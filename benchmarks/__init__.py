"""How accurate and how fast the simulator is, with the same work done by other solvers.

`python -m benchmarks [SECTION|all] [--quick]` (`make bench`) measures, writes results.json and work_precision.png and
fills the table of README.md; the sections are those of `report`.

Map, in reading order
---------------------
cases            the machines that are measured, their draws with their seeds
measures         order of convergence, relative rms, level difference, energy: plain mathematics
references       records of the reference solver, computed once on all cores and kept in .cache/
peers            the same machine for other solvers: compiled plain RK4, SciPy, JAX, diffrax, CVODE
accuracy         the simulator against the reference
speed            turns per second, beside a JAX scan of the same scheme
kernel           the simulator beside an older checkout of itself, case by case; a command of its own
environment      environment steps per second, one machine and many, beside Gymnasium's own
diagnosis        how often baselines of the diagnosis environment are right, against cost; a command of its own
data_sets        the generator end to end, beside the bare simulator; ray_cluster times a cluster for it
training         many networks trained as one; natural trains the same one after the other
stored           data sets that are read, made once and kept in .cache/
parquet          ways to store records: size, speed; fills the table of docs/explanation/files.md
reading          shuffled batches and the check: records per second
processes        what only a fresh process shows: import, first call, later starts, peak memory
work_precision   error against time for every solver; picture draws it
naming           whether the search for a missing effect names what was hidden; a command of its own
report           rows with their verdicts, results.json, the table of README.md
session          the cores used, and what the header of the table says about the machine

Benchmarks are not tests: a number missed is printed as missed and fails nothing.
"""
