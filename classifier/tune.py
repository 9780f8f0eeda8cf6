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
from indexer_cli.typed_keys import dotted
from indexer_cli.words import joined, plain_console
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
            tried = applied(config, settings)
            told = _told(settings, tried)
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


def _told(settings: Mapping[str, Any], tried: Mapping[str, Any]) -> str:
    """The settings in words, without those that this trial does not have."""
    shown = {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in settings.items()}
    had = dotted(tried)
    return ", ".join(f"{key}={value}" for key, value in shown.items() if key in had)


def check_search(search: object, config: Mapping[str, Any]) -> dict[str, Any]:
    """The ranges and choices in which settings are sought, by dotted key: ``{low: …, high: …, log: false}`` of whole or
    other numbers, or ``{choices: […]}``.

    Raises ParameterError for a key that the configuration does not have and for a range or choice that is none.
    """
    if not isinstance(search, Mapping) or not search:
        raise refuse("tune", "search", "a mapping of settings to ranges or choices", search)
    found = {str(path): space for path, space in search.items()}
    for path, space in found.items():
        _check_space(path, space)
    for path in found:
        _check_key(path, found, config)
    return found


def _check_space(path: str, space: object) -> None:
    owner = f"search.{path}"
    if not isinstance(space, Mapping):
        raise refuse("tune", owner, "{low: NUMBER, high: NUMBER} or {choices: [VALUE, ...]}", space)
    listed = "choices" in space or path in GROUPS
    unknown = sorted(set(space) - ({"choices"} if listed else {"low", "high", "log"}))
    if unknown:
        rule = "of choices alone" if path in GROUPS else "of the keys low, high and log, or of choices alone"
        raise refuse("tune", owner, rule, unknown[0])
    if listed:
        _check_choices(path, space.get("choices"))
    else:
        _check_range(owner, space)


def _check_key(path: str, search: Mapping[str, Any], config: Mapping[str, Any]) -> None:
    """Refuse a setting that no trial has: a choice that none makes has keys of its own."""
    group, _, key = path.partition(".")
    tried = {
        name: [_choice(name, choice) for choice in search[name]["choices"]] if name in search else [config[name]]
        for name in GROUPS
    }
    keys = dict.fromkeys(f"{name}.{key}" for name in GROUPS for one in tried[name] for key in one if key != "kind")
    known = [*GROUPS, *keys, "restarts", "seed"]
    if path in known:
        return
    if elsewhere := [name for name in (_names(group) if group in GROUPS else ()) if key in _choice(group, name)]:
        rule = f"settings that some trial has (this one is of {group}={joined(elsewhere, 'or')})"
        raise refuse("tune", "search", rule, path, "for a search without it write ~search '+search={…}'")
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
    """The configuration with these settings; choices of conf/ first, so that others change what they brought. What the
    configuration gives a choice in place of conf's own value goes with it to another that has the key; a setting of
    another choice than the one that is proposed is left out."""
    tried = copy.deepcopy(dict(config))
    for path in sorted(settings, key=lambda path: "." in path):
        group, _, key = path.partition(".")
        if path in GROUPS:
            tried[path] = _choice(path, settings[path]) | _carried(path, tried[path], settings[path])
        elif not key:
            tried[path] = settings[path]
        elif key in tried[group]:
            tried[group][key] = settings[path]
    return tried


def _carried(group: str, held: Mapping[str, Any], name: str) -> dict[str, Any]:
    """What a choice holds that is not conf's own value, of the keys that the choice `name` has too."""
    own, other = _choice(group, held.get("kind", name)), _choice(group, name)
    return {key: value for key, value in held.items() if key in other and key != "kind" and own.get(key) != value}


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
