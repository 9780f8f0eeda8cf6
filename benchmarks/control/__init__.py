"""`Indexer-v1` under PPO scripts that were written for no environment in particular, beside controls without learning.

single_file_ppo   CleanRL's continuous PPO by its documented defaults, in plain torch
scripts           both scripts, trained and measured
baselines         constant speeds, random commands, and how any policy is measured
page              the table of docs/reference/environments/indexer.md

``python -m benchmarks.control`` trains, measures, and writes the table and results.json.
"""
