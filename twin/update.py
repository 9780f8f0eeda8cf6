"""A twin brought up to date from the command line: ``indexer twin-update twin=DIR healthy=FILES out=DIR``."""

from __future__ import annotations

import dataclasses
from typing import Any

from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, path_given
from indexer_env.build import from_mapping
from indexer_env.errors import refuse
from indexer_env.presets import load_yaml
from twin.__main__ import bench_of, made
from twin.settings import Settings


def run(config: dict[str, Any]) -> dict[str, Any]:
    """The command, given its configuration as in conf/twin-update.yaml."""
    from discrepancy.subjects.indexer import IndexerSubject
    from twin.bench import Bench
    from twin.folder import about_of, machine_and_sensor
    from twin.freed import freed, of_machine
    from twin.make import Maker

    folder, out = path_given("twin", "twin", config["twin"]), job_folder("twin", config["out"])
    about = about_of(folder)
    if folder.resolve() == out.resolve():
        raise refuse("twin", "out", "another folder than the twin's", str(out), "the old twin stays as it is")
    _, sensor = machine_and_sensor(folder)
    machine = load_yaml("machine", folder / "machine.yaml")
    uncertainty = {name: float(spread) for name, spread in about["calibration"]["spread"].items() if spread <= 1.0}
    prior = {**config, "machine": {**machine, "uncertainty": uncertainty}, "sensor": dataclasses.asdict(sensor)}
    settings = from_mapping(Settings, about["settings"], "twin")
    found = [row for row in about["calibration"]["findings"] if of_machine(row)]
    subject = bench_of(prior).subject
    plain, known = freed(subject.machine, found)
    bench = Bench(IndexerSubject(plain, subject.sensor, subject.records, subject.uncertainty, known))
    return made(Maker(bench, settings, out, overwrite=config["overwrite"], before=folder))


main = hydra_command("twin-update")(run)

if __name__ == "__main__":
    main()
