"""What all commands of the project share: a Hydra entry point whose every error is one sentence.

`hydra_command("datagen")` reads `datagen.yaml` in the project's configuration folder and gives back a
`main()` that works as a console script and under `python -m`. Exit codes: 0 done, 1 done and something found
that should not be (commands that compare: a difference; a diagnosis: nothing guards its model), 2 bad input (one line
on stderr, in a sweep one for each failed job), 130 stopped from the keyboard. With the environment variable
HYDRA_FULL_ERROR=1 the traceback is shown instead of the sentence.
"""

from __future__ import annotations

import functools
import os
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import InterpolationToMissingValueError, MissingMandatoryValue, OmegaConfBaseException

import indexer_cli.job_paths  # noqa: F401  (registers what conf/command.yaml asks for)
from indexer_cli.__main__ import version
from indexer_cli.arguments import check_sweep, file_behind, flags_first, malformed, root_keys, with_files, with_key
from indexer_cli.manual import manual
from indexer_cli.pipe import forgiving_output
from indexer_cli.sweep import outcome
from indexer_cli.typed_keys import as_typed, dotted
from indexer_cli.words import BAD_INPUT, stop_for
from indexer_env.checks import check_choice, closest, did_you_mean
from indexer_env.errors import IndexerError, ParameterError, refuse
from indexer_env.laws import LAWS
from indexer_env.presets import config_dir

DIFFERENT = 1
INTERRUPTED = 130

_FULL_ERROR = "HYDRA_FULL_ERROR"

_T = TypeVar("_T")

Task = Callable[[dict[str, Any]], Mapping[str, Any] | None]
"""Does the work of a verb on its composed configuration; may return results by name for the table of a sweep."""


def hydra_command(config_name: str, positional: str | None = None) -> Callable[[Task], Callable[[], None]]:
    """Decorate `task(config)` into the `main()` of a command configured by `<config_name>.yaml`.

    `positional` is the key whose value may stand alone as the first argument: `check FOLDER` for `check data=FOLDER`.

    The task receives the composed configuration as plain dicts and lists, interpolations resolved and nothing
    missing. In a sweep (`-m`) a job that fails does not stop those after it: each says its sentence, and the
    command ends with the greatest of their exit codes.
    """

    def decorate(task: Task) -> Callable[[], None]:
        traceback_wanted = composed = False
        worst = 0
        started_in = os.getpid()

        @functools.wraps(task)
        def job(config: DictConfig) -> dict[str, Any]:
            nonlocal composed, worst
            composed = True
            if traceback_wanted:
                return outcome(task(_plain(config, config_name)))
            # Handed back to Hydra, an error would be printed with the job's overrides before `main` has it.
            try:
                return outcome(_reported(lambda: task(_plain(config, config_name)), config_name, config))
            except SystemExit as stop:
                if stop.code not in (DIFFERENT, BAD_INPUT) or HydraConfig.get().mode is not RunMode.MULTIRUN:
                    raise
                worst = max(worst, stop.code)
                reason = next(iter(getattr(stop, "__notes__", [])), f"ended with exit code {stop.code}, see --help")
                # A launcher may run the job in another process; only an exception gets back from there.
                if os.getpid() != started_in:
                    raise IndexerError(f"Job {HydraConfig.get().job.num} of the sweep has failed: {reason}") from None
                return outcome(reason=reason)

        composed_job = hydra.main(version_base="1.3", config_path=str(config_dir()), config_name=config_name)(job)

        def command() -> None:
            check_sweep(sys.argv[1:], config_name)
            with tempfile.TemporaryDirectory() as given:
                sys.argv = [sys.argv[0], *with_files(sys.argv[1:], Path(given))]
                composed_job()

        @functools.wraps(task)
        @forgiving_output()
        def main() -> None:
            nonlocal traceback_wanted, composed, worst, started_in
            composed, worst = False, 0
            started_in = os.getpid()
            traceback_wanted = os.environ.get(_FULL_ERROR) == "1"
            sys.argv = [sys.argv[0], *with_key(positional, flags_first(sys.argv[1:]))]
            if traceback_wanted:
                command()
                return
            if _answered(config_name):
                return
            # Hydra prints what it catches and leaves with code 1, unless this makes it hand errors on.
            before = os.environ.pop(_FULL_ERROR, None)
            os.environ[_FULL_ERROR] = "1"
            try:
                _reported(command, config_name)
            except (ValueError, TypeError) as error:
                # Hydra refuses some malformed overrides so; in a running job it is a defect.
                if composed:
                    raise
                stop_for(_one_line(malformed(error, sys.argv[1:])))
            finally:
                del os.environ[_FULL_ERROR]
                if before is not None:
                    os.environ[_FULL_ERROR] = before
            if worst:
                raise SystemExit(worst)

        vars(main).update(config_name=config_name, positional=positional)
        return main

    return decorate


