"""Files in time: which goes on with the last one, which is a recording of its own, and which holds no turn."""

import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from indexer_records.measured import Reading
from monitor.engine import Engine
from monitor.sources.folder import FolderSource
from monitor.store import Store
from monitor.store.store import write_position
from tests.monitor.fakes import PLAN, FakeDiagnoser
from tests.monitor.test_service import wait_for


@pytest.fixture
def read(monitor, tmp_path):
    """Reads a file of a machine whose turns last a second; `anew`: as after a restart of the source."""
    source = None

    def read(name, seconds, anew=False):
        nonlocal source
        if source is None or anew:
            source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
        time_s = np.arange(round(100 * seconds)) / 100.0
        rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
        file = tmp_path / f"press_{name}.csv"
        file.write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")
        source._read(monitor.engine, file, file.name, str(seconds))
        wait_for(lambda: monitor.engine.positions(source.name).get(file.name) == str(seconds))
        return source, monitor.store.summary("press")

    return read


def test_files_an_hour_apart_are_recordings_and_no_gap(read):
    read("20270115T080000Z", 3)
    _, summary = read("20270115T090000Z", 3)
    assert "gap" not in summary["states"] and summary["turns"] >= 5
    _, summary = read("20270115T100000Z", 3, anew=True)
    assert "gap" not in summary["states"] and summary["turns"] >= 8


def test_a_file_that_goes_on_with_the_last_one_loses_no_turn_at_the_border(read):
    read("20270115T080000Z", 2.5)
    read("20270115T080002.5Z", 2)
    _, summary = read("20270115T080004.51Z", 2.5, anew=True)  # 10 ms late: within the jitter
    assert summary["turns"] == 7 and summary["active_states"] == []


def test_a_file_shorter_than_a_turn_is_told_until_another_goes_on_with_it(read, caplog):
    source, _ = read("20270115T080000Z", 0.5)
    told = "press_20270115T080000Z.csv must hold a turn of the table, 1 s at least"
    assert source.trouble.startswith(told) and "got 0.5 s" in source.trouble and told in caplog.text
    source, summary = read("20270115T080000.5Z", 1.6)
    assert source.trouble is None and summary["turns"] == 2
    source, _ = read("20270115T090000Z", 0.9)
    assert "got 0.9 s" in source.trouble
    assert read("20270115T100000Z", 1)[0].trouble is None


def test_files_whose_times_overlap_a_little_are_all_used(read):
    """As by the times of their last changes, which are off by some hundredths of a second."""
    for name in ("20270115T080000Z", "20270115T080002.95Z", "20270115T080005.96Z", "20270115T080008.9Z"):
        _, summary = read(name, 3)
    assert summary["turns"] >= 8 and "late" not in summary["states"]


