"""Broken files by the thousand: each must be refused in one sentence or give the very record that a second parser, of
other code, finds in the same bytes.

`python -m tests.indexer_records.formats.fuzz 100000 2` breaks 100 000 files in two processes and prints the
counts; seeds are the numbers of the files, so that every finding can be had again.
"""

from __future__ import annotations

import collections
import multiprocessing
import struct
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from indexer_env.errors import SignalError
from indexer_records.formats import read_table
from indexer_records.measured import Reading, Recording, read_recording
from tests.indexer_records.formats.samples import FULL_SCALE, OPTIONS, WRITERS, written
from tests.indexer_records.formats.twins import twin, unit_factor

RATE = 2000.0
SAMPLES = 120
TIME_LIMIT = 50.0
"""Seconds a broken file may take; the whole file takes milliseconds."""

KINDS = tuple(WRITERS)
CRASHED = "refused after a crash or hang"
RIGHT = ("refused", CRASHED, "agrees", "harmless", "unchanged")
"""Outcomes that are as they must be."""


@dataclass(frozen=True)
class Verdict:
    """What came of one broken file, with the words that tell more.

    Right: "refused"; "agrees", the second parser finds the same record; "harmless", the record is the one of the file
    before it was broken; "unchanged", nothing was broken. Wrong: "wrong", the two parsers disagree; "unconfirmed", the
    second parser refuses what ours reads otherwise than before; "no sentence", "traceback", "slow".
    """

    seed: int
    kind: str
    outcome: str
    words: str = ""