def check_flag(command: str, key: str, value: object) -> None:
    """Refuse what is not true or false."""
    if not isinstance(value, bool):
        raise refuse(command, key, "true or false", value)


def _bare(word: str, given: list[str]) -> str:
    """What to do about a word without =, among the words given: a value lacks its key, or a key its value."""
    at = given.index(word) if word in given else len(given)
    if at + 1 < len(given) and "." in word and "=" not in given[at + 1]:
        return f"write {word}={given[at + 1]}"
    return f"write the key in front of it, KEY={word}"


def explain(error: Exception, config_name: str, config: DictConfig | None = None) -> str:
    """One sentence for an error of the project, of Hydra's composition or of OmegaConf, which names parameters by their
    keys in the composed configuration, where there is one."""
    plain = {} if config is None else OmegaConf.to_container(config)
    assert isinstance(plain, dict)
    keys = dotted(plain) | set(root_keys(config_name))
    said = as_typed(_explained(error, config_name), config_name, keys, getattr(error, "out_of_range", None))
    file = file_behind(said) if isinstance(error, ParameterError) else ""
    return f"{file}: {said}" if file else said


def _explained(error: Exception, config_name: str) -> str:
    if isinstance(error, IndexerError):
        return str(error)
    if isinstance(error, InterpolationToMissingValueError):
        return f"{error.full_key or 'a key'} refers to a key without a value ({_one_line(str(error))[:-1]})."
    if isinstance(error, MissingConfigException):
        return _missing_config(error)
    if isinstance(error, OverrideParseException):
        remedy = "quote values with other signs than letters, digits and ._-/ twice: KEY='\"VALUE\"'"
        if "=" in sys.argv[1:] or any(len(word) > 1 and word[0] == "=" for word in sys.argv[1:]):
            remedy = "leave out the spaces beside ="
        elif any(sign in str(error.override) for sign in "{["):
            remedy = "put the whole pair into single quotes, 'KEY={NAME: VALUE}' or 'KEY=[VALUE, VALUE]'"
        elif "=" not in str(error.override):
            remedy = _bare(str(error.override), sys.argv[1:])
        return f"the command line must hold KEY=VALUE pairs, got {error.override!r}; {remedy}."
    if isinstance(error, MissingMandatoryValue):
        key = error.full_key or _one_line(str(error)).rsplit(" ", 1)[-1]
        return f"{key} must be given; add {key}=VALUE to the command."
    text = str(error)
    if found := re.match(r"ParameterError raised while resolving interpolation: (.+)", text):
        return found[1]
    if found := re.search(r"You must specify '([^']+)'", text):
        options = [line.strip() for line in text.splitlines() if line.startswith("\t")]
        return _missing_group(found[1], options)
    if found := re.search(r"Could not override '([^']+)'", text):
        return _unknown_key(found[1], error, config_name)
    if found := re.match(r"Error merging override (.+)", text):
        key, _, value = found[1].partition("=")
        return f"{key} must be of the kind that it is in the configuration, got {value}; see {config_dir()}."
    if found := re.match(r"Ambiguous value for argument '([^=]+)=(.*)'", text):
        remedy = "write it in [] for a list, in quotes for a text, or add -m to sweep over it"
        if re.fullmatch(r"[+-]?\d+,\d+", found[2]):
            remedy = f"write {found[2].replace(',', '.')} with a decimal point, or {remedy}"
        return f"{found[1]} must be one value, got {found[2]!r}; {remedy}."
    return _one_line(text)


