"""Baselines of `IndexerDiagnosis-v1`: how often they are right against what their measurements cost.

measured     cases measured once at every setting
belief       what measurements say about the name
policies     random, fixed turns, greedy information
learned      a policy learned on beliefs
play         episodes under a policy
evaluate     all policies over seeds; what each setting tells
page         the tables of docs/reference/environments/indexer_diagnosis.md and the picture beside them

``python -m benchmarks.diagnosis`` does it all (``--quick``: a look whether all runs; nothing is written).
"""
