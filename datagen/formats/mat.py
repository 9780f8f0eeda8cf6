"""MAT files up to version 7 (MATLAB, Octave, SciPy): numeric vectors and matrices, those in structures as "s.x".

The rate is taken from a scalar whose name is one of RATE_NAMES; units stand in the name, if anywhere. Source of the
layout: The MathWorks, "MAT-File Format", level 5.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from datagen.formats.gate import damaged, library, reading
from datagen.formats.kind import Format
from datagen.formats.table import RATE_NAMES, Column, MeasuredTable, check_content, columns_of

_NAME = "MAT"
_HEADER = 128
_ENDIAN = {b"IM": "<", b"MI": ">"}
_MATRIX, _COMPRESSED = 14, 15
_DEEPEST = 8
"""Structures within structures."""


def read(path: Path) -> MeasuredTable:
    """Every numeric variable that is no scalar."""
    plain = _uncompressed(path, path.read_bytes())
    scipy_io = library("scipy.io", path, _NAME)
    with reading(path, _NAME):
        variables = scipy_io.loadmat(io.BytesIO(plain), simplify_cells=True)
    variables = {name: value for name, value in variables.items() if not name.startswith("__")}
    named = dict(_flat("", variables, _DEEPEST))
    rate = next((float(value) for name, value in named.items() if _is_rate(name, value)), None)
    columns: list[Column] = []
    for name, value in named.items():
        columns += columns_of(path, name, value, rate=rate)
    return MeasuredTable(path, tuple(columns))


def _uncompressed(path: Path, content: bytes) -> bytes:
    """The file with its compressed elements unpacked: each is then known to be whole (its checksum is verified,
    which SciPy leaves out) and of a bearable size."""
    order = _ENDIAN[content[126:128]]
    parts, position, total = [content[:_HEADER]], _HEADER, 0
    while position < len(content):
        if position + 8 > len(content):
            raise damaged(path, _NAME, "it ends within an element")
        kind, size = struct.unpack_from(order + "II", content, position)
        data = content[position + 8 : position + 8 + size]
        if len(data) != size:
            raise damaged(path, _NAME, f"an element must have {size} bytes, got {len(data)}")
        if kind not in (_MATRIX, _COMPRESSED):
            raise damaged(path, _NAME, f"an element must be a matrix, got type {kind}")
        parts.append(_unpacked(path, data) if kind == _COMPRESSED else content[position : position + 8 + size])
        total += len(parts[-1])
        check_content(path, total)
        position += 8 + size
    return b"".join(parts)


def _unpacked(path: Path, data: bytes) -> bytes:
    stream = zlib.decompressobj()
    with reading(path, _NAME):
        unpacked = stream.decompress(data, 2**30 + 1)
    check_content(path, len(unpacked))
    if not stream.eof or stream.unused_data:
        raise damaged(path, _NAME, "a compressed element is cut short or has bytes behind it")
    return unpacked


def _flat(owner: str, variables: Mapping[str, object], depth: int) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        full = f"{owner}.{name}" if owner else name
        if isinstance(value, dict) and depth:
            yield from _flat(full, value, depth - 1)
        elif isinstance(value, np.ndarray | int | float | np.number):
            yield full, np.asarray(value)


def _is_rate(name: str, value: np.ndarray) -> bool:
    return name.rpartition(".")[2].lower() in RATE_NAMES and value.size == 1 and value.dtype.kind in "iuf"


def _begins(head: bytes) -> bool:
    order = _ENDIAN.get(head[126:128])
    return order is not None and struct.unpack(order + "H", head[124:126])[0] == 0x0100


FORMAT = Format(_NAME, (".mat",), _begins, read)
