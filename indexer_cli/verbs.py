"""The verbs of `indexer`: which function does the work of each."""

from __future__ import annotations

import importlib.util
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Verb:
    """A verb.

    Attributes
    ----------
    name : str
        As typed; conf/<name>.yaml holds its keys and the text of its help page.
    module : str
        Module whose `main()` does the work; `python -m` runs it, too.
    group : str
        Heading under which the verb is listed.
    words : tuple of str
        What may stand on its line without a key; a path apart.
    writes_file : bool
        Whether its `out` is one file and no folder, which could hold the jobs of a sweep.
    """

    name: str
    module: str
    group: str
    words: tuple[str, ...] = ()
    writes_file: bool = False


VERBS = {
    verb.name: verb
    for verb in (
        Verb("simulate", "datagen.simulate", "Simulate"),
        Verb("new", "datagen.new", "Simulate", ("machine",), writes_file=True),
        Verb("generate", "datagen", "Data"),
        Verb("ingest", "datagen.ingest", "Data"),
        Verb("check", "datagen.check", "Data"),
        Verb("remake", "datagen.remake", "Data", writes_file=True),
        Verb("publish", "datagen.publish", "Data"),
        Verb("train", "classifier", "Learn and diagnose"),
        Verb("tune", "classifier.tune", "Learn and diagnose"),
        Verb("diagnose", "classifier.diagnose", "Learn and diagnose"),
        Verb("transfer", "classifier.transfer", "Learn and diagnose"),
        Verb("leaveout", "classifier.leaveout", "Learn and diagnose"),
        Verb("export", "classifier.export", "Learn and diagnose", writes_file=True),
        Verb("monitor", "monitor", "Watch"),
        Verb("explain", "discrepancy", "Find what a model lacks"),
        Verb("twin", "twin", "Your own machine"),
        Verb("twin-update", "twin.update", "Your own machine"),
        Verb("twin-diagnose", "twin.diagnose", "Your own machine"),
        Verb("compare", "indexer_experiments.compare", "Experiments"),
        Verb("study", "indexer_experiments.study", "Experiments"),
        Verb("challenge", "indexer_experiments.challenge", "Experiments"),
    )
}


def can_sweep(name: str, keys: Collection[str]) -> bool:
    """Whether a command with these keys can be run as a sweep: its `out` is a folder, which then holds the jobs'."""
    return "out" in keys and not (name in VERBS and VERBS[name].writes_file)


def config_folder() -> Path:
    """The folder of YAML files, found without importing the simulator: `indexer_env.presets.config_dir`, which a test
    holds beside it, takes as long as loading numpy."""
    found = importlib.util.find_spec("indexer_env")
    assert found is not None and found.origin is not None
    inside = Path(found.origin).parent / "conf"
    return inside if inside.is_dir() else inside.parent.parent / "conf"
