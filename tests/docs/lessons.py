"""A page's programs, run as a reader would run them: word by word, from top to bottom, in a folder of their own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
_SETTING_UP = re.compile(r"^(\. |python3 -m venv|(\S*/)?pip |make |PIP_)")
"""Lines by which a reader makes the environment that a test is in already."""


def blocks(page: str) -> list[tuple[str, str]]:
    """Language and text of each block of code of a page of docs/."""
    return _BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))


def run(page: str, folder: Path) -> str:
    """Run a page's blocks in `folder` and give what they print.

    `sh` blocks are run as they stand. A `python` block whose first line is a comment with a file's name is that file;
    others are one program, which runs before the next `sh` or `text`. Every line of a `text` block must be among what
    was printed so far; its numbers may differ, as they do from processor to processor.
    """
    for name in ("examples", "conf"):
        (folder / name).symlink_to(ROOT / name)
    printed, program = "", ""
    for language, text in [*blocks(page), ("end", "")]:
        if language == "python" and (named := re.match(r"# (\w+\.py)\n", text)):
            (folder / named[1]).write_text(text, encoding="utf-8")
            continue
        if language == "python":
            program += text
            continue
        if program:
            printed += _done([sys.executable, "-c", program], folder, program)
            program = ""
        if language == "sh":
            lines = [line for line in text.splitlines() if not _SETTING_UP.match(line)]
            printed += _done(["bash", "-e", "-c", "\n".join(lines)], folder, text)
        elif language == "text":
            missing = [line for line in text.splitlines() if _shape(line) not in _shape(printed)]
            assert not missing, f"{page} shows\n{missing}\nand its programs printed\n{printed}"
    return printed


def _shape(text: str) -> str:
    """A text without its numbers and with single spaces."""
    return re.sub(r"\s+", " ", re.sub(r"\d+(\.\d+)?", "#", text)).strip()


def _done(command: list[str], folder: Path, shown: str) -> str:
    environment = os.environ | {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "MPLBACKEND": "Agg",
        "COLUMNS": "200",
    }
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{shown}\n{done.stdout}\n{done.stderr}"
    return done.stdout + done.stderr
