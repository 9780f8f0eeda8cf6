"""A twin from the command line: ``indexer twin healthy=FILES machine=YAML out=DIR``."""

from __future__ import annotations

import dataclasses
import logging
import time
from typing import Any

from discrepancy.subjects.from_config import indexer_subject
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder
from indexer_cli.words import plain_console
from indexer_env.build import from_mapping
from indexer_env.errors import IndexerError
from indexer_env.units import RPM
from twin.faults import FAULTS
from twin.settings import Settings

_log = logging.getLogger(__name__)

_STAGES = {
    "calibrate": "calibrate and extend the machine", "data": "simulate machines with faults",
    "learn": "learn from them",
    "detect": "find out what will be seen", "check": "check on healthy turns held out", "report": "write the report",
}  # fmt: skip


def bench_of(config: dict[str, Any]) -> Any:
    """The healthy records of a configuration, checked.

    Raises
    ------
    IndexerError
        One sentence: what keeps them from being used.
    """
    from twin.bench import Bench

    keys = ("machine", "sensor", "records", "held_out", "known", "pulse", "check_motion")
    try:
        subject = indexer_subject({**{key: config[key] for key in keys}, "measured": config["healthy"]})
    except IndexerError as error:
        raise type(error)(in_words(str(error), "healthy")) from None
    return Bench(subject)


def with_its_effects(bench: Any) -> Any:
    """The bench with those effects of its drawing free that a fault of the table makes grow: about what the drawing
    says they are fitted and drawn with the machine's own parameters, and their growth is told."""
    from discrepancy.subjects.indexer import IndexerSubject
    from twin.freed import freed

    subject, effects = bench.subject, {fault.effect for fault in FAULTS.values()}
    rows = [
        {"effect": one.name, "values": {f.name: getattr(one, f.name) for f in dataclasses.fields(one)}}
        for one in subject.machine.effects
        if one.name in effects and not one.is_null
    ]
    if not rows:
        return bench
    plain, known = freed(subject.machine, rows)
    freer = IndexerSubject(plain, subject.sensor, subject.records, subject.uncertainty, known)
    return dataclasses.replace(bench, subject=freer)


def in_words(sentence: str, key: str) -> str:
    """A sentence about records with the keys of a twin's command, whose `key` names them."""
    own = sentence.replace("discrepancy.measured", f"twin.{key}").replace("discrepancy.", "twin.")
    return own.replace("measured='", f"{key}='")


def run(config: dict[str, Any]) -> dict[str, Any]:
    """The command, given its configuration as in conf/twin.yaml."""
    from twin.advice import beforehand, beyond
    from twin.make import Maker

    names = {field.name for field in dataclasses.fields(Settings)}
    settings = from_mapping(Settings, {key: value for key, value in config.items() if key in names}, "twin")
    bench = with_its_effects(bench_of(config))
    maker = Maker(bench, settings, job_folder("twin", config["out"]), overwrite=config["overwrite"])
    recorded = [(point.motor_speed / RPM, point.load_torque) for point in bench.points]
    speeds, loads = zip(*recorded, strict=True)
    asked = settings.motor_speed_rpm or speeds, settings.load_torque or loads
    ends = [(min(values), max(values)) for values in asked]
    for sentence in (*beforehand(speeds, asked[0]), *beyond(recorded, *ends)):
        plain_console().print(sentence)
    return made(maker)


def made(maker: Any) -> dict[str, Any]:
    """Make the twin of a `Maker` and say what it is."""
    from twin.make import STAGES

    started, spent = time.perf_counter(), time.process_time()
    check = maker.make(lambda stage: _log.info("%d of %d: %s", STAGES.index(stage) + 1, len(STAGES), _STAGES[stage]))
    console = plain_console()
    for sentence in (*maker.sentences(), check.reason):
        console.print(sentence)
    seconds, cpu = time.perf_counter() - started, time.process_time() - spent
    console.print(f"written {maker.out} in {seconds:.0f} s, {cpu:.0f} s of processor time; see report.html")
    return {"trusted": check.trusted}


main = hydra_command("twin")(run)

if __name__ == "__main__":
    main()
