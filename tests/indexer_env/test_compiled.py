"""One version of every compiled entry point, and a word exactly when it is made."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from indexer_env import kernels
from indexer_env.compiled import fingerprint, kernel_fingerprint, one_version, read_only

ROOT = Path(__file__).parents[2]

SMALL = """
import numba
import numpy as np
from indexer_env.compiled import one_version, read_only

@numba.njit(cache=True)
def doubled(values, factor):
    return 2.0 * values.sum() * factor

@numba.njit(cache=True)
def halved(values):
    return 0.5 * values.sum()

one_version("two sums", 1, (doubled, (read_only(2), 1.0)), (halved, (read_only(2),)))
print(doubled(np.ones(2), 3.0), halved(np.ones(4)))
"""


def test_the_word_comes_when_there_is_no_compiled_version_and_then_only(tmp_path):
    """However long it takes to load one: the first process compiles, the second finds it in the cache."""
    script = tmp_path / "small.py"
    script.write_text(SMALL)
    told = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, script], capture_output=True, text=True, check=False,
            env=os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path)},
        )  # fmt: skip
        assert (done.returncode, done.stdout) == (0, "12.0 2.0\n"), done.stderr
        told.append(done.stderr)
    word = "indexer_env: compiling two sums, once per installation (1 s on a free processor) …\n"
    assert told == [word, ""]


@numba.njit
def total(values, factor):
    return values.sum() * factor


def test_other_types_are_refused_instead_of_compiled(capsys):
    one_version("a sum", 1, (total, (read_only(2), 1.0)), (total.py_func, ()))
    one_version("a sum", 1, (total, (read_only(2), 1.0)))
    assert (
        capsys.readouterr().err == "indexer_env: compiling a sum, once per installation (1 s on a free processor) …\n"
    )
    assert total(np.ones(2), 3) == total(read_only(2) + 1.0, 3.0) == 6.0
    for other in (np.ones(4)[::2], np.ones(2, dtype=np.float32), np.ones((2, 1))):
        with pytest.raises(TypeError, match="No matching definition"):
            total(other, 3.0)
    assert len(total.signatures) == 1


def test_the_fingerprint_changes_with_any_source(tmp_path):
    one, other = tmp_path / "one.py", tmp_path / "other.py"
    one.write_text("1")
    other.write_text("2")
    before = fingerprint([one, other])
    assert before == fingerprint([other, one])
    other.write_text("3")
    assert before != fingerprint([one, other])
    sources = sorted(Path(kernels.__file__).parent.glob("*.py"))
    assert kernel_fingerprint(one) == fingerprint([*sources, one]) != kernel_fingerprint()
