"""`indexer VERB KEY=VALUE ...`: the one command of the project."""

from __future__ import annotations

import importlib
import sys

from indexer_cli.completion import HOW, SHELLS, candidates
from indexer_cli.manual import manual, overview
from indexer_cli.pipe import forgiving_output
from indexer_cli.verbs import VERBS

_BAD_INPUT = 2
_INTERRUPTED = 130


def version() -> str:
    """The installed version."""
    from importlib.metadata import version as installed

    return installed("indexer-diagnosis")


def main() -> None:
    """Answer, or hand the rest of the command line to the verb; a reader that leaves early, as `head` does, is fine."""
    with forgiving_output():
        _main()


def _main() -> None:
    first, *rest = sys.argv[1:] or ["--help"]
    if first in ("--help", "-h"):
        first = "help"
    if first == "help" and not rest:
        print(overview(version()))
    elif first == "--version":
        print(f"indexer {version()}")
    elif first == "--completion":
        _completion(rest)
    elif first == "--complete":
        print("\n".join(candidates(rest)))
    elif (name := rest[0] if first == "help" else first) not in VERBS:
        _refuse(name)
    elif first == "help" or "--help" in rest or "-h" in rest:
        print(manual(name))
    else:
        sys.argv = [f"indexer {name}", *rest]
        _run(VERBS[name].module)


def _run(name: str) -> None:
    """Run the `main` of a module; what stops the loading of libraries is told as what stops the work."""
    try:
        module = importlib.import_module(name)
        if hasattr(module, "__path__"):
            module = importlib.import_module(f"{name}.__main__")
        module.main()
    except KeyboardInterrupt:
        print("stopped from the keyboard", file=sys.stderr)
        raise SystemExit(_INTERRUPTED) from None


def _completion(rest: list[str]) -> None:
    if not rest:
        print(HOW)
    elif rest[0] in SHELLS:
        print(SHELLS[rest[0]])
    else:
        _say(f"--completion must be followed by {' or '.join(SHELLS)}, got {rest[0]!r}.")


def _refuse(name: str) -> None:
    from indexer_env.checks import did_you_mean

    remedy = did_you_mean(name, VERBS) or "indexer --help lists them"
    _say(f"the first word must be a verb, got {name!r}; {remedy}.")


def _say(sentence: str) -> None:
    print(f"error: {sentence}", file=sys.stderr)
    raise SystemExit(_BAD_INPUT)


if __name__ == "__main__":
    main()
