"""The same measurement, an acceleration in m/s² and a pulse in V, written in every format by the libraries of the
field."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pyuff
import scipy.io
import soundfile
from nptdms import ChannelObject, TdmsWriter

FULL_SCALE = 50.0
"""What a WAV sample of 1 is worth [m/s²]."""


def csv(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    rows = [f"{k / rate:.9f},{v:.17g},{p:.17g}" for k, (v, p) in enumerate(zip(values, pulse, strict=True))]
    path.write_text("\n".join(["time [s],acc [m/s^2],pulse [V]", *rows, ""]))


def parquet(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    table = pa.table({"time [s]": np.arange(len(values)) / rate, "acc [m/s^2]": values, "pulse [V]": pulse})
    pq.write_table(table, path, write_page_checksum=True)


def mat(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float, compress: bool = True) -> None:
    variables = {"acc": values[:, None], "pulse": pulse[:, None], "fs": rate, "note": "bench 3"}
    scipy.io.savemat(path, variables, do_compression=compress)


def mat_plain(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    mat(path, values, pulse, rate, compress=False)


def mat73(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    """As MATLAB's -v7.3 lays it out: a user block of 512 bytes, arrays transposed, classes as attributes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, numbers in {"acc": values[None], "pulse": pulse[None], "fs": np.array([[rate]])}.items():
            file.create_dataset(name, data=numbers).attrs["MATLAB_class"] = np.bytes_("double")
        note = file.create_dataset("note", data=np.frombuffer("bench".encode("utf-16-le"), dtype=np.uint16)[:, None])
        note.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as stream:
        head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM"
        stream.write(head)


def hdf5(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    with h5py.File(path, "w") as file:
        group = file.create_group("run 1")
        group.attrs["sample_rate"] = rate
        chunks = {"chunks": (64,), "compression": "gzip", "fletcher32": True}
        group.create_dataset("acc", data=values, **chunks).attrs["unit"] = "m/s^2"
        group.create_dataset("pulse", data=pulse, **chunks).attrs["unit"] = "V"


def tdms(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    stated = {"wf_increment": 1.0 / rate, "wf_start_offset": 0.0}
    channels = [
        ChannelObject("run", "acc", values, properties={**stated, "unit_string": "m/s^2"}),
        ChannelObject("run", "pulse", pulse, properties={**stated, "unit_string": "V"}),
    ]
    with TdmsWriter(path) as writer:
        writer.write_segment(channels)


def uff(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    for name, numbers, unit in (("acc", values, "m/s^2"), ("pulse", pulse, "V")):
        history = pyuff.prepare_58(
            func_type=1, id1=name, rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1, data=numbers.copy(),
            x=np.arange(len(numbers)) / rate, abscissa_spacing=1, abscissa_min=0.0, abscissa_inc=1.0 / rate,
            num_pts=len(numbers), ord_data_type=4, abscissa_spec_data_type=17, ordinate_spec_data_type=12,
            ordinate_axis_units_lab=unit, abscissa_axis_units_lab="s", orddenom_spec_data_type=0,
        )  # fmt: skip
        pyuff.UFF(str(path)).write_sets(history, mode="overwrite" if name == "acc" else "add")


def uff_binary(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    """By hand, as pyuff closes a binary set before it is written."""
    uff(path, values, pulse, rate)
    parts = []
    for text, numbers in zip(path.read_text().split("    -1\n    58")[1:], (values, pulse), strict=True):
        lines = text.split("\n")[1:12]
        first = f"    58b     1     2          11{8 * len(numbers):12d}     0     0           0           0"
        head = "\n".join(["    -1", first, *lines, ""]).encode()
        parts.append(head + numbers.astype("<f8").tobytes() + b"\n    -1\n")
    path.write_bytes(b"".join(parts))


def wav(path: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> None:
    tracks = np.column_stack([values / FULL_SCALE, pulse / FULL_SCALE])
    soundfile.write(path, tracks, int(rate), subtype="DOUBLE")


WRITERS: dict[str, tuple[str, Callable[[Path, np.ndarray, np.ndarray, float], None]]] = {
    "csv": ("a.csv", csv),
    "parquet": ("a.parquet", parquet),
    "mat": ("a.mat", mat),
    "mat_plain": ("a.mat", mat_plain),
    "mat73": ("a.mat", mat73),
    "hdf5": ("a.h5", hdf5),
    "tdms": ("a.tdms", tdms),
    "uff": ("a.uff", uff),
    "uff_binary": ("a.unv", uff_binary),
    "wav": ("a.wav", wav),
}
"""File name and writer by format."""

OPTIONS: dict[str, dict[str, object]] = {
    "wav": {"signal_column": "channel 1", "scale": FULL_SCALE, "unit": "m/s^2"},
    **{key: {"signal_column": "acc", "unit": "m/s^2"} for key in ("mat", "mat_plain", "mat73")},
}
"""What the file leaves open."""

PULSE = {"wav": "channel 2"}
"""Channel of the pulse, where it is not "pulse"."""


def written(kind: str, folder: Path, values: np.ndarray, pulse: np.ndarray, rate: float) -> Path:
    """A file of this format in the folder."""
    name, writer = WRITERS[kind]
    writer(folder / name, values, pulse, rate)
    return folder / name
