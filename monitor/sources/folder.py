"""Files that a logger writes into a folder, of every format that `indexer ingest` reads.

A file is complete once its size and time have not changed for `settle` seconds, and it is read once: its name, size,
time and digest go into the store together with its samples, so that neither a kill nor a restart nor a new date alone
reads it twice; where it grows all the same, as of a logger that paused for longer, what is new is used. A text that was
seen to grow and ends within a line is still being written: it must rest ten times as long. Its machine is the folder
below the watched one, or for a file that lies in it directly what stands before the first sign of _ or a digit of its
name. Its time is the one in its name (20261122T060000Z), else that of its last change less its duration. A file that
begins where the last one of its machine ended goes on with it; one that begins later, or earlier but ends later, is a
recording of its own, as of a logger that records for a minute in an hour, and what lies between them is no gap. Files
that are there at once are read in the order of their times.
"""

from __future__ import annotations

import hashlib
import re
import time
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from indexer_env.errors import IndexerError, SignalError
from indexer_records.measured import Reading, read_recording
from monitor.engine import Arrival, Engine
from monitor.intake.blocks import LARGEST_BLOCK, NANO, Block
from monitor.sources.base import Source
from monitor.sources.listing import files, within_a_line

_LOOK_S, _SHARE = 1.0, 0.1
"""Time between two looks at the folder [s], longer where many files would make looking take more than this share."""
_RETRY_S, _LONGEST_WAIT_S = 2.0, 64.0
"""First and longest time after which a file that could not be opened is looked at again; a machine's other files wait
for it until the longest one."""

_WITHIN_A_LINE = 10.0
"""Times `settle` for which a text that ends within a line must rest: its logger may have paused there, but the last
line of one that ends without a newline is to be read, too."""

_NAME = 200

_TIME = re.compile(r"(\d{8}T\d{6})(?:\.(\d{1,6}))?Z")


