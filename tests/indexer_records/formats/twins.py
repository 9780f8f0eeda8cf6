"""Every format parsed a second time, by other code than the project's readers use: slow, obvious and strict.

`twin(kind, path)` gives the channels of a file as {name: (float64 values, rate in Hz or None)}, or raises anything. Own
parsers read what samples.py writes and no more; the others are libraries that share no code with ours: duckdb for
Parquet, pyfive for HDF5, scipy.io.wavfile for WAV.
"""

from __future__ import annotations

import io
import re
import struct
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path

import duckdb
import numpy as np
import pyfive
import scipy.io.wavfile

Channels = dict[str, tuple[np.ndarray, float | None]]
_FACTORS = {"m/s^2": 1.0, "m/s2": 1.0, "mm/s^2": 1e-3, "g": 9.80665, "mg": 9.80665e-3}


def twin(kind: str, path: Path) -> Channels:
    """The channels of a file of one of the kinds of samples.py; a channel "time [s]" may stand for the rate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return _TWINS[kind](path)


def _csv(path: Path) -> Channels:
    raw = path.read_bytes()
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    lines = re.split("\r\n|\r|\n", text)
    start = next(k for k, line in enumerate(lines) if re.match(r"\s*[\d.]+[\d.eE+-]*\s*,\s*[-+.\d]", line))
    titles = [title.strip().strip('"') for title in lines[start - 1].split(",")]
    rows = [[cell.strip().strip('"') for cell in line.split(",")] for line in lines[start:]]
    while rows and rows[-1] == [""]:
        rows.pop()
    assert {len(row) for row in rows} == {len(titles)}
    channels: Channels = {}
    for index, title in enumerate(titles):
        try:
            channels[title] = (np.array([float(row[index]) for row in rows]), None)
        except ValueError:
            continue
    return channels


def _parquet(path: Path) -> Channels:
    with duckdb.connect() as connection:
        found = connection.execute("SELECT * FROM read_parquet(?)", [str(path)]).fetchnumpy()
    return {name: (np.asarray(values, dtype=np.float64), None) for name, values in found.items()}


_MAT_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}


def _mat(path: Path) -> Channels:
    content = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}[content[126:128]]
    found: Channels = {}
    for kind, data in _elements(content[128:], order, padded=False):
        if kind == 15:
            ((kind, data),) = _elements(zlib.decompress(data), order, padded=False)
        assert kind == 14
        parts = list(_elements(data, order, padded=True))
        (_, flags), (_, shape), (_, name) = parts[:3]
        if flags[0 if order == "<" else 3] not in (6, 7):
            continue
        values = np.frombuffer(parts[3][1], dtype=order + _MAT_NUMBERS[parts[3][0]]).astype(np.float64)
        assert values.size == np.prod(np.frombuffer(shape, dtype=order + "i4"))
        found[name.decode("latin-1").rstrip("\0")] = (values, None)
    rates = [values for name, (values, _) in found.items() if name.lower() == "fs" and values.size == 1]
    rate = float(rates[0][0]) if rates else None
    return {name: (values, rate) for name, (values, _) in found.items()}


def _elements(data: bytes, order: str, padded: bool) -> Iterator[tuple[int, bytes]]:
    position = 0
    while position < len(data):
        kind, size = struct.unpack_from(order + "II", data, position)
        if kind >> 16:
            kind, size, begin, end = kind & 0xFFFF, kind >> 16, position + 4, position + 8
            assert size <= 4
        else:
            begin = position + 8
            end = begin + size + (-size % 8 if padded else 0)
        assert end <= len(data)
        yield kind, data[begin : begin + size]
        position = end


def _hdf5(path: Path) -> Channels:
    channels: Channels = {}
    rates: list[float] = []

    def visit(group: pyfive.Group, inherited: float | None) -> None:
        own = _number(group.attrs, inherited)
        for name in group:
            item = group[name]
            if isinstance(item, pyfive.Group):
                visit(item, own)
            elif item.dtype.kind in "iuf":
                values = np.asarray(item[()], dtype=np.float64).reshape(-1)
                if name.lower() == "fs":
                    rates.append(float(values[0]))
                channels[item.name.lstrip("/")] = (values, _number(item.attrs, own))

    with pyfive.File(io.BytesIO(_without_user_block(path.read_bytes()))) as file:
        visit(file, None)
    rate = rates[0] if rates else None
    return {name: (values, own or rate) for name, (values, own) in channels.items()}


def _without_user_block(content: bytes) -> bytes:
    """pyfive takes addresses from the start of the file: the block before the signature goes, and with it the base
    address of the superblock."""
    size = content.index(b"\x89HDF")
    base = struct.unpack_from("<Q", content, size + 24)[0]
    assert base == size
    return content[size : size + 24] + struct.pack("<Q", 0) + content[size + 32 :]


def _number(attributes: dict, otherwise: float | None) -> float | None:
    found = [value for name, value in attributes.items() if name.lower() == "sample_rate"]
    return float(np.asarray(found[0]).reshape(-1)[0]) if found else otherwise


_TDMS_NUMBERS = {
    kind: np.dtype(f"<{name}")
    for kind, name in enumerate(["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"], start=1)
}


def _tdms(path: Path) -> Channels:
    """One segment of plain float64 channels, one after the other."""
    data = path.read_bytes()
    tag, toc, _, following, raw = struct.unpack_from("<4sIIQQ", data)
    assert tag == b"TDSm" and toc & 0b1010 == 0b1010 and not toc & 0b11100000
    assert following + 28 == len(data)
    (count,), position = struct.unpack_from("<I", data, 28), 32
    wanted: list[tuple[str, np.dtype, int, dict[str, object]]] = []
    for _ in range(count):
        name, position = _text(data, position)
        (index,), position = struct.unpack_from("<I", data, position), position + 4
        size, dtype = None, np.dtype("<f8")
        if index != 0xFFFFFFFF:
            # Between them stands a dimension that is 1 in every version of the format and asked by nobody.
            kind, size = struct.unpack_from("<I4xQ", data, position)
            dtype = _TDMS_NUMBERS[kind]
            position += 16
        properties, position = _properties(data, position)
        if size is not None:
            wanted.append((name, dtype, size, properties))
    assert position == 28 + raw
    step = sum(size * dtype.itemsize for _, dtype, size, _ in wanted)
    chunks, rest = divmod(len(data) - position, step)
    assert rest == 0
    channels: Channels = {}
    for name, dtype, size, properties in wanted:
        values = [np.frombuffer(data, dtype, size, position + chunk * step) for chunk in range(chunks)]
        position += dtype.itemsize * size
        interval = properties.get("wf_increment")
        assert isinstance(interval, float | None)
        parts = re.findall(r"/'((?:[^']|'')*)'", name)
        channels["/".join(parts).replace("''", "'")] = (
            np.concatenate(values).astype(np.float64),
            1.0 / interval if interval else None,
        )
    return channels


def _text(data: bytes, position: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", data, position)
    assert position + 4 + size <= len(data)
    return data[position + 4 : position + 4 + size].decode("utf-8", errors="replace"), position + 4 + size


def _properties(data: bytes, position: int) -> tuple[dict[str, object], int]:
    (count,), position = struct.unpack_from("<I", data, position), position + 4
    found: dict[str, object] = {}
    for _ in range(count):
        name, position = _text(data, position)
        (kind,), position = struct.unpack_from("<I", data, position), position + 4
        if kind == 0x20:
            found[name], position = _text(data, position)
        else:
            dtype = _TDMS_NUMBERS[kind]
            found[name], position = float(np.frombuffer(data, dtype, 1, position)[0]), position + dtype.itemsize
    return found, position


def _uff(path: Path) -> Channels:
    """Sets 58 and 58b of real, even, double precision time histories."""
    data = path.read_bytes()
    channels: Channels = {}
    position = 0
    while position < len(data.rstrip()):
        lines, begin = [], position
        for _ in range(13):
            end = data.index(b"\n", begin)
            lines.append(data[begin:end].decode("utf-8", errors="replace").rstrip("\r"))
            begin = end + 1
        assert lines[0].rstrip() == "    -1" and lines[1][:6] == "    58"
        form, number, spacing = (int(lines[8][k : k + 10]) for k in (0, 10, 20))
        assert int(lines[7][:5]) == 1 and form == 4 and spacing == 1
        if lines[1][6:7].lower() == "b":
            order = {"1": "<", "2": ">"}[lines[1][7:13].strip()]
            values = np.frombuffer(data, f"{order}f8", number, begin).astype(np.float64)
            position = begin + 8 * number
        else:
            stop = data.index(b"\n    -1", begin - 1)
            rows = data[begin:stop].decode("latin-1").split("\n")
            values = np.array([float(row[k : k + 20]) for row in rows for k in range(0, len(row) // 20 * 20, 20)])
            position = stop
        assert len(values) == number
        closing = re.match(rb"\n?    -1[ ]*\r?(\n|$)", data[position:])
        assert closing is not None
        position += closing.end()
        name = lines[2].strip()
        channels[name if name != "NONE" and name else "history"] = (values, 1.0 / float(lines[8][43:56]))
    return channels


def _wav(path: Path) -> Channels:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "Chunk .non-data. not understood")
        rate, samples = scipy.io.wavfile.read(path)
    samples = samples.reshape(len(samples), -1)
    whole = {"u": 128.0, "i": 2.0 ** (8 * samples.dtype.itemsize - 1), "f": 1.0}[samples.dtype.kind]
    numbers = (samples.astype(np.float64) - (128.0 if samples.dtype.kind == "u" else 0.0)) / whole
    return {f"channel {k + 1}": (numbers[:, k], float(rate)) for k in range(numbers.shape[1])}


def unit_factor(unit: str) -> float:
    """m/s² in one of a linear acceleration unit as the twins' files write it."""
    return _FACTORS[unit.strip().lower().replace(" ", "").replace("²", "^2").replace("**2", "^2")]


_TWINS = {
    "csv": _csv,
    "parquet": _parquet,
    "mat": _mat,
    "mat_plain": _mat,
    "mat73": _hdf5,
    "hdf5": _hdf5,
    "tdms": _tdms,
    "uff": _uff,
    "uff_binary": _uff,
    "wav": _wav,
}
