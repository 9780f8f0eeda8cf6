"""The cam indexing machine as a model whose records can be explained.

windows     records, and the windows they are cut into: one cam turn each, begun in the dwell
states      start states of windows from a few numbers
parameters  the machine's own parameters and how well they are known
nuisance    what is unknown of single windows and taken out of their residuals: hum's phase, filters' memory
library     the effect library as hypotheses
reading     what a sensor makes of them, and how far that is from what was measured
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
