"""HDF5 files and, with them, MAT 7.3: every numeric data set of one or two dimensions, as "group/name".

The unit is an attribute (UNIT_NAMES) of the data set. The rate is one (RATE_NAMES) of the data set or of a group above
it, or a scalar data set of such a name; the nearest counts, and else the one rate that such scalars state anywhere.
Packed samples are unpacked by the attributes scale_factor and add_offset (CF conventions of NetCDF, 8.1).
Links to other files are not followed.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np

from indexer_env.errors import SignalError
from indexer_records.formats.gate import damaged, library, reading
from indexer_records.formats.kind import Format
from indexer_records.formats.table import (
    RATE_NAMES,
    UNIT_NAMES,
    Column,
    MeasuredTable,
    check_content,
    columns_of,
    nearest_rate,
)

_NAME = "HDF5"
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_MATLAB_INTERNAL = ("#refs#", "#subsystem#")
_MOST_OBJECTS = 10_000


def read(path: Path) -> MeasuredTable:
    """Every numeric data set that is no scalar."""
    h5py = library("h5py", path, _NAME)
    columns: list[Column] = []
    total = 0
    with reading(path, _NAME), h5py.File(path, "r") as file:
        found = _data_sets(path, file, h5py)
        scalars = [(_group(item), _scalar(path, item, h5py)) for item in found if _is_rate(item)]
        for item in filter(_is_samples, found):
            total += item.size * item.dtype.itemsize
            check_content(path, total)
            _check_written(path, item, h5py)
            unit = str(_attribute(item, UNIT_NAMES) or "") or None
            stated = {"unit": unit, "rate": _rate_of(path, item, scalars), "group": _group(item)}
            columns += columns_of(path, item.name.lstrip("/"), _unpacked(path, item), **stated)
    return MeasuredTable(path, tuple(columns))


def _data_sets(path: Path, file: Any, h5py: Any) -> list[Any]:
    """All data sets but MATLAB's internal ones; refuses names and rates that are not what they must be."""
    found: list[Any] = []
    names = [""]
    file.visit(names.append)
    if len(names) > _MOST_OBJECTS:
        raise damaged(path, _NAME, f"more than {_MOST_OBJECTS} objects")
    for name in names:
        item = file[name] if name else file
        if not all(isinstance(text, str) for text in (name, *item.attrs)):
            raise damaged(path, _NAME, "a name is no text")
        if any(not _is_plain(item, rate, h5py) for rate in item.attrs if rate.lower() in RATE_NAMES):
            raise damaged(path, _NAME, f"the rate of {item.name} must be a plain number of the IEEE")
        if isinstance(item, h5py.Dataset) and name.split("/")[0] not in _MATLAB_INTERNAL:
            found.append(item)
    return found


def _is_samples(item: Any) -> bool:
    # MATLAB keeps texts as numbers of their letters, and of an empty matrix the sizes.
    numbers = _attribute(item, ("matlab_class",)) != "char" and not _attribute(item, ("matlab_empty",))
    return numbers and item.dtype.kind in "iuf" and len(item.shape or ()) in (1, 2) and item.size > 1


def _is_plain(item: Any, attribute: str, h5py: Any) -> bool:
    stored = item.attrs.get_id(attribute)
    if stored.dtype.kind in "OSU":
        return True  # a text, whose number is read where it counts
    return stored.dtype.kind in "iuf" and stored.get_type() == h5py.h5t.py_create(stored.dtype)


def _check_written(path: Path, item: Any, h5py: Any) -> None:
    """Refuse samples that stand in other files, nowhere or in fewer bytes than they need: the library would give zeros
    or whatever bytes are there."""
    if item.external or item.is_virtual:
        raise damaged(path, _NAME, f"the samples of {item.name} stand in other files")
    if item.id.get_type() != h5py.h5t.py_create(item.dtype):
        raise damaged(path, _NAME, f"the samples of {item.name} must be plain numbers of the IEEE")
    needed, written = item.size, True
    if item.chunks is not None:
        steps = [range(0, size, chunk) for size, chunk in zip(item.shape, item.chunks, strict=True)]
        places = math.prod(map(len, steps))
        needed = places * math.prod(item.chunks)
        written = item.id.get_num_chunks() == places
        # Looked up as the samples will be: a piece that is listed may still not be found, and raises here.
        for place in itertools.product(*steps) if written else ():
            item.id.read_direct_chunk(place)
    filtered = item.id.get_create_plist().get_nfilters() > 0
    if not written or (not filtered and item.id.get_storage_size() != needed * item.dtype.itemsize):
        raise damaged(path, _NAME, f"not all samples of {item.name} were written")


def _is_rate(item: Any) -> bool:
    return item.name.rpartition("/")[2].lower() in RATE_NAMES and item.size == 1 and item.dtype.kind in "iuf"


def _rate_of(path: Path, item: Any, scalars: list[tuple[str, float]]) -> float | None:
    """The rate of a data set: its own, else the nearest of groups' attributes and scalars."""
    if own := _number(path, item, RATE_NAMES):
        return own
    stated, group = list(scalars), item
    while group.name != "/":
        group = group.parent
        if rate := _number(path, group, RATE_NAMES):
            stated.append((group.name.lstrip("/"), rate))
    return nearest_rate(_group(item), stated, scalars)


def _group(item: Any) -> str:
    """The group that a data set stands in, "" for the root."""
    return item.name.rpartition("/")[0].lstrip("/")


def _attribute(item: Any, names: tuple[str, ...]) -> Any:
    for name in item.attrs:
        if name.lower() in names:
            value = item.attrs[name]
            value = value.reshape(-1)[0] if isinstance(value, np.ndarray) and value.size == 1 else value
            return value.decode() if isinstance(value, bytes) else value
    return None


def _number(path: Path, item: Any, names: tuple[str, ...]) -> float | None:
    """The number that an attribute of one of these names holds, or the text of it; None without one."""
    value = _attribute(item, names)
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError):
        name = next(name for name in item.attrs if name.lower() in names)
        raise SignalError(
            f"{path}: the attribute {name} of {item.name} must be one number, got {str(value)!r}; correct it or "
            "take it out of the file."
        ) from None


def _unpacked(path: Path, item: Any) -> np.ndarray:
    scale, offset = (_number(path, item, (name,)) for name in ("scale_factor", "add_offset"))
    if scale is None and offset is None:
        return item[()]
    return item[()].astype(np.float64) * (1.0 if scale is None else scale) + (offset or 0.0)


def _scalar(path: Path, item: Any, h5py: Any) -> float:
    _check_written(path, item, h5py)
    return float(np.asarray(item[()]).reshape(-1)[0])


def _begins(head: bytes) -> bool:
    # A user block of 512, 1024, … bytes may stand before the signature: MAT 7.3 has one.
    return any(head.startswith(_SIGNATURE, 0 if power < 9 else 2**power) for power in range(8, 16))


FORMAT = Format(_NAME, (".h5", ".hdf5", ".hdf", ".mat"), _begins, read)
