"""What all commands of the project share: a Hydra entry point whose every error is one sentence.

`hydra_command("datagen")` reads `datagen.yaml` in the project's configuration folder and gives back a
`main()` that works as a console script and under `python -m`. Exit codes: 0 done, 2 bad input (one line on
stderr), 130 stopped from the keyboard. With the environment variable HYDRA_FULL_ERROR=1 the traceback is
shown instead of the sentence.
"""

from __future__ import annotations

import difflib
import functools
import os
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NoReturn

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException

from indexer_env.checks import did_you_mean
from indexer_env.errors import IndexerError
from indexer_env.presets import config_dir

BAD_INPUT = 2
INTERRUPTED = 130

_FULL_ERROR = "HYDRA_FULL_ERROR"


def hydra_command(config_name: str) -> Callable[[Callable[[dict], None]], Callable[[], None]]:
    """Decorate `task(config: dict)` into the `main()` of a command configured by `<config_name>.yaml`.

    The task receives the composed configuration as plain dicts and lists, interpolations resolved and nothing
    missing. In a sweep (`-m`) a job that fails does not stop those after it; the command ends with the first
    error.
    """

    def decorate(task: Callable[[dict], None]) -> Callable[[], None]:
        traceback_wanted = composed = False

        @functools.wraps(task)
        def job(config: DictConfig) -> None:
            nonlocal composed
            composed = True
            if traceback_wanted or HydraConfig.get().mode is RunMode.MULTIRUN:
                task(_plain(config))
                return
            # Handed back to Hydra, an error would be printed with the job's overrides before `main` has it.
            _reported(lambda: task(_plain(config)), config_name)

        command = hydra.main(version_base="1.3", config_path=str(config_dir()), config_name=config_name)(job)

        @functools.wraps(task)
        def main() -> None:
            nonlocal traceback_wanted, composed
            composed = False
            traceback_wanted = os.environ.get(_FULL_ERROR) == "1"
            if traceback_wanted:
                command()
                return
            # Hydra prints what it catches and leaves with code 1, unless this makes it hand errors on.
            before = os.environ.pop(_FULL_ERROR, None)
            os.environ[_FULL_ERROR] = "1"
            try:
                _reported(command, config_name)
            except ValueError as error:
                # Hydra refuses some malformed overrides so; in a running job it is a defect.
                if composed:
                    raise
                _refuse(_one_line(str(error)))
            finally:
                del os.environ[_FULL_ERROR]
                if before is not None:
                    os.environ[_FULL_ERROR] = before

        return main

    return decorate


def job_folder(out: object) -> Path:
    """The folder a job writes to: `out` itself, or `out/<job number>` for each job of a sweep (`-m`)."""
    if HydraConfig.initialized() and HydraConfig.get().mode is RunMode.MULTIRUN:
        return Path(HydraConfig.get().runtime.output_dir)
    return Path(str(out))


def explain(error: Exception, config_name: str) -> str:
    """One sentence for an error of the project, of Hydra's composition or of OmegaConf."""
    if isinstance(error, IndexerError):
        return str(error)
    if isinstance(error, MissingConfigException):
        return _missing_config(error)
    if isinstance(error, OverrideParseException):
        remedy = "quote values with spaces, commas or brackets"
        return f"the command line must hold KEY=VALUE pairs, got {error.override!r}; {remedy}."
    if isinstance(error, MissingMandatoryValue):
        key = error.full_key or _one_line(str(error)).rsplit(" ", 1)[-1]
        return f"{key} must be given; add {key}=VALUE to the command."
    text = str(error)
    if found := re.search(r"You must specify '([^']+)'", text):
        options = [line.strip() for line in text.splitlines() if line.startswith("\t")]
        return _missing_group(found[1], options)
    if found := re.search(r"Could not override '([^']+)'", text):
        return _unknown_key(found[1], error, config_name)
    return _one_line(text)


def _reported(action: Callable[[], object], config_name: str) -> None:
    try:
        action()
    except KeyboardInterrupt:
        print("stopped from the keyboard", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
    except (IndexerError, HydraException, OmegaConfBaseException) as error:
        _refuse(explain(error, config_name))


def _refuse(sentence: str) -> NoReturn:
    print(f"error: {sentence}", file=sys.stderr)
    raise SystemExit(BAD_INPUT) from None


def _plain(config: DictConfig) -> dict:
    plain = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    assert isinstance(plain, dict)
    return {str(key): value for key, value in plain.items()}


def _missing_config(error: MissingConfigException) -> str:
    missing = str(error.missing_cfg_file or "")
    if not error.options or "/" not in missing:
        return _one_line(str(error))
    group, _, choice = missing.rpartition("/")
    options = list(error.options)
    return f"{group} must be one of {', '.join(options)}, got {choice!r}{_remedy(choice, options)}."


def _missing_group(group: str, options: list[str]) -> str:
    given = [argument.partition("=")[0] for argument in sys.argv[1:] if "=" in argument]
    if group not in given and (hint := difflib.get_close_matches(group, given, n=1, cutoff=0.7)):
        return f"{hint[0]} must be a known key, got an unknown one; did you mean {group!r}."
    return f"{group} must be given; add {group}=NAME to the command, NAME one of {', '.join(options)}."


def _unknown_key(key: str, error: Exception, config_name: str) -> str:
    cause = error.__cause__
    node = getattr(cause, "parent_node", None)
    if isinstance(node, DictConfig):
        # The unknown key may stand in a mapping given as the value; the command line's key is then its owner.
        name = str(getattr(cause, "key", key.rpartition(".")[2]))
        owner = key if name != key.rpartition(".")[2] else key.rpartition(".")[0]
        known = [str(entry) for entry in node]
    else:
        owner, name = "", key
        known = _root_keys(config_name)
    full = f"{owner}.{name}" if owner else name
    known_keys = f"known: {', '.join(sorted(known))}" if known else f"write +{key}=VALUE to add it"
    hint = did_you_mean(name, known) or known_keys
    return f"{full} must be a key of {owner or config_name}, got an unknown key; {hint}."


def _root_keys(config_name: str) -> list[str]:
    root = OmegaConf.load(config_dir() / f"{config_name}.yaml")
    assert isinstance(root, DictConfig)
    groups = [
        str(key).removeprefix("override ").removeprefix("/")
        for entry in root.get("defaults", [])
        if isinstance(entry, DictConfig)
        for key in entry
    ]
    names = [str(key) for key in root if key != "defaults"] + [group for group in groups if "hydra/" not in group]
    return [name for name in names if name != "hydra"]


def _remedy(name: str, known: Iterable[str]) -> str:
    hint = did_you_mean(name, known)
    return f"; {hint}" if hint else ""


def _one_line(text: str) -> str:
    text = text.partition("\nConfig search path")[0]
    sentence = "; ".join(line.strip() for line in text.splitlines() if line.strip())
    return sentence if sentence.endswith(".") else f"{sentence}."
