"""Write the records of a simulated drive of the gallery: ``python -m examples.drives.records feed_axis runs``."""

import sys
from pathlib import Path

from indexer_experiments.challenge.drives.gallery import GALLERY, write

if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in GALLERY:
        sys.exit(f"give one of {', '.join(GALLERY)} and a folder")
    write(sys.argv[1], Path(sys.argv[2]))
