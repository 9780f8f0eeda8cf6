"""`python -m benchmarks.monitor NAME [--help]`."""

from __future__ import annotations

import importlib
import sys

NAMES = ("wear", "kill", "load", "soak", "payloads")

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in NAMES:
        raise SystemExit(f"name one of {', '.join(NAMES)}")
    importlib.import_module(f"benchmarks.monitor.{sys.argv[1]}").main(sys.argv[2:])
