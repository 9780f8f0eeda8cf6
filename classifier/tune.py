"""Settings sought by trials: ``indexer tune data=DIR out=DIR [trials=30 ...]``; needs the extra [tune].

Each trial is a training whose settings Optuna proposes by the results of the earlier ones; the control error decides,
the validation subset is only scored.
"""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Mapping
from typing import Any

import torch
import yaml

from classifier.dataset import Dataset, load_dataset
from classifier.job import Job
from classifier.model import MODEL_TENSORS, MODEL_YAML, save_model
from classifier.runs import RUNS, row_of, write_runs
from classifier.train import Result
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, place_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.words import plain_console
from indexer_env.checks import check_choice, check_integer, check_number, did_you_mean
from indexer_env.errors import IndexerError, ParameterError, refuse
from indexer_env.presets import config_dir

BEST = "best.yaml"
FILES = (RUNS, BEST, MODEL_YAML, MODEL_TENSORS)
"""All that the command leaves in its folder: the trials, the settings of the best one and its model."""

GROUPS = ("features", "net", "trainer")
"""Keys whose values are choices of conf/, by their name."""


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/tune.yaml."""
    out = check_output_folder(job_folder("tune", config["out"]), FILES, config["overwrite"])
    for name in ("trials", "threads"):
        check_integer("tune", name, config[name], low=1)
    check_integer("tune", "seed", config["seed"], low=0, high=2**32 - 1)
    optuna = _optuna()
    search = check_search(config["search"], config)
    Job.of(config)
    torch.set_num_threads(config["threads"])
    dataset = load_dataset(place_given("tune", "data", config["data"]))
    console = plain_console()
    rows, (error, tried, result) = _sought(config, search, dataset, optuna, console.print)
    with output_folder(out, FILES, config["overwrite"]) as folder:
        write_runs(rows, folder / RUNS)
        (folder / BEST).write_text(yaml.safe_dump(_kept(tried), sort_keys=False), encoding="utf-8")
        save_model(result.model, folder)
    validation = result.score("validation")
    for text in result.model.shortcomings():
        console.print(text)
    console.print(
        f"best: control error {error:.4g} %, validation error {validation.mse_percent:.4g} %, "
        f"misclassified {validation.misclassified_percent:.3g} %; written {out}"
    )


def _sought(
    config: Mapping[str, Any], search: Mapping[str, Any], dataset: Dataset, optuna: Any, say: Callable[[str], None]
) -> tuple[list[dict[str, Any]], tuple[float, dict[str, Any], Result]]:
    """Rows of all trials, and control error, settings and result of the best; those until it is interrupted.

    Raises ParameterError where all are refused: what one cannot be with this data is no answer to the others.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=config["seed"]))
    rows, best, refused = [], None, ""
    try:
        for number in range(config["trials"]):
            trial, started = study.ask(), time.perf_counter()
            settings = {path: propose(trial, path, space) for path, space in search.items()}
            told = _told(settings)
            tried = applied(config, settings)
            try:
                result = Job.of(tried).train(dataset)
            except ParameterError as problem:
                study.tell(trial, state=optuna.trial.TrialState.FAIL)
                refused = f"trial {number} ({told}): {problem}"
                say(f"refused, {refused}")
                continue
            error = result.score("control").mse_percent
            study.tell(trial, error)
            rows.append(row_of(result, _kept(tried), str(number), time.perf_counter() - started))
            if best is None or error < best[0]:
                best = (error, tried, result)
            say(f"trial {number}: control error {error:.4g} % ({told})")
    except KeyboardInterrupt:
        if best is None:
            raise
        say(f"interrupted after {len(rows)} trials, which are written")
    if best is None:
        raise ParameterError(f"every trial was refused, the last one: {refused}")
    return rows, best


def _told(settings: Mapping[str, Any]) -> str:
    shown = {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in settings.items()}
    return ", ".join(f"{key}={value}" for key, value in shown.items())