class Fuzzer:
    """Files of every kind in a folder, to be broken over and over."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        rng = np.random.default_rng(7)
        values = np.round(rng.normal(scale=3.0, size=SAMPLES), 6)
        pulse = np.where(np.arange(SAMPLES) % 40 < 4, 5.0, 0.0)
        self.paths, self.contents, self.records = {}, {}, {}
        for kind in KINDS:
            place = folder / kind
            place.mkdir()
            self.paths[kind] = written(kind, place, values, pulse, RATE)
            self.contents[kind] = self.paths[kind].read_bytes()
            self.records[kind] = self._read(kind).signal

    def _read(self, kind: str) -> Recording:
        return read_recording(self.paths[kind], Reading(**OPTIONS.get(kind, {})))  # type: ignore[arg-type]

    def judge(self, seed: int) -> Verdict:
        """Break the file of this number and read it."""
        kind = KINDS[seed % len(KINDS)]
        path = self.paths[kind]
        content = broken(self.contents[kind], np.random.default_rng(seed))
        if content == self.contents[kind]:
            return Verdict(seed, kind, "unchanged")
        path.write_bytes(content)
        begin = time.perf_counter()
        try:
            recording = self._read(kind)
        except SignalError as error:
            text = str(error)
            good = "\n" not in text and text.endswith(".") and str(path) in text and text.isprintable()
            if "crashed" in text or ("within" in text and "file; export" in text):
                return Verdict(seed, kind, CRASHED, text)
            return Verdict(seed, kind, "refused" if good else "no sentence", text)
        except Exception:
            return Verdict(seed, kind, "traceback", traceback.format_exc())
        if time.perf_counter() - begin > TIME_LIMIT:
            return Verdict(seed, kind, "slow")
        if recording.signal == self.records[kind]:
            return Verdict(seed, kind, "harmless")
        return self._compared(seed, kind, path, recording)

    def _compared(self, seed: int, kind: str, path: Path, recording: Recording) -> Verdict:
        signal, channel = recording.signal, recording.channels[0]
        try:
            channels = twin(kind, path)
        except Exception:
            return Verdict(seed, kind, "unconfirmed", "".join(traceback.format_exc(limit=-1)))
        columns = read_table(path).columns
        place = [column.name for column in columns].index(channel)
        named = [name for name in channels if channel in (name.strip(), name.split(" [")[0])]
        # A broken name may be spelled in two ways: then its place in the file tells the channel.
        name = named[0] if named else list(channels)[place]
        (values, rate), column = channels[name], columns[place]
        if not np.array_equal(values, column.numbers()):
            return Verdict(seed, kind, "wrong", f"values of {channel!r}")
        factor = FULL_SCALE if kind == "wav" else 1.0
        if not np.array_equal(signal.values, values * factor * unit_factor(column.unit or "m/s^2")):
            return Verdict(seed, kind, "wrong", "scaled values")
        if rate is None:
            time_name = next(name for name in channels if name.lower().startswith("t"))
            rate = (len(values) - 1) / np.ptp(channels[time_name][0]) * (1e3 if "ms" in time_name else 1.0)
        if abs(signal.sample_rate - rate) > 1e-6 * rate:
            return Verdict(seed, kind, "wrong", f"rate {signal.sample_rate} for {rate}")
        return Verdict(seed, kind, "agrees")


def broken(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with one to three things broken in it; early bytes, where headers stand, as often as all others."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        if not data:
            break
        _BREAKS[int(rng.integers(len(_BREAKS)))](data, rng)
    return bytes(data)


def _place(data: bytearray, rng: np.random.Generator) -> int:
    end = min(len(data), 600) if rng.random() < 0.5 else len(data)
    return int(rng.integers(end))


def _flip(data: bytearray, rng: np.random.Generator) -> None:
    data[_place(data, rng)] ^= 1 << int(rng.integers(8))


def _byte(data: bytearray, rng: np.random.Generator) -> None:
    data[_place(data, rng)] = int(
        rng.choice([0, 1, 10, 13, 32, 34, 44, 45, 46, 59, 127, 128, 255, int(rng.integers(256))])
    )


def _number(data: bytearray, rng: np.random.Generator) -> None:
    """A whole number of 2, 4 or 8 bytes made absurd: sizes, counts, offsets."""
    form = str(rng.choice(["<H", "<I", "<Q", ">I"]))
    top = 2 ** (8 * struct.calcsize(form))
    value = int(rng.choice([0, 1, 2, 3])) if rng.random() < 0.3 else top - 1 - int(rng.integers(3))
    value = top // 2 - int(rng.integers(2)) if rng.random() < 0.3 else value
    place = _place(data, rng)
    data[place : place + struct.calcsize(form)] = struct.pack(form, value)


def _cut(data: bytearray, rng: np.random.Generator) -> None:
    del data[_place(data, rng) :]


def _remove(data: bytearray, rng: np.random.Generator) -> None:
    place = _place(data, rng)
    del data[place : place + int(rng.integers(1, 64))]


def _insert(data: bytearray, rng: np.random.Generator) -> None:
    place = _place(data, rng)
    data[place:place] = rng.bytes(int(rng.integers(1, 32)))


def _repeat(data: bytearray, rng: np.random.Generator) -> None:
    place = _place(data, rng)
    piece = bytes(data[place : place + int(rng.integers(1, 256))])
    data[place:place] = piece * int(rng.integers(1, 4))


def _swap(data: bytearray, rng: np.random.Generator) -> None:
    """Two pieces of equal length exchanged: header fields among them."""
    size = int(rng.choice([1, 2, 4, 8, 16]))
    one, two = sorted((_place(data, rng), _place(data, rng)))
    if one + size <= two and two + size <= len(data):
        data[one : one + size], data[two : two + size] = data[two : two + size], data[one : one + size]


def _append(data: bytearray, rng: np.random.Generator) -> None:
    data += rng.bytes(int(rng.integers(1, 64)))


_BREAKS = (_flip, _flip, _byte, _number, _number, _cut, _remove, _insert, _repeat, _swap, _append)


def run(seeds: range) -> list[Verdict]:
    """Judge the files of these numbers in this process."""
    with tempfile.TemporaryDirectory() as folder:
        fuzzer = Fuzzer(Path(folder))
        return [fuzzer.judge(seed) for seed in seeds]


def run_many(count: int, processes: int, first: int = 0) -> list[Verdict]:
    """Judge `count` files, shared by processes."""
    batches = [range(start, min(start + 500, first + count)) for start in range(first, first + count, 500)]
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        return [verdict for verdicts in pool.imap_unordered(run, batches) for verdict in verdicts]


def main() -> None:
    """Print counts by kind and outcome, and one example of everything that is not as it must be."""
    count, processes, first = (int(argument) for argument in (*sys.argv[1:], "0")[:3])
    begin = time.perf_counter()
    verdicts = run_many(count, processes, first)
    print(f"{len(verdicts)} files in {time.perf_counter() - begin:.0f} s")
    for (kind, outcome), number in sorted(collections.Counter((v.kind, v.outcome) for v in verdicts).items()):
        print(f"{kind:12} {outcome:30} {number}")
    shown: collections.Counter[tuple[str, str]] = collections.Counter()
    for verdict in verdicts:
        key = (verdict.kind, verdict.outcome)
        if verdict.outcome not in RIGHT and shown[key] < 4:
            shown[key] += 1
            print(verdict.seed, verdict.kind, verdict.outcome, verdict.words)


if __name__ == "__main__":
    main()
