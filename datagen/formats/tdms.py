"""TDMS files (LabVIEW): every numeric channel, as "group/channel"; unit and sampling interval from its properties.

Source of the layout: NI, "TDMS File Format Internal Structure".
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from datagen.formats.gate import damaged, library, reading
from datagen.formats.kind import Format
from datagen.formats.table import Column, MeasuredTable, check_content, columns_of

_NAME = "TDMS"
_TAG = b"TDSm"
_LEAD_IN = 28
_NOT_CLOSED = 2**64 - 1
_BIG_ENDIAN = 1 << 6


def read(path: Path) -> MeasuredTable:
    """Every numeric channel."""
    _check_segments(path, path.read_bytes())
    nptdms = library("nptdms", path, _NAME)
    columns: list[Column] = []
    with reading(path, _NAME), nptdms.TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        check_content(path, 8 * sum(len(channel) for channel in channels), columns=len(channels))
        for channel in channels:
            values = np.asarray(channel[:])
            if values.shape != (len(channel),):
                raise damaged(path, _NAME, f"channel {channel.name} must have {len(channel)} samples")
            stated = {"unit": _unit(channel), "rate": _rate(channel)}
            columns += columns_of(path, f"{channel.group_name}/{channel.name}", values, **stated)
    return MeasuredTable(path, tuple(columns))


def _check_segments(path: Path, content: bytes) -> None:
    """Refuse a file that does not end where its last segment says: the library would read what is there."""
    position = 0
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
        position += _LEAD_IN + following
    if position != len(content):
        raise damaged(path, _NAME, f"it must have {position} bytes, got {len(content)}")


def _unit(channel: Any) -> str | None:
    return str(channel.properties.get("unit_string") or "") or None


def _rate(channel: Any) -> float | None:
    step = channel.properties.get("wf_increment")
    return 1.0 / float(step) if step else None


FORMAT = Format(_NAME, (".tdms",), lambda head: head.startswith(_TAG), read)