def check_search(search: object, config: Mapping[str, Any]) -> dict[str, Any]:
    """The ranges and choices in which settings are sought, by dotted key: ``{low: …, high: …, log: false}`` of whole or
    other numbers, or ``{choices: […]}``.

    Raises ParameterError for a key that the configuration does not have and for a range or choice that is none.
    """
    if not isinstance(search, Mapping) or not search:
        raise refuse("tune", "search", "a mapping of settings to ranges or choices", search)
    for path, space in search.items():
        _check_key(str(path), config)
        owner = f"search.{path}"
        if not isinstance(space, Mapping):
            raise refuse("tune", owner, "{low: NUMBER, high: NUMBER} or {choices: [VALUE, ...]}", space)
        unknown = sorted(set(space) - ({"choices"} if "choices" in space else {"low", "high", "log"}))
        if unknown:
            raise refuse("tune", owner, "of the keys low, high and log, or of choices alone", unknown[0])
        if "choices" in space:
            _check_choices(str(path), space["choices"])
        else:
            _check_range(owner, space)
    return {str(path): space for path, space in search.items()}


def _check_key(path: str, config: Mapping[str, Any]) -> None:
    group, _, key = path.partition(".")
    keys = [f"{name}.{key}" for name in GROUPS for key in config[name] if key != "kind"]
    known = [*GROUPS, *keys, "restarts", "seed"]
    # A trial may choose another rule than the configuration holds, whose own keys are then known.
    if path not in known and not (group in GROUPS and any(key in _choice(group, name) for name in _names(group))):
        raise refuse("tune", "search", f"settings such as {', '.join(known)}", path, did_you_mean(path, known))


def _check_choices(path: str, choices: object) -> None:
    if not isinstance(choices, list) or not choices:
        raise refuse("tune", f"search.{path}.choices", "a list of values", choices)
    for value in choices:
        if path in GROUPS:
            check_choice("tune", f"search.{path}.choices", value, _names(path))


def _check_range(owner: str, space: Mapping[str, Any]) -> None:
    for end in ("low", "high"):
        check_number("tune", f"{owner}.{end}", space.get(end))
    if space["low"] >= space["high"]:
        raise refuse("tune", f"{owner}.low", f"below high = {space['high']}", space["low"])
    if not isinstance(space.get("log", False), bool):
        raise refuse("tune", f"{owner}.log", "true or false", space["log"])
    if space.get("log") and space["low"] <= 0:
        raise refuse("tune", f"{owner}.low", "> 0 on a logarithmic scale", space["low"])


def propose(trial: Any, path: str, space: Mapping[str, Any]) -> Any:
    """The value that a trial proposes for a setting; a whole number where both ends of its range are."""
    if "choices" in space:
        return trial.suggest_categorical(path, space["choices"])
    low, high, log = space["low"], space["high"], space.get("log", False)
    whole = isinstance(low, int) and isinstance(high, int)
    return (trial.suggest_int if whole else trial.suggest_float)(path, low, high, log=log)


def applied(config: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The configuration with these settings; choices of conf/ first, so that others change what they brought. A setting
    of another choice than the one that is proposed is left out."""
    tried = copy.deepcopy(dict(config))
    for path in sorted(settings, key=lambda path: "." in path):
        group, _, key = path.partition(".")
        if path in GROUPS:
            tried[path] = _choice(path, settings[path])
        elif not key:
            tried[path] = settings[path]
        elif key in tried[group]:
            tried[group][key] = settings[path]
    return tried


def _kept(tried: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in tried.items() if key not in ("search", "trials", "out", "overwrite")}


def _names(group: str) -> list[str]:
    return sorted(path.stem for path in (config_dir() / group).glob("*.yaml"))


def _choice(group: str, name: str) -> dict[str, Any]:
    return yaml.safe_load((config_dir() / group / f"{name}.yaml").read_text(encoding="utf-8"))


def _optuna() -> Any:
    try:
        import optuna
    except ModuleNotFoundError as error:
        if error.name != "optuna":
            raise
        raise IndexerError(
            "classifier.tune must have the package optuna, got none; run: pip install 'indexer-diagnosis[tune]'."
        ) from None
    return optuna


main = hydra_command("tune")(run)

if __name__ == "__main__":
    main()
