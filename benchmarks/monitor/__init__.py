"""The numbers of the monitor, each measured by a command (`python -m benchmarks.monitor NAME`)."""