def _reported(action: Callable[[], _T], config_name: str, config: DictConfig | None = None) -> _T:
    try:
        return action()
    except KeyboardInterrupt as stop:
        print(": ".join(["stopped from the keyboard", *map(str, stop.args)]), file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
    except (IndexerError, HydraException, OmegaConfBaseException) as error:
        stop_for(explain(error, config_name, config))
    except OSError as error:
        where = f"{error.filename} " if error.filename else "a file "
        stop_for(f"{where}cannot be used ({error.strerror or error}); check the path, its permissions and the disk.")
    except MemoryError as error:
        # numpy's sentence says how much was asked for; Python's own is empty.
        stop_for(f"the job must fit into memory, but {error or 'it does not'}; ask for fewer or shorter records.")


def _answered(config_name: str) -> bool:
    """True for --help and --version, of which Hydra would tell its own; an unknown flag is refused, for which
    Hydra would take eight lines."""
    if "--version" in sys.argv[1:]:
        print(f"indexer {version()}")
        return True
    flags, unknown = get_args_parser().parse_known_args()
    if unknown:
        stop_for(f"the command line must hold KEY=VALUE pairs, got {unknown[0]!r}; see --help for the keys.")
    if flags.help:
        print(manual(config_name))
    return flags.help


def _plain(config: DictConfig, config_name: str) -> dict:
    plain = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    assert isinstance(plain, dict)
    known = root_keys(config_name)
    # What `+key` adds and `~key` takes away is for Hydra to accept and for no command to see.
    for key in plain:
        check_choice(config_name, "key", key, known)
    for key in known:
        if key not in plain:
            raise refuse(config_name, key, "there, as every key of the configuration", None, f"leave out ~{key}")
    return {str(key): value for key, value in plain.items()}


def _missing_config(error: MissingConfigException) -> str:
    missing = str(error.missing_cfg_file or "")
    if not error.options or "/" not in missing:
        return _one_line(str(error))
    group, _, choice = missing.rpartition("/")
    options = list(error.options)
    first, _, path = missing.partition("/")
    if "/" in path and (config_dir() / first).is_dir():
        group, choice, options = first, path, sorted(one.stem for one in (config_dir() / first).glob("*.yaml"))
    file = " or a file that ends in .yaml" if (config_dir() / group).is_dir() else ""
    remedy = _beside(choice) or _remedy(choice, options)
    return f"{group} must be one of {', '.join(options)}{file}, got {choice!r}{remedy}."


def _beside(choice: str) -> str:
    """The remedy for a choice that is a file's path but for its ending; empty where no such file is there."""
    files = (Path(choice).with_suffix(ending) for ending in (".yaml", ".yml")) if Path(choice).name else ()
    return next((f"; did you mean '{file}'" for file in files if file.is_file()), "")


def _missing_group(group: str, options: list[str]) -> str:
    given = [argument.partition("=")[0] for argument in sys.argv[1:] if "=" in argument]
    if group not in given and (hint := closest(group, given, likeness=0.7)):
        return f"{hint} must be a known key, got an unknown one; did you mean {group!r}."
    return f"{group} must be given; add {group}=NAME to the command, NAME one of {', '.join(options)}."


def _unknown_key(key: str, error: Exception, config_name: str) -> str:
    cause = error.__cause__
    node = getattr(cause, "parent_node", None)
    if isinstance(node, DictConfig):
        # The unknown key may stand in the command line's key or in a mapping given as its value.
        name, steps = str(getattr(cause, "key", "")), key.split(".")
        owner = ".".join(steps[: steps.index(name)]) if name in steps else key
        known = [str(entry) for entry in node if entry != "hydra" or owner]
    else:
        owner, name = "", key
        known = root_keys(config_name)
    full = f"{owner}.{name}" if owner else name
    known_keys = f"known: {', '.join(sorted(known))}" if known else f"write +{key}=VALUE to add it"
    hint = did_you_mean(name, known) or known_keys
    if name in LAWS and any(one in LAWS for one in known):
        hint = f"another law stands there; to replace it, give ~{owner} and '+{owner}={{{name}: …}}'"
    return f"{full} must be a key of {owner or config_name}, got an unknown key; {hint}."


def _remedy(name: str, known: Iterable[str]) -> str:
    hint = did_you_mean(name, known)
    return f"; {hint}" if hint else ""


def _one_line(text: str) -> str:
    text = text.partition("\nConfig search path")[0]
    sentence = "; ".join(line.strip() for line in text.splitlines() if line.strip())
    return sentence if sentence.endswith(".") else f"{sentence}."