class FolderSource(Source):
    """Watches a folder.

    Parameters
    ----------
    folder : Path
    reading : Reading
        What the files leave open.
    pulse_column : str or None
    settle : float
        Seconds without change after which a file is complete.
    jitter : float
        By how much the time of a file that goes on with the last one may be off [s].
    turn : float
        Of the table, the shortest that can be diagnosed [s].
    """

    def __init__(
        self, folder: Path, reading: Reading, pulse_column: str | None, settle: float, jitter: float, turn: float
    ) -> None:
        super().__init__()
        # However the folder is written, it is the same one; the store has room for so many signs.
        self.name, self._former_name = f"folder:{folder.resolve()}"[-_NAME:], f"folder:{folder}"
        self._folder, self._reading, self._pulse, self._settle = folder, reading, pulse_column, settle
        self._jitter_ns, self._turn_ns = round(jitter * NANO), round(turn * NANO)
        self._seen: dict[str, tuple[str, float]] = {}
        self._growing: set[str] = set()
        self._ends: dict[str, int] = {}
        self._stretches: dict[str, tuple[int, int | None]] = {}
        self._short: dict[str, str] = {}
        self._waits: dict[str, float] = {}

    def run(self, engine: Engine) -> None:
        """As `Source.run`."""
        done, lost = engine.positions(self._former_name) | engine.positions(self.name), False
        while not self.stopping.is_set():
            begun = time.monotonic()
            try:
                complete = self._complete(done)
            except OSError as error:
                self.tell(f"the folder {self._folder} cannot be read ({error.strerror or error}); trying again")
                complete, lost = [], True
            else:
                if lost:
                    self.tell(next(reversed(self._short.values()), None))
                lost = False
            looked, held = time.monotonic() - begun, self._held()
            for path, mark in complete:
                machine = machine_of(Path(path))
                if machine in held and path not in self._waits:
                    continue
                try:
                    done[path] = self._once(engine, path, mark, done.get(path))
                except OSError as error:
                    self._later(engine, path, mark, error)
                    held.add(machine)
                else:
                    self._waits.pop(path, None)
                if self.stopping.is_set():
                    return
            self.stopping.wait(max(_LOOK_S, looked / _SHARE))

    def _complete(self, done: dict[str, str]) -> list[tuple[str, str]]:
        """Files that have rested, in the order of their times, with their marks; raises OSError where the folder is
        gone."""
        now, found, there = time.monotonic(), [], set[str]()
        self._folder.stat()
        for name, entry in files(self._folder):
            try:
                state = entry.stat()
            except OSError:
                continue
            there.add(name)
            mark = f"{state.st_size} {state.st_mtime_ns}"
            if done.get(name, "").split()[:2] == mark.split():
                continue
            known = self._seen.get(name)
            if known is None or known[0] != mark:
                self._seen[name] = (mark, now)
                if known is not None or name in done:
                    self._growing.add(name)
            elif now - known[1] >= self._rest(name):
                found.append((_moment(entry.name) or state.st_mtime_ns, name, mark))
        # of files that are gone nothing is remembered
        self._seen = {name: known for name, known in self._seen.items() if name in there}
        self._growing &= there
        return [(name, mark) for _, name, mark in sorted(found)]

    def _rest(self, name: str) -> float:
        """Seconds without change after which a file is complete."""
        unended = name in self._growing and within_a_line(self._folder / name)
        return _WITHIN_A_LINE * self._settle if unended else self._settle

    def _held(self) -> set[str]:
        """Machines of which a file could not be opened a short time ago: what came after it would make it late."""
        waiting = (name for name, wait in self._waits.items() if wait < _LONGEST_WAIT_S)
        return {machine_of(Path(name)) for name in waiting if (self._folder / name).exists()}

    def _later(self, engine: Engine, name: str, mark: str, error: OSError) -> None:
        """Look again at a file that could not be opened, ever more rarely: a share may be away for a moment."""
        wait = self._waits[name] = min(2.0 * self._waits.get(name, 0.5 * _RETRY_S), _LONGEST_WAIT_S)
        self._seen[name] = mark, time.monotonic() + wait - self._settle
        engine.broken(machine_of(Path(name)), f"{name} cannot be read ({error.strerror or error}); trying again", name)

    def _once(self, engine: Engine, name: str, mark: str, before: str | None) -> str:
        """Hand over a file that had the mark `before` when it was read last; returns its mark now, with its digest.
        Raises OSError where it cannot be opened."""
        path = self._folder / name
        with path.open("rb") as file:
            mark = f"{mark} {hashlib.file_digest(file, 'blake2s').hexdigest()}"
        if before is None or not _same(before, mark):
            grown = before is not None and int(mark.split()[0]) > int(before.split()[0])
            self._read(engine, path, name, mark, grown=grown)
        return mark

    def _read(self, engine: Engine, path: Path, name: str, mark: str, *, grown: bool = False) -> None:
        """Hand over a file; of one that has `grown` since it was read, what is new. Raises OSError where it cannot be
        opened."""
        told = name.encode("utf-8", "backslashreplace").decode()
        machine = machine_of(Path(told))
        if told != name:
            engine.broken(machine, f"the name of a file must be UTF-8, got {told}; rename it")
            return
        try:
            with path.open("rb") as file:
                file.read(1)
            blocks = self._blocks(path, machine)
            end_ns = blocks[-1].end_ns
            if grown:
                # Of what was handed over before a restart it is known how far the machine's samples were used.
                blocks = _behind(blocks, self._ends.get(name, engine.newest_ns(machine)))
                if not blocks:
                    return
            blocks = self._placed(engine, name, blocks)
        except IndexerError as error:
            told = str(error)
            engine.broken(machine, told if str(path) in told else f"{name}: {told}", name)
            return
        for place, block in enumerate(blocks):
            last = place == len(blocks) - 1
            arrival = Arrival(block, (self.name, name, mark) if last else None)
            while not engine.offer(arrival, timeout=0.5):
                if self.stopping.is_set():
                    return
        self._ends[name] = end_ns

    def _placed(self, engine: Engine, name: str, blocks: list[Block]) -> list[Block]:
        """The blocks of a file in time: whether it begins a recording, and whether that holds a turn by now."""
        machine, first, end = blocks[0].machine, blocks[0], blocks[-1].end_ns
        if machine not in self._stretches:
            # Of what came before a restart it is known where it ended.
            self._stretches[machine] = 0, engine.newest_ns(machine)
        begun, last = self._stretches[machine]
        off = 0 if last is None else first.start_ns - last
        if last is not None and off < -self._jitter_ns and end <= last:
            # It comes late and brings nothing new: one block tells that, three would look like a clock that was set.
            return blocks[-1:]
        if last is None or abs(off) > self._jitter_ns:
            begun, blocks = first.start_ns, [replace(first, begins=True), *blocks[1:]]
        self._stretches[machine] = begun, end if last is None else max(last, end)
        lasts = end - begun
        self._tell_short(machine, name, lasts / NANO, lasts < self._turn_ns - NANO / first.rate)
        return blocks

    def _tell_short(self, machine: str, name: str, lasts: float, short: bool) -> None:
        self._short.pop(machine, None)
        if short:
            self._short[machine] = (
                f"{name} must hold a turn of the table, {self._turn_ns / NANO:.4g} s at least, or begin where the last "
                f"file of {machine} ended, got {lasts:.3g} s; record for longer"
            )
        self.tell(next(reversed(self._short.values()), None))

    def _blocks(self, path: Path, machine: str) -> list[Block]:
        recording = read_recording(path, self._reading, self._pulse)
        signal = recording.signal
        start = time_of(path, signal.duration)
        pieces = []
        for first in range(0, signal.values.size, LARGEST_BLOCK):
            piece = slice(first, first + LARGEST_BLOCK)
            pulse = None if recording.pulse is None else np.asarray(recording.pulse[piece], np.float32)
            begin = start + round(first / signal.sample_rate * NANO)
            pieces.append(Block(machine, begin, signal.sample_rate, signal.unit, signal.values[piece], pulse))
        return pieces


