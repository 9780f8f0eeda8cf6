"""The paths and URLs that commands are given, and where each job of a sweep (`-m`) writes."""

from __future__ import annotations

from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import OmegaConf

from indexer_cli.places import Place, is_url, open_place
from indexer_env.errors import refuse

_OF_SWEEP = "multirun.yaml"
"""What Hydra leaves in the folder of a sweep."""


def path_given(command: str, key: str, value: object) -> Path:
    """The path that a key of a command holds.

    Raises
    ------
    ParameterError
        Not a text or an empty one: a number, true or null would become a folder of that name.
    """
    if not isinstance(value, str) or not value.strip():
        raise refuse(command, key, "a path", value, f"write {key}=./NAME for a name that reads as something else")
    if is_url(value):
        raise refuse(command, key, "a path on this machine", value, "copy the files from there or to there yourself")
    return Path(value.removeprefix("file://"))


def files_given(command: str, key: str, value: object) -> str | list[str]:
    """The files that a key of a command holds: their list, or the path of a folder or a pattern."""
    if isinstance(value, list) and value and all(isinstance(name, str) for name in value):
        return value
    return str(path_given(command, key, value))


def texts_given(command: str, key: str, value: object, rule: str) -> list[str]:
    """The texts that a key of a command holds, one or a list of them; `rule` says so."""
    given = [value] if isinstance(value, str) else value
    if not isinstance(given, list) or not all(isinstance(text, str) for text in given):
        raise refuse(command, key, rule, given)
    return given


def place_given(command: str, key: str, value: object) -> Place:
    """As `path_given`, for a command that reads URLs as well."""
    return open_place(str(value) if is_url(value) else path_given(command, key, value))


def job_folder(command: str, out: object) -> Path:
    """The folder a job writes to: `out` itself, or `out/<job number>` for each job of a sweep (`-m`).

    Raises
    ------
    ParameterError
        `out` is no path.
    """
    folder = path_given(command, "out", out)
    return Path(HydraConfig.get().runtime.output_dir) if in_sweep() else folder


def job_place(command: str, out: object) -> str:
    """As `job_folder`, for a command that writes to URLs as well."""
    if not is_url(out):
        return str(job_folder(command, out))
    return f"{str(out).rstrip('/')}/{HydraConfig.get().job.num}" if in_sweep() else str(out)


def in_sweep() -> bool:
    """Whether this is a job of a sweep (`-m`)."""
    return HydraConfig.initialized() and HydraConfig.get().mode is RunMode.MULTIRUN


def _sweep_folder(out: object) -> str:
    """The folder of a sweep, as conf/command.yaml asks for it before the first job starts."""
    if out is None:
        raise refuse("command", "out", "one folder in a sweep, for OUT/<job number>", None, "add out=FOLDER")
    if is_url(out):
        return "."
    folder = path_given("command", "out", out)
    if folder.is_dir() and not (folder / _OF_SWEEP).is_file() and any(path.is_file() for path in folder.iterdir()):
        raise refuse(
            "command", "out", "a folder of its own in a sweep", str(folder), "it holds other files, name another"
        )
    if any(place.is_file() for place in (folder, *folder.parents)):
        raise refuse("command", "out", "a folder", str(folder), "a file stands there, choose another name")
    return str(folder)


# Hydra makes a folder for each job itself; for a URL it gets the working folder, which is there.
OmegaConf.register_new_resolver("sweep_folder", _sweep_folder, replace=True)
OmegaConf.register_new_resolver("sweep_job", lambda out, number: "." if is_url(out) else str(number), replace=True)
