"""The process in which foreign libraries read files: one that hangs, takes all memory or crashes costs the file, not
the job.

One worker serves this process, a file at a time, and is started anew where one had to be ended. Questions and answers
are pickles, each behind its length, over the worker's standard input and output.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import resource
import select
import struct
import subprocess
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import BinaryIO

from indexer_env.errors import SignalError
from indexer_records.formats.table import LARGEST_CONTENT, MeasuredTable

TIME_LIMIT = 60.0
"""Seconds that a file may take to be read: 1 GiB of samples takes less than ten."""

MEMORY_LIMIT = 6 * LARGEST_CONTENT
"""Bytes of address space of the worker: the samples as stored, as float64 and on their way, and the libraries."""

_LENGTH = struct.Struct("<Q")


class _Stuck(Exception):
    """No answer in time."""


class CrashError(SignalError):
    """The worker ended while it read a file."""


class Worker:
    """A process that reads files with `indexer_records.formats`; not to be used by two threads at once."""

    def __init__(self, time_limit: float = TIME_LIMIT) -> None:
        """Start the process; raises SignalError where it does not start."""
        self.time_limit = time_limit
        code = f"import sys; sys.path[:] = {sys.path!r}; from indexer_records.formats.worker import serve; serve()"
        # One thread: the worker's address space is limited, and each thread of a linear algebra library takes a share.
        single = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | single,
            # Ctrl-C ends the job, which then closes its worker.
            start_new_session=True,
        )
        try:
            self._answer(started=True)
        except (EOFError, _Stuck):
            self.close()
            raise SignalError(
                "The process that reads measured files did not start; give it more memory (ulimit -v), or export the "
                "measurement as CSV."
            ) from None

    def read(self, path: Path, kind: str) -> MeasuredTable:
        """Read a file as a format by its name.

        Raises
        ------
        SignalError
            What the reader says; no answer in time; as CrashError, the library crashed. The worker is of no use after
            the last two.
        """
        assert self._process.stdin is not None
        try:
            # This process may have changed its folder since the worker began in it.
            folder = None if path.is_absolute() else os.getcwd()
            _send(self._process.stdin, (str(path), kind, folder))
            answer = self._answer()
        except (EOFError, BrokenPipeError):
            self.close()
            raise CrashError(
                f"{path} cannot be read: the {kind} library crashed over it; export the measurement again."
            ) from None
        except _Stuck:
            self.close()
            raise SignalError(
                f"{path} cannot be read within {self.time_limit:g} s as a {kind} file; export the measurement again."
            ) from None
        if isinstance(answer, SignalError):
            raise answer
        if isinstance(answer, str):
            raise RuntimeError(f"reading {path} failed:\n{answer}")
        assert isinstance(answer, MeasuredTable)
        return answer

    @property
    def alive(self) -> bool:
        """Whether it can be asked again."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            # What was never sent cannot be flushed to a process that is gone.
            with contextlib.suppress(BrokenPipeError):
                assert stream is not None
                stream.close()

    def _answer(self, started: bool = False) -> object:
        assert self._process.stdout is not None
        deadline = time.monotonic() + (TIME_LIMIT if started else self.time_limit)
        descriptor = self._process.stdout.fileno()
        (length,) = _LENGTH.unpack(_receive(descriptor, _LENGTH.size, deadline))
        return pickle.loads(_receive(descriptor, length, deadline))


_shared: Worker | None = None
_lock = threading.Lock()


def read_apart(path: Path, kind: str) -> MeasuredTable:
    """Read a file in the worker of this process, which is started where there is none; raises SignalError.

    A worker that crashes may do so over what an earlier file has left behind, so only one that has read nothing else
    tells against the file.
    """
    global _shared
    with _lock:
        if _shared is not None and _shared.alive:
            try:
                return _shared.read(path, kind)
            except CrashError:
                pass
        if _shared is not None:
            _shared.close()
        _shared = Worker()
        atexit.register(_shared.close)
        return _shared.read(path, kind)


def serve() -> None:
    """The worker's own side: answer files with tables or errors until the input ends."""
    from indexer_records.formats import FORMATS

    # Libraries print; what they print must not stand between the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    _limit(resource.RLIMIT_AS, MEMORY_LIMIT)
    _limit(resource.RLIMIT_CORE, 0)
    _send(answers, "ready")
    while question := _question(sys.stdin.buffer):
        path, kind, folder = question
        answer: object
        try:
            if folder is not None:
                os.chdir(folder)
            answer = FORMATS[kind].table(Path(path))
        except SignalError as error:
            answer = error
        except Exception:
            # A defect of the project itself: told in full on the other side, where it is raised.
            answer = traceback.format_exc()
        _send(answers, answer)


def _limit(kind: int, most: int) -> None:
    """Lower a limit of this process, where the system lets it be set; a lower one that it has already stays."""
    hard = resource.getrlimit(kind)[1]
    least = most if hard == resource.RLIM_INFINITY else min(most, hard)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(kind, (least, least))


def _question(stream: BinaryIO) -> tuple[str, str, str | None] | None:
    head = stream.read(_LENGTH.size)
    return pickle.loads(stream.read(_LENGTH.unpack(head)[0])) if len(head) == _LENGTH.size else None


def _send(stream: object, content: object) -> None:
    data = pickle.dumps(content, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(_LENGTH.pack(len(data)) + data)  # type: ignore[attr-defined]
    stream.flush()  # type: ignore[attr-defined]


def _receive(descriptor: int, length: int, deadline: float) -> bytes:
    parts, missing = [], length
    while missing:
        left = deadline - time.monotonic()
        if left <= 0.0 or not select.select([descriptor], [], [], left)[0]:
            raise _Stuck
        part = os.read(descriptor, min(missing, 2**20))
        if not part:
            raise EOFError
        parts.append(part)
        missing -= len(part)
    return b"".join(parts)
