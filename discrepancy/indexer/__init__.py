"""The cam indexing machine as a model whose records can be explained.

windows     records, and the windows they are cut into: one cam turn each, begun in the dwell
states      start states of windows from a few numbers
parameters  the machine's own parameters and how well they are known
together    what earlier records left known of the machine's numbers together
nuisance    what is unknown of single windows and taken out of their residuals: hum's phase, filters' memory
library     the effect library as hypotheses
lines       frequencies and orders that stand out of what is left in every record
machines    the machine and sensor that a point stands for
laid_out    points as the kernel takes them, with what all windows of a record share
loops       compiled loops over samples
reading     what a sensor makes of windows, and how far that is from what was measured
advance     windows side by side, advanced by the kernel
model       IndexerModel, which simulates windows in batches
response    what torques at the joints would add to the readings, linearised
setting     what a fitted model says of its records, for causes to be compared
causes      what may be missing at each joint, free over one variable
scans       lines, resonances and bursts, which have to be looked for
extend      the machine extended by what was found, as YAML that every command loads
"""

from discrepancy.indexer.extend import machine_yaml, sensor_yaml
from discrepancy.indexer.model import IndexerModel
from discrepancy.indexer.windows import Experiment

__all__ = ["Experiment", "IndexerModel", "machine_yaml", "sensor_yaml"]
