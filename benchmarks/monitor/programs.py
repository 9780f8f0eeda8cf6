"""Programs that the measurements start and kill: the monitor, a broker, a database."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

_PLACES = [os.environ.get("PATH", ""), "/usr/sbin", *map(str, sorted(Path("/usr/lib/postgresql").glob("*/bin")))]
MOSQUITTO, INITDB, POSTGRES = (
    shutil.which(name, path=os.pathsep.join(_PLACES)) for name in ("mosquitto", "initdb", "postgres")
)
# PostgreSQL does not run as root.
_USER = "nobody" if os.geteuid() == 0 else None

PATIENCE_S = 300.0


def free_port() -> int:
    """A port of this host that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Process:
    """A program that can be killed and started again."""

    def __init__(self, command: list[str], folder: Path, name: str) -> None:
        self.command, self._log, self._folder = command, folder / f"{name}.log", folder
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it."""
        with self._log.open("ab") as log:
            self.process = subprocess.Popen(
                self.command, stdout=log, stderr=log, cwd=self._folder, start_new_session=True,
                env=os.environ | {"PYTHONPATH": os.getcwd()},
            )  # fmt: skip

    def kill(self) -> None:
        """kill -9, and wait until it is gone."""
        if self.process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()

    def end(self) -> None:
        """Ask it to end."""
        if self.process is not None:
            self.process.terminate()
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.kill()


def broker_process(folder: Path, port: int, kept: bool = True) -> Process:
    """Mosquitto; `kept`: it writes all that it holds with every message, so that its kill loses nothing."""
    config = folder / "mosquitto.conf"
    config.write_text(
        f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\nmax_inflight_messages 0\nuser root\n"
        + f"persistence true\npersistence_location {folder}/\nautosave_interval 1\nautosave_on_changes true\n" * kept
    )
    assert MOSQUITTO is not None
    return Process([MOSQUITTO, "-c", str(config)], folder, "broker")


class Database:
    """A PostgreSQL of its own; others than its owner must be able to reach `folder`."""

    def __init__(self, folder: Path) -> None:
        assert INITDB is not None and POSTGRES is not None
        self._folder, self._port = folder, free_port()
        folder.mkdir(exist_ok=True)
        if _USER is not None:
            shutil.chown(folder, _USER)
        made = self._run([INITDB, "-D", str(folder / "data"), "-U", "me", "-A", "trust"]).wait(PATIENCE_S)
        assert made == 0, f"initdb ended with {made}"
        self._server: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        """As the monitor's `store` takes it."""
        return f"postgresql://me@127.0.0.1:{self._port}/postgres"

    def start(self) -> None:
        """Start it and wait until it listens."""
        assert POSTGRES is not None
        command = [POSTGRES, "-D", str(self._folder / "data"), "-p", str(self._port), "-h", "127.0.0.1",
                   "-k", str(self._folder)]  # fmt: skip
        until = time.monotonic() + PATIENCE_S
        while not listening(self._port):
            # As long as a process of the killed one holds its shared memory, a new server ends at once.
            if self._server is None or self._server.poll() is not None:
                self._server = self._run(command)
            assert time.monotonic() < until, "PostgreSQL did not start"
            time.sleep(0.1)

    def kill(self) -> None:
        """kill -9 of the server and then of each process that it has started."""
        if self._server is not None:
            children = Path(f"/proc/{self._server.pid}/task/{self._server.pid}/children").read_text().split()
            for pid in (self._server.pid, *map(int, children)):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._server.wait()

    def end(self) -> None:
        """Ask it to end, without waiting for its clients."""
        if self._server is not None:
            self._server.send_signal(signal.SIGINT)
            self._server.wait(PATIENCE_S)

    def _run(self, command: list[str]) -> subprocess.Popen[bytes]:
        return subprocess.Popen(command, user=_USER, cwd=self._folder, stdout=subprocess.DEVNULL,
                                stderr=subprocess.DEVNULL, start_new_session=True)  # fmt: skip


def listening(port: int) -> bool:
    """Whether something answers at a port of this host."""
    try:
        socket.create_connection(("127.0.0.1", port), 1.0).close()
    except OSError:
        return False
    return True


def wait(condition: Callable[[], object], what: str) -> None:
    """Wait until it is so."""
    until = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until, f"{what} did not come"
        time.sleep(0.1)
