"""MAT files up to version 7 (MATLAB, Octave, SciPy): numeric vectors and matrices, those in structures as "s.x".

The rate is taken from a scalar whose name is one of RATE_NAMES: in the variable's own structure, else in the nearest
above it, else the one rate that the file has anywhere. Units stand in the name, if anywhere. Source of the layout: The
MathWorks, "MAT-File Format", level 5.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from indexer_records.formats.gate import damaged, library, reading
from indexer_records.formats.kind import Format
from indexer_records.formats.table import (
    LARGEST_CONTENT,
    RATE_NAMES,
    Column,
    MeasuredTable,
    check_content,
    columns_of,
    nearest_rate,
)

_NAME = "MAT"
_HEADER = 128
_ENDIAN = {b"IM": "<", b"MI": ">"}
_MATRIX, _COMPRESSED = 14, 15
_FIRST_PARTS = [6, 5, 1]
"""Types of flags, dimensions and name."""

_TYPES = frozenset((*range(1, 8), 9, 12, 13, 14, 16, 17, 18))
_NUMBER_TYPES = frozenset((*range(1, 8), 9, 12, 13))
_NUMERIC = range(6, 16)
"""Classes of a matrix of numbers."""

_COMPLEX = 0x800
_CLASS_BYTE = {"<": 0, ">": 3}
_OPAQUE = b"\x11"
"""Class of MATLAB's newer objects, tables and dates among them: without dimensions, and never read."""
_MOST_PARTS = 100_000
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
    rates = [(_group(name), float(value.item())) for name, value in named.items() if _is_rate(name, value)]
    columns: list[Column] = []
    for name, value in named.items():
        group = _group(name)
        columns += columns_of(path, name, value, rate=nearest_rate(group, rates, rates), group=group)
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
        _check_element(path, parts[-1], order)
        total += len(parts[-1])
        check_content(path, total)
        position += 8 + size
    return b"".join(parts)


def _unpacked(path: Path, data: bytes) -> bytes:
    stream = zlib.decompressobj()
    with reading(path, _NAME):
        unpacked = stream.decompress(data, LARGEST_CONTENT + 1)
    check_content(path, len(unpacked))
    if not stream.eof or stream.unused_data:
        raise damaged(path, _NAME, "a compressed element is cut short or has bytes behind it")
    return unpacked


def _check_element(path: Path, element: bytes, order: str) -> None:
    if len(element) < 8 or struct.unpack_from(order + "II", element) != (_MATRIX, len(element) - 8):
        raise damaged(path, _NAME, "an element must be one matrix")
    _check_matrix(path, element[8:], order)


def _check_matrix(path: Path, content: bytes, order: str, depth: int = _DEEPEST) -> None:
    """Refuse a matrix whose parts are not those of its class or do not fill it exactly, and what stands in it: SciPy
    follows some of their types and sizes unseen, past the end of its memory too."""
    parts = _parts(path, content, order)
    if parts and parts[0][0] == _FIRST_PARTS[0] and parts[0][1][_CLASS_BYTE[order] :][:1] == _OPAQUE:
        return
    if len(parts) < 3 or [kind for kind, _ in parts[:3]] != _FIRST_PARTS or len(parts[0][1]) != 8:
        raise damaged(path, _NAME, "a matrix must begin with its flags, dimensions and name")
    flags = struct.unpack(order + "I", parts[0][1][:4])[0]
    sizes = np.frombuffer(parts[1][1], dtype=order + "i4") if len(parts[1][1]) % 4 == 0 else np.empty(0)
    if not 2 <= len(sizes) <= 32 or sizes.min() < 0:
        raise damaged(path, _NAME, "a matrix must have 2 to 32 dimensions >= 0")
    if flags & 0xFF in _NUMERIC:
        expected = 5 if flags & _COMPLEX else 4
        if len(parts) != expected or any(kind not in _NUMBER_TYPES for kind, _ in parts[3:]):
            raise damaged(path, _NAME, f"a numeric matrix must have {expected} parts of numbers, got {len(parts)}")
    for kind, data in parts[3:]:
        if kind == _MATRIX and data:
            if not depth:
                raise damaged(path, _NAME, f"structures and cells more than {_DEEPEST} deep")
            _check_matrix(path, data, order, depth - 1)


def _parts(path: Path, content: bytes, order: str) -> list[tuple[int, bytes]]:
    parts, position = [], 0
    while position + 8 <= len(content):
        kind, size = struct.unpack_from(order + "II", content, position)
        if kind >> 16:
            # A part of up to four bytes stands within its own tag.
            kind, size = kind & 0xFFFF, kind >> 16
            begin, position = position + 4, position + 8
        else:
            begin, position = position + 8, position + 8 + size + -size % 8
        if kind not in _TYPES or begin + size > position or len(parts) == _MOST_PARTS:
            raise damaged(path, _NAME, f"part {len(parts) + 1} of a matrix must be of a known type and size")
        parts.append((kind, content[begin : begin + size]))
    if position != len(content):
        raise damaged(path, _NAME, f"the parts of a matrix must take {len(content)} bytes, got {position}")
    return parts


def _flat(owner: str, variables: Mapping[str, object], depth: int) -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        full = f"{owner}.{name}" if owner else name
        if isinstance(value, dict) and depth:
            yield from _flat(full, value, depth - 1)
        elif isinstance(value, np.ndarray | int | float | np.number):
            yield full, np.asarray(value)


def _group(name: str) -> str:
    """The structure that a variable stands in, "" for none."""
    return name.rpartition(".")[0].replace(".", "/")


def _is_rate(name: str, value: np.ndarray) -> bool:
    return name.rpartition(".")[2].lower() in RATE_NAMES and value.size == 1 and value.dtype.kind in "iuf"


def _begins(head: bytes) -> bool:
    order = _ENDIAN.get(head[126:128])
    return order is not None and struct.unpack(order + "H", head[124:126])[0] == 0x0100


FORMAT = Format(_NAME, (".mat",), _begins, read)
