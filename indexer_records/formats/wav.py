"""WAV files: every track as "channel 1", "channel 2" …; samples are shares of a full scale that the file does not
know."""

from __future__ import annotations

import struct
from pathlib import Path

from indexer_records.formats.gate import damaged, library, reading
from indexer_records.formats.kind import Format
from indexer_records.formats.table import MeasuredTable, check_content, column_of

_NAME = "WAV"
_LOSSLESS = ("PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE")


def read(path: Path) -> MeasuredTable:
    """Every track; integers are scaled to ±1."""
    _check_chunks(path, path.read_bytes())
    soundfile = library("soundfile", path, _NAME)
    with reading(path, _NAME), soundfile.SoundFile(path) as file:
        if file.subtype not in _LOSSLESS:
            raise damaged(path, _NAME, f"samples must be {', '.join(_LOSSLESS)}, got {file.subtype}")
        check_content(path, 8 * file.frames * file.channels, columns=file.channels)
        samples = file.read(dtype="float64", always_2d=True)
        if samples.shape != (file.frames, file.channels):
            raise damaged(path, _NAME, f"it must have {file.frames} samples, got {len(samples)}")
        rate = float(file.samplerate)
    columns = [
        column_of(path, f"channel {index + 1}", samples[:, index].copy(), rate=rate, full_scale=True)
        for index in range(samples.shape[1])
    ]
    return MeasuredTable(path, tuple(columns))


def _check_chunks(path: Path, content: bytes) -> None:
    """Refuse a file whose chunks are not all there: the library would read what is there."""
    (stated,) = struct.unpack_from("<I", content, 4)
    if stated + 8 not in (len(content), len(content) - 1):
        raise damaged(path, _NAME, f"it must have {stated + 8} bytes, got {len(content)}")
    position, names = 12, []
    while position < len(content):
        if position + 8 > len(content):
            raise damaged(path, _NAME, "it ends within a chunk")
        name, size = struct.unpack_from("<4sI", content, position)
        names.append(name)
        if name == b"fmt " and size >= 16:
            _check_format(path, content[position + 8 : position + 24])
        position += 8 + size + size % 2
    # The last chunk may lack the byte that makes it even.
    if position - len(content) not in (0, size % 2) or names.count(b"data") != 1:
        raise damaged(path, _NAME, f"its chunks must take {position} bytes, got {len(content)}, and one hold samples")


def _check_format(path: Path, chunk: bytes) -> None:
    """Refuse a format that contradicts itself: libraries differ in which half they believe."""
    _, tracks, rate, bytes_a_second, step, bits = struct.unpack("<HHIIHH", chunk)
    if step * 8 != tracks * bits or bytes_a_second != rate * step:
        raise damaged(path, _NAME, "its rate, tracks, bits and bytes a second contradict each other")


FORMAT = Format(_NAME, (".wav",), lambda head: head.startswith(b"RIFF") and head[8:12] == b"WAVE", read)