def test_a_file_that_is_gone_and_a_folder_that_is_gone_do_not_end_the_source(monitor, tmp_path, monkeypatch):
    folder = tmp_path / "logger"
    source = FolderSource(folder, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    with pytest.raises(FileNotFoundError):
        source._read(monitor.engine, folder / "press_1.csv", "press_1.csv", "1")
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    source.start(monitor.engine)
    wait_for(lambda: source.trouble is not None)
    assert "cannot be read (No such file or directory); trying again" in source.trouble
    folder.mkdir()
    wait_for(lambda: source.trouble is None)
    source.stop()
    assert source.failure is None


def test_a_file_that_cannot_be_opened_for_a_moment_is_read_later(monitor, tmp_path, monkeypatch, caplog):
    """Before the one behind it, which goes on with it."""
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    monkeypatch.setattr("monitor.sources.folder._RETRY_S", 0.05)
    time_s = np.arange(300) / 100.0
    rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
    name, behind = "press_20270115T080000Z.csv", "press_20270115T080003Z.csv"
    for file in (name, behind):
        (tmp_path / file).write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    opened, read = [], Path.open

    def refused(path, *given, **more):
        if path.name == name and len(opened) < 3:
            opened.append(path)
            raise PermissionError(13, "Permission denied")
        return read(path, *given, **more)

    monkeypatch.setattr(Path, "open", refused)
    source.start(monitor.engine)
    wait_for(lambda: monitor.engine.positions(source.name).get(behind))
    source.stop()
    summary = monitor.store.summary("press")
    assert len(opened) == 3 and summary["turns"] >= 5 and "late" not in summary["states"]
    assert f"{name} cannot be read (Permission denied); trying again" in caplog.text


def test_a_file_of_several_blocks_that_a_restart_broke_off_is_counted_once(monitor, tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    monkeypatch.setattr("monitor.sources.folder.LARGEST_BLOCK", 100)
    time_s = np.arange(2000) / 100.0
    rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
    name = "press_20270115T080000Z.csv"
    (tmp_path / name).write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    offer, offered = monitor.engine.offer, []

    def broken_off(arrival, timeout=None):
        if len(offered) == 12:
            source.stopping.set()
            return False
        offered.append(arrival)
        return offer(arrival, timeout)

    monkeypatch.setattr(monitor.engine, "offer", broken_off)
    source.run(monitor.engine)
    wait_for(lambda: monitor.engine.blocks == 12)
    monitor.engine.stop()
    again = Engine(monitor.store, monitor.diagnoser, PLAN)
    again.start()
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    source.start(again)
    wait_for(lambda: again.positions(source.name).get(name))
    source.stop()
    again.stop()
    starts = [turn["start_ns"] for turn in monitor.store.turns("press")]
    assert len(starts) == len(set(starts)) >= 19 and monitor.store.summary("press")["states"]["double"]["count"] == 12


def test_a_name_that_is_not_utf_8_is_told_and_the_others_are_read(monitor, tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    time_s = np.arange(300) / 100.0
    rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
    for name in (b"press-\xfc_20270115T080000Z.csv", b"turner_20270115T080000Z.csv"):
        with open(os.fsencode(tmp_path) + b"/" + name, "w") as file:
            file.write(f"time [s],acceleration [m/s^2]\n{rows}\n")
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    source.start(monitor.engine)
    wait_for(lambda: monitor.store.summary("turner"))
    wait_for(lambda: monitor.engine.unread.sentences)
    source.stop()
    (told,) = monitor.engine.unread.sentences
    assert "UTF-8" in told and r"press-\udcfc_20270115T080000Z.csv" in told and told.encode()
    assert source.failure is None and monitor.engine.failure is None


def test_files_are_read_in_the_order_of_their_times(tmp_path):
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    for number in (1, 2, 10):
        path = tmp_path / f"press_{number}.csv"
        path.write_text("time [s],acceleration [m/s^2]\n")
        os.utime(path, (1e9 + number, 1e9 + number))
    source._complete({})
    assert [name for name, _ in source._complete({})] == ["press_1.csv", "press_2.csv", "press_10.csv"]


def test_a_late_file_is_told_as_late_and_no_clock_that_was_set_back(read, tmp_path, monkeypatch, caplog):
    """However many blocks it has, and it is not said to be too short."""
    monkeypatch.setattr("monitor.sources.folder.LARGEST_BLOCK", 50)
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    blocks = [SimpleNamespace(machine="press", start_ns=k * 10**9, end_ns=(k + 1) * 10**9, rate=1.0) for k in range(5)]
    source._stretches["press"] = 0, 90 * 10**9
    assert source._placed(SimpleNamespace(), "press_1.csv", blocks) == blocks[-1:] and source.trouble is None
    assert source._stretches["press"] == (0, 90 * 10**9)


def test_only_files_of_known_formats_are_read_at_any_depth_and_no_links(tmp_path):
    """A hidden name is that of a file which its logger has not finished."""
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    (tmp_path / "press" / "june").mkdir(parents=True)
    for name in ("press/june/a.CSV", "b.csv", "notes.txt.bak", ".c.csv", "press/.d.csv"):
        (tmp_path / name).write_text("0,1\n")
    (tmp_path / "link.csv").symlink_to(tmp_path / "b.csv")
    (tmp_path / "linked").symlink_to(tmp_path / "press")
    (tmp_path / "folder.csv").mkdir()
    source._complete({})
    assert sorted(name for name, _ in source._complete({})) == ["b.csv", "press/june/a.CSV"]


@pytest.mark.parametrize(("looking", "waits"), [(0.01, 1.0), (0.5, 5.0)])
def test_a_folder_of_very_many_files_is_looked_at_more_rarely(tmp_path, monkeypatch, looking, waits):
    """Looking takes a tenth of the time at most."""
    now, waited = [0.0], []
    monkeypatch.setattr("monitor.sources.folder.time.monotonic", lambda: now[0])
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)

    def looked(done):
        now[0] += looking
        return []

    def wait(seconds):
        waited.append(seconds)
        source.stopping.set()

    monkeypatch.setattr(source, "_complete", looked)
    monkeypatch.setattr(source.stopping, "wait", wait)
    source.run(SimpleNamespace(positions=lambda name: {}))  # type: ignore[arg-type]
    assert waited == [pytest.approx(waits)]


@pytest.mark.parametrize(
    ("encoding", "ending", "looks"), [("utf-8", "\n", 1), ("utf-16", "\r\n", 1), ("utf-8", "", 10), ("utf-16", "", 10)]
)
def test_a_text_that_grows_is_complete_once_its_last_line_is(tmp_path, monkeypatch, encoding, ending, looks):
    """`looks` times `settle` must pass; one that is there at once need not grow any more."""
    now = [0.0]
    monkeypatch.setattr("monitor.sources.folder.time.monotonic", lambda: now[0])
    source = FolderSource(tmp_path, Reading(), None, settle=2.0, jitter=0.02, turn=1.0)
    path = tmp_path / "press_20270115T080000Z.csv"

    def seconds_until_complete():
        begun = now[0]
        while not source._complete({}):
            now[0] += 1.0
        return now[0] - begun

    path.write_text("time [s],acceleration [m/s^2]\n0.00,0.1", encoding=encoding)
    assert seconds_until_complete() == 2.0
    path.write_text(f"time [s],acceleration [m/s^2]\n0.00,0.123\n0.01,-0.4{ending}", encoding=encoding, newline="")
    assert seconds_until_complete() == 2.0 * looks


def test_of_a_file_that_has_grown_what_is_new_is_used(monitor, tmp_path, monkeypatch):
    """A logger that pauses for longer than `settle` within a file of 8 s."""
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    source = FolderSource(tmp_path, Reading(), None, settle=0.02, jitter=0.02, turn=1.0)
    path = tmp_path / "press_20270115T080000Z.csv"

    def write(seconds):
        time_s = np.arange(round(100 * seconds)) / 100.0
        rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
        path.write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")

    write(3.3)
    source.start(monitor.engine)
    wait_for(lambda: monitor.store.summary("press") and monitor.store.summary("press")["turns"] == 3)
    write(8.1)
    wait_for(lambda: monitor.store.summary("press")["turns"] == 8)
    source.stop()
    assert "double" not in monitor.store.summary("press")["states"]


def test_of_a_file_that_has_grown_nothing_is_lost_while_the_engine_is_behind(tmp_path):
    store = Store(f"sqlite:///{tmp_path}/monitor.sqlite")
    engine = Engine(store, FakeDiagnoser(), PLAN)
    engine.start()
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    path = tmp_path / "press_20270115T080000Z.csv"
    for seconds, grown in ((3.3, False), (5.6, True), (9.1, True)):
        time_s = np.arange(round(100 * seconds)) / 100.0
        rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
        path.write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")
        with engine._lock:
            source._read(engine, path, path.name, str(seconds), grown=grown)
    wait_for(lambda: engine.waiting == 0 and engine.positions(source.name).get(path.name) == "9.1")
    engine.stop()
    summary = store.summary("press")
    store.close()
    assert summary["turns"] == 9 and "gap" not in summary["states"] and "clock_step" not in summary["states"]


def test_a_file_that_has_a_new_date_alone_is_not_taken_in_again(monitor, tmp_path, monkeypatch):
    """Also after a restart; one with other samples of the same size is a recording of its own."""
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    path, looks = tmp_path / "press.csv", []

    def write(seed, seconds):
        values = np.random.default_rng(seed).choice([-1.5, 1.5], 300)
        rows = "\n".join(f"{k / 100:.2f},{value:+.6f}" for k, value in enumerate(values))
        path.write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")
        os.utime(path, (1.8e9 + seconds, 1.8e9 + seconds))

    def watch(done, **more):
        source = FolderSource(tmp_path, Reading(), None, settle=0.02, jitter=0.02, turn=1.0)
        once = source._once
        monkeypatch.setattr(source, "_once", lambda *given: looks.append(once(*given)) or looks[-1])
        source.start(monitor.engine)
        wait_for(done)
        source.stop()
        assert source.failure is None and monitor.engine.failure is None

    write(0, 0)
    watch(lambda: monitor.store.summary("press"))
    os.utime(path, (1.8e9 + 3600, 1.8e9 + 3600))
    watch(lambda: len(looks) == 2)
    time.sleep(0.3)
    summary = monitor.store.summary("press")
    assert summary["turns"] == 3 and not summary["states"]
    write(1, 7200)
    watch(lambda: monitor.store.summary("press")["turns"] == 6)
    assert not monitor.store.summary("press")["states"]


def test_a_folder_is_the_same_however_it_is_written(monitor, tmp_path, monkeypatch):
    """Also what an earlier version has read under the name as it was given."""
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.01)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logger").mkdir()
    names = [
        FolderSource(folder, Reading(), None, 0.0, 0.02, 1.0).name for folder in (Path("logger"), tmp_path / "logger")
    ]
    assert names[0] == names[1]
    path = tmp_path / "logger" / "press_20270115T080000Z.csv"
    path.write_text("time [s],acceleration [m/s^2]\n0.00,0.1\n0.01,0.2\n")
    state = path.stat()
    with monitor.store.transaction() as connection:
        write_position(connection, "folder:logger", path.name, f"{state.st_size} {state.st_mtime_ns}")
    source = FolderSource(Path("logger"), Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    source.start(monitor.engine)
    time.sleep(0.3)
    source.stop()
    assert monitor.engine.blocks == 0 and not monitor.engine.unread.sentences


def test_of_a_file_that_has_grown_by_nothing_that_is_new_nothing_is_used(tmp_path):
    """All of its samples were used; they were handed over again as if they came twice."""
    offered = []
    engine = SimpleNamespace(newest_ns=lambda _: None, offer=lambda arrival, timeout: offered.append(arrival) or True)
    source = FolderSource(tmp_path, Reading(), None, settle=0.0, jitter=0.02, turn=1.0)
    path = tmp_path / "press_20270115T080000Z.csv"
    rows = "\n".join(f"{k / 100:.2f},{np.sin(k):.6f}" for k in range(300))
    path.write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")
    source._read(engine, path, path.name, "1")
    source._ends[path.name] -= 1000
    source._read(engine, path, path.name, "2", grown=True)
    assert len(offered) == 1
