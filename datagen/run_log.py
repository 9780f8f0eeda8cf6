"""run.json: when, on what and with how many interruptions a data set was made."""

from __future__ import annotations

import datetime
import platform
import time
from pathlib import Path
from typing import Any

from datagen.store import RUN, as_json, read_json
from indexer_cli.places import Place
from indexer_env.engine import cores


class RunLog:
    """The sessions of a data set, the present one last. One that was killed has no end and no duration.

    The present one began when time.monotonic() was `began`: shards may be made before there is a folder to log in.
    """

    def __init__(self, place: Place, executor: str, began: float) -> None:
        self.place, self.began = place, began
        self.sessions: list[dict[str, Any]] = (read_json(place, RUN) or {}).get("sessions", [])
        started = datetime.datetime.now(datetime.UTC) - datetime.timedelta(seconds=time.monotonic() - began)
        self.sessions.append(
            {
                "started": started.isoformat(timespec="seconds"),
                "seconds": None,
                "items": None,
                "executor": executor,
                "processor": processor(),
                "cores": cores(),
                "system": f"{platform.system()}, Python {platform.python_version()}",
            }
        )
        self._publish()

    def end(self, items: int) -> None:
        """Close the session: so many items were made in it."""
        self.sessions[-1].update(seconds=round(time.monotonic() - self.began, 1), items=items)
        self._publish()

    def content(self) -> dict[str, Any]:
        """What run.json holds: `interruptions`, `seconds` of all sessions that came to their end, and the sessions."""
        seconds = round(sum(session["seconds"] or 0.0 for session in self.sessions), 1)
        return {"interruptions": len(self.sessions) - 1, "seconds": seconds, "sessions": self.sessions}

    def _publish(self) -> None:
        self.place.publish(RUN, as_json(self.content()))


def processor() -> str:
    """The processor as the system names it."""
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