def _same(before: str, mark: str) -> bool:
    """Whether a file is as it was by its mark: size, time and digest; earlier versions kept no digest."""
    one, other = before.split(), mark.split()
    return one[0] == other[0] and one[2:] in ([], other[2:])


def _behind(blocks: list[Block], used_ns: int | None) -> list[Block]:
    """What lies behind the samples that were used, of blocks that begin before their end."""
    if used_ns is None or not blocks[0].start_ns < used_ns < blocks[-1].end_ns:
        return blocks
    return [left for block in blocks if (left := block.behind(used_ns)) is not None]


def machine_of(name: Path) -> str:
    """The machine of a file by its name below the watched folder."""
    if len(name.parts) > 1:
        return name.parts[0]
    return re.split(r"[_\d]", name.stem)[0].strip(" -.") or "machine"


def time_of(path: Path, duration: float) -> int:
    """When the first sample of a file was taken [ns since 1970]; raises SignalError, and OSError where it is gone."""
    moment, found = _moment(path.name), _TIME.search(path.name)
    if moment is not None:
        return moment
    if found is not None:
        raise SignalError(f"the time in its name must be one, got {found[1]}")
    return path.stat().st_mtime_ns - round(duration * NANO)


def _moment(name: str) -> int | None:
    """The time in the name of a file [ns since 1970]; None where it has none, or one that is none."""
    found = _TIME.search(name)
    if found is None:
        return None
    try:
        moment = datetime.strptime(found[1], "%Y%m%dT%H%M%S").replace(tzinfo=UTC)
    except ValueError:
        return None
    return int(moment.timestamp()) * NANO + int((found[2] or "0").ljust(9, "0"))
