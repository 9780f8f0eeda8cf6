"""What commands say: words, and the console that says them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import NoReturn

from rich.console import Console

BAD_INPUT = 2
"""Exit code of a command that was given what it cannot use."""


def stop_for(sentence: str) -> NoReturn:
    """End the command over its input, with this one line on stderr; the SystemExit has it as a note."""
    print(f"error: {sentence}", file=sys.stderr)
    stop = SystemExit(BAD_INPUT)
    stop.add_note(sentence)
    raise stop from None


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number with its noun: "1 file", "2 files"; `many` where the plural is not `one` with an s."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def joined(words: Sequence[str], last: str = "and") -> str:
    """ "a, b and c"."""
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def plain_console() -> Console:
    """Standard output as text that no terminal cuts or colours; a unit in brackets is no markup."""
    return Console(highlight=False, soft_wrap=True, markup=False)
