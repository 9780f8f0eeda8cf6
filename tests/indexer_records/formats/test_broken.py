"""Broken, hostile and endless files: a sentence each, in time and in bounded memory, and never a wrong record."""

from __future__ import annotations

import collections
import os
import resource
import shutil
import signal
import struct
import zlib

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from indexer_env.errors import SignalError
from indexer_records.formats import csv, mat, parquet, read_table, table
from indexer_records.formats.gate import library
from indexer_records.formats.worker import Worker
from indexer_records.measured import read_signal
from tests.indexer_records.formats.fuzz import RIGHT, Fuzzer, run_many
from tests.indexer_records.formats.samples import OPTIONS, written


def refusal(path, **options) -> str:
    with pytest.raises(SignalError) as caught:
        read_signal(path, **options)
    text = str(caught.value)
    assert "\n" not in text and text.endswith(".") and str(path) in text
    return text


def test_broken_files_are_refused_or_read_as_a_second_parser_does(tmp_path):
    fuzzer = Fuzzer(tmp_path)
    verdicts = [fuzzer.judge(seed) for seed in range(600)]
    assert [verdict for verdict in verdicts if verdict.outcome not in RIGHT] == []
    counts = collections.Counter(verdict.outcome for verdict in verdicts)
    # Some must be read, else the comparison would be of nothing.
    assert counts["agrees"] > 20 and counts["refused"] > 300


@pytest.mark.slow
def test_a_hundred_thousand_broken_files():
    verdicts = run_many(100_000, os.cpu_count() or 1, first=1_000_000)
    assert [verdict for verdict in verdicts if verdict.outcome not in RIGHT] == []


def test_a_second_parser_that_disagrees_is_noticed(tmp_path, monkeypatch):
    """The harness can fail: with a twin whose last sample is off, each changed record that is read is called wrong."""
    import tests.indexer_records.formats.fuzz as harness

    def off(kind, path):
        found = true_twin(kind, path)
        return {name: (np.append(values[:-1], values[-1] + 1.0), rate) for name, (values, rate) in found.items()}

    true_twin = harness.twin
    monkeypatch.setattr(harness, "twin", off)
    fuzzer = Fuzzer(tmp_path)
    outcomes = collections.Counter(fuzzer.judge(seed).outcome for seed in range(9, 1000, 10))
    assert outcomes["wrong"] > 5 and outcomes["agrees"] == 0


# -------------------------------------------------------------------------------------------- bombs


def test_a_mat_file_that_unpacks_to_too_much(tmp_path, monkeypatch):
    for module in (mat, table):
        monkeypatch.setattr(module, "LARGEST_CONTENT", 2**22)
    packed = zlib.compress(bytes(2**24), 9)
    path = tmp_path / "bomb.mat"
    path.write_bytes(b" " * 124 + b"\x00\x01IM" + struct.pack("<II", 15, len(packed)) + packed)
    with pytest.raises(SignalError, match="at most 4 MiB of samples"):
        mat.read(path)


def test_a_mat_file_of_cells_within_cells(tmp_path):
    nested = np.arange(20.0)
    for _ in range(60):
        cell = np.empty((1, 1), dtype=object)
        cell[0, 0] = nested
        nested = cell
    scipy.io.savemat(tmp_path / "deep.mat", {"acc": nested})
    assert "more than 8 deep" in refusal(tmp_path / "deep.mat")


def test_structures_are_read_as_far_as_they_are_named(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"run": {"acc": np.arange(40.0) ** 2, "fs": 500.0, "who": "bench"}})
    signal = read_signal(path, signal_column="run.acc", unit="g")
    assert signal.sample_rate == 500.0 and signal.values.size == 40


def test_an_hdf5_file_whose_samples_are_not_in_it(tmp_path):
    with h5py.File(tmp_path / "empty.h5", "w") as file:
        file.create_dataset("acc", shape=(1000,), dtype="f8", chunks=(100,))
    assert "not all samples of /acc were written" in refusal(tmp_path / "empty.h5", sample_rate=1.0, unit="g")
    (tmp_path / "secret").write_bytes(bytes(8000))
    with h5py.File(tmp_path / "elsewhere.h5", "w") as file:
        file.create_dataset("acc", shape=(1000,), dtype="f8", external=[(str(tmp_path / "secret"), 0, 8000)])
    assert "stand in other files" in refusal(tmp_path / "elsewhere.h5", sample_rate=1.0, unit="g")
    with h5py.File(tmp_path / "huge.h5", "w") as file:
        file.create_dataset("acc", shape=(2**40,), dtype="f8", chunks=(2**20,))
    assert "at most 1024 MiB of samples" in refusal(tmp_path / "huge.h5", sample_rate=1.0, unit="g")


def test_a_parquet_file_of_few_bytes_and_many_samples(tmp_path, monkeypatch):
    monkeypatch.setattr(table, "LARGEST_CONTENT", 2**22)
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"time [s]": np.zeros(2**20), "acc [g]": np.zeros(2**20)}), path, compression="zstd")
    assert path.stat().st_size < 2**16
    with pytest.raises(SignalError, match="at most 4 MiB of samples, got 16 MiB"):
        parquet.read(path)


