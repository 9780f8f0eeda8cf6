"""The messy challenge of drives: ``python -m indexer_experiments.challenge.drives [cases] [--seed S] [--first N]``."""

from __future__ import annotations

import argparse
import dataclasses
import json

from indexer_experiments.challenge.drives.draw import draw
from indexer_experiments.challenge.drives.run import Judged, judged, table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="?", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--out", help="file that gets a line of JSON a case")
    options = parser.parse_args()
    results: list[Judged] = []
    for number in range(options.first, options.first + options.cases):
        found = judged(draw(options.seed, number))
        results.append(found)
        print(f"{number}: hidden {found.hidden}, beside {found.unknown}: named {found.named}, hints {found.hints}, "
              f"{found.before:.1f} -> {found.after:.1f}, {found.seconds:.0f} s", flush=True)  # fmt: skip
        if options.out:
            with open(options.out, "a", encoding="utf-8") as file:
                file.write(json.dumps(dataclasses.asdict(found)) + "\n")
    print(table(results))


if __name__ == "__main__":
    main()
