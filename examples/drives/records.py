"""Write the records of a simulated drive of the gallery: ``python -m examples.drives.records feed_axis runs``."""

import sys
from pathlib import Path

from indexer_experiments.challenge.drives.gallery import GALLERY, write

USAGE = "python -m examples.drives.records DRIVE OUT"


def main(arguments: list[str]) -> None:
    """Write them; a mistake ends the program with one sentence."""
    if len(arguments) != 2 or arguments[1].startswith("-"):
        sys.exit(f"error: a drive and a folder to write are needed; {USAGE}, DRIVE one of {', '.join(GALLERY)}")
    drive, out = arguments
    if drive not in GALLERY:
        sys.exit(f"error: DRIVE must be one of {', '.join(GALLERY)}, got {drive!r}; {USAGE}")
    try:
        write(drive, Path(out))
    except OSError as error:
        sys.exit(f"error: OUT must be a folder that can be written, got {out} ({error.strerror}); choose another.")


if __name__ == "__main__":
    main(sys.argv[1:])
