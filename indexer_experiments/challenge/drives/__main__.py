"""The messy challenge of drives: hide effects in drives of random size, search for them, print the rates."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from indexer_env.errors import IndexerError
from indexer_experiments.challenge.drives.draw import draw
from indexer_experiments.challenge.drives.kept import Kept
from indexer_experiments.challenge.drives.run import judged
from indexer_experiments.challenge.drives.score import table

_INTERRUPTED = 130


def main(line: Sequence[str] | None = None) -> int:
    """Judge the cases that the file lacks and print the table of all it holds; the exit code, 1 where a case failed."""
    parser = argparse.ArgumentParser(f"python -m {__package__}", description=__doc__)
    parser.add_argument("cases", nargs="?", type=_from(1), default=100, help="how many, 1 or more")
    parser.add_argument("--seed", type=_from(0), default=0)
    parser.add_argument("--first", type=_from(0), default=0, help="number of the first case")
    parser.add_argument("--out", type=Path, help="file of a line of JSON a case; cases that it holds are not run again")
    options = parser.parse_args(line)
    try:
        kept = Kept(options.out, options.seed)
    except IndexerError as error:
        parser.error(str(error))
    failed = 0
    try:
        for number in range(options.first, options.first + options.cases):
            if number in kept.cases:
                continue
            try:
                found = judged(draw(options.seed, number))
            except IndexerError as error:
                failed += 1
                print(f"{number}: {error}", file=sys.stderr, flush=True)
                continue
            kept.add(found)
            print(f"{number}: hidden {found.hidden}, beside {found.unknown}: named {found.named}, hints {found.hints}, "
                  f"{found.before:.1f} -> {found.after:.1f}, {found.seconds:.0f} s", flush=True)  # fmt: skip
    except KeyboardInterrupt:
        return _INTERRUPTED
    finally:
        # of a run that is stopped, too
        print(table(list(kept.cases.values())))
    if failed:
        have = "has" if failed == 1 else "have"
        print(f"{failed} of {options.cases} cases {have} no answer and no place in the table.", file=sys.stderr)
    return 1 if failed else 0


def _from(low: int) -> Callable[[str], int]:
    """A whole number that is `low` or more."""

    def whole(text: str) -> int:
        if int(text) < low:
            raise argparse.ArgumentTypeError(f"must be {low} or more, got {text}")
        return int(text)

    whole.__name__ = "whole number"
    return whole


if __name__ == "__main__":
    sys.exit(main())