def test_a_parquet_text_that_stands_for_every_row_is_not_unpacked(tmp_path):
    path = tmp_path / "a.parquet"
    note = pa.array(["x" * 2**20]).dictionary_encode()
    notes = pa.DictionaryArray.from_arrays(pa.array(np.zeros(5000, dtype=np.int32)), note.dictionary)
    pq.write_table(pa.table({"time [s]": np.arange(5000) / 1e3, "acc [g]": np.ones(5000), "note": notes}), path)
    assert read_signal(path).values.size == 5000


def test_a_text_file_that_would_take_too_much(tmp_path, monkeypatch):
    monkeypatch.setattr(csv, "_LARGEST_TEXT", 2**20)
    path = tmp_path / "a.csv"
    path.write_bytes(b"0.001,1.0\n" * 2**17)
    assert "at most 1 MiB of text, got 1 MiB; save it as Parquet" in refusal(path)


def test_a_file_larger_than_any_may_be(tmp_path):
    path = tmp_path / "a.tdms"
    with path.open("wb") as file:
        file.write(b"TDSm")
        file.truncate(2**31)
    assert "at most 1024 MiB, got 2048 MiB" in refusal(path)


def test_a_pipe_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "a.csv")
    assert "no file but a device or a pipe" in refusal(tmp_path / "a.csv")


# -------------------------------------------------------------------------------------------- the worker


@pytest.fixture
def worker():
    worker = Worker()
    yield worker
    worker.close()


def test_a_reader_that_hangs_is_ended(tmp_path):
    worker = Worker(time_limit=0.5)
    os.mkfifo(tmp_path / "a.wav")
    with pytest.raises(SignalError, match=r"a\.wav cannot be read within 0\.5 s as a WAV file"):
        worker.read(tmp_path / "a.wav", "WAV")
    assert not worker.alive


def test_a_reader_that_crashes_costs_its_file_only(tmp_path):
    import indexer_records.formats.worker as module

    path = written("wav", tmp_path, np.ones(40), np.ones(40), 100.0)
    assert read_signal(path, **OPTIONS["wav"]).values.size == 40
    first = module._shared
    assert first is not None
    os.kill(first._process.pid, signal.SIGSEGV)
    first._process.wait()
    assert read_signal(path, **OPTIONS["wav"]).values.size == 40
    assert module._shared is not first


def test_a_crash_left_behind_by_an_earlier_file_is_not_told_against_the_next(tmp_path, monkeypatch):
    import indexer_records.formats.worker as module

    path = written("wav", tmp_path, np.ones(40), np.ones(40), 100.0)
    read_signal(path, **OPTIONS["wav"])
    first = module._shared
    assert first is not None
    first._process.kill()
    first._process.wait()
    monkeypatch.setattr(module.Worker, "alive", True)  # as in the moment before the crash
    assert read_signal(path, **OPTIONS["wav"]).values.size == 40
    asked = []

    def crashing(worker: Worker, path: object, kind: str) -> None:
        asked.append(worker)
        raise module.CrashError(f"{path} crashed.")

    monkeypatch.setattr(module.Worker, "read", crashing)
    with pytest.raises(SignalError, match="crashed"):
        read_signal(path, **OPTIONS["wav"])
    assert len(set(asked)) == 2


def test_a_worker_that_ends_while_it_reads(worker, tmp_path):
    os.kill(worker._process.pid, signal.SIGSEGV)
    with pytest.raises(SignalError, match="the WAV library crashed over it"):
        worker.read(tmp_path / "a.wav", "WAV")


@pytest.mark.parametrize(("hard", "set_to"), [(2**30, 2**30), (resource.RLIM_INFINITY, 2**32), (2**40, 2**32)])
def test_a_lower_limit_of_memory_is_kept(hard, set_to, monkeypatch):
    """macOS refuses some limits; a process that is not root may not raise one."""
    import indexer_records.formats.worker as module

    asked = []

    def setrlimit(kind: int, limits: tuple[int, int]) -> None:
        asked.append(limits)
        raise ValueError("not allowed to raise maximum limit")

    monkeypatch.setattr(module.resource, "getrlimit", lambda kind: (hard, hard))
    monkeypatch.setattr(module.resource, "setrlimit", setrlimit)
    module._limit(resource.RLIMIT_AS, 2**32)
    assert asked == [(set_to, set_to)]


def test_a_worker_that_does_not_start(monkeypatch):
    monkeypatch.setattr("sys.executable", shutil.which("false"))
    with pytest.raises(SignalError, match=r"did not start; give it more memory \(ulimit -v\), or export"):
        Worker()


def test_a_defect_of_our_own_is_not_hidden(worker, tmp_path):
    with pytest.raises(RuntimeError, match="KeyError: 'no such format'"):
        worker.read(tmp_path / "a.wav", "no such format")


def test_a_missing_library_is_named_with_its_remedy(tmp_path):
    with pytest.raises(SignalError, match=r"no_such_library must be installed; run: pip install 'indexer-diag"):
        library("no_such_library", tmp_path / "a.tdms", "TDMS")


def test_a_file_that_goes_away(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("1,2\n")

    def gone(*_: object) -> bytes:
        raise FileNotFoundError(2, "No such file or directory")

    monkeypatch.setattr(type(path), "read_bytes", gone)
    with pytest.raises(SignalError, match="cannot be read"):
        read_table(path)
