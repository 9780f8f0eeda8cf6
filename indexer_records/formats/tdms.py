"""TDMS files (LabVIEW): every numeric channel, as "group/channel"; unit and sampling interval from its properties.

Source of the layout: NI, "TDMS File Format Internal Structure".
"""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from indexer_records.formats.gate import damaged, library, reading
from indexer_records.formats.kind import Format
from indexer_records.formats.table import Column, MeasuredTable, check_content, columns_of

_NAME = "TDMS"
_TAG = b"TDSm"
_LEAD_IN = 28
_NOT_CLOSED = 2**64 - 1
_BIG_ENDIAN = 1 << 6
_START = "wf_start_time"


def read(path: Path) -> MeasuredTable:
    """Every numeric channel."""
    stream = _Watched(path.read_bytes())
    segments = _segments(path, stream.getvalue())
    nptdms = library("nptdms", path, _NAME)
    columns: list[Column] = []
    with reading(path, _NAME), nptdms.TdmsFile.open(stream) as file:
        _check_metadata(path, segments, stream.ends)
        # Not public, and the one place that knows: the library would fill one channel with samples of the next.
        if any(segment.final_chunk_lengths_override is not None for segment in file._reader._segments or ()):
            raise damaged(path, _NAME, "the channels of a segment do not take the bytes that it has")
        channels = [channel for group in file.groups() for channel in group.channels()]
        check_content(path, 8 * sum(len(channel) for channel in channels), columns=len(channels))
        dated = all(isinstance(channel.properties.get(_START), np.datetime64) for channel in channels)
        for channel in channels:
            values = np.asarray(channel[:])
            if values.shape != (len(channel),):
                raise damaged(path, _NAME, f"channel {channel.name} must have {len(channel)} samples")
            stated = {"unit": _unit(channel), "rate": _rate(channel), "group": channel.group_name}
            stated["start"] = _start(channel, dated)
            columns += columns_of(path, f"{channel.group_name}/{channel.name}", values, **stated)
    return MeasuredTable(path, tuple(columns))


class _Watched(io.BytesIO):
    """A file that remembers where each piece that was read ends."""

    def __init__(self, content: bytes) -> None:
        super().__init__(content)
        self.ends: list[int] = []

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        if data:
            self.ends.append(self.tell())
        return data


def _segments(path: Path, content: bytes) -> list[tuple[int, int, int]]:
    """Where each segment begins, its samples begin and it ends [bytes]. Refuses a file that does not end where its last
    segment says: the library would read what is there."""
    segments, position = [], 0
    while position < len(content):
        lead = content[position : position + _LEAD_IN]
        if len(lead) < _LEAD_IN or not lead.startswith(_TAG):
            raise damaged(path, _NAME, f"a segment must begin at byte {position}")
        order = ">" if struct.unpack_from("<I", lead, 4)[0] & _BIG_ENDIAN else "<"
        _, following, raw = struct.unpack(order + "IQQ", lead[8:])
        if following == _NOT_CLOSED:
            raise damaged(path, _NAME, "the program that wrote it did not close it")
        if raw > following:
            raise damaged(path, _NAME, f"the segment at byte {position} contradicts itself")
        begin, position = position, position + _LEAD_IN + following
        segments.append((begin, begin + _LEAD_IN + raw, position))
    if position != len(content):
        raise damaged(path, _NAME, f"it must have {position} bytes, got {len(content)}")
    return segments


def _check_metadata(path: Path, segments: Sequence[tuple[int, int, int]], ends: Sequence[int]) -> None:
    """Refuse a segment whose names and properties do not end where its samples begin: the library does not ask."""
    for begin, samples, end in segments:
        reached = max((place for place in ends if begin < place <= end), default=begin)
        # A segment without metadata of its own is not read beyond its first bytes.
        if (reached > begin + _LEAD_IN and reached != samples) or samples < begin + _LEAD_IN:
            raise damaged(
                path, _NAME, f"the metadata of the segment at byte {begin} must end at {samples}, got {reached}"
            )


def _unit(channel: Any) -> str | None:
    return str(channel.properties.get("unit_string") or "") or None


def _rate(channel: Any) -> float | None:
    # LabVIEW writes 1 s where nobody gave the interval.
    step = channel.properties.get("wf_increment")
    return 1.0 / float(step) if step and float(step) != 1.0 else None


def _start(channel: Any, dated: bool) -> float:
    """When the first sample was taken [s], since 1970 where all channels have a date."""
    date = channel.properties[_START].astype("datetime64[ns]").astype(np.int64) * 1e-9 if dated else 0.0
    return float(date) + float(channel.properties.get("wf_start_offset") or 0.0)


FORMAT = Format(_NAME, (".tdms",), lambda head: head.startswith(_TAG), read)
