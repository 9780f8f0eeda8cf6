"""The cam indexing machine as a subject, from a composed conf/explain.yaml: all that refuses records is here."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from discrepancy.records.experiments import experiments
from discrepancy.records.machine import nominal_machine
from discrepancy.records.quality import check_records
from discrepancy.records.reading import Record, read_records
from discrepancy.subjects.indexer import IndexerSubject
from indexer_cli.command import check_flag
from indexer_cli.job_paths import files_given, path_given, texts_given
from indexer_env.build import from_mapping
from indexer_env.errors import SignalError
from indexer_env.sensors import Sensor
from indexer_records.conditions import Pulse


def indexer_subject(config: dict[str, Any]) -> IndexerSubject:
    """The subject of a configuration.

    Raises
    ------
    ParameterError, SignalError, SimulationError
        What keeps the records or the machine from being used, before any fit.
    """
    check_flag("discrepancy", "check_motion", config["check_motion"])
    machine, uncertainty = nominal_machine(config["machine"])
    sensor = from_mapping(Sensor, config["sensor"], "sensor")
    table = None if config["records"] is None else path_given("discrepancy", "records", config["records"])
    pulse = from_mapping(Pulse, config["pulse"], "pulse")
    measured = files_given("discrepancy", "measured", config["measured"])
    held_out = texts_given("discrepancy", "held_out", config["held_out"], "a list of files, [a.csv,b.csv]")
    records = read_records(measured, table, config["known"], pulse, held_out)
    check_records(records, machine)
    sensor = _with_radius(sensor, records)
    given = experiments(records, machine, sensor, check_motion=config["check_motion"])
    return IndexerSubject(machine, sensor, given, uncertainty)


def _with_radius(sensor: Sensor, records: Sequence[Record]) -> Sensor:
    """The sensor at the radius that the records were taken at. Its rate is theirs: they are thinned as the search
    needs it."""
    stated = [record.conditions.sensor_radius for record in records]
    radii = {sensor.radius if radius is None else radius for radius in stated}
    if len(radii) > 1:
        if None in radii:
            blank = records[stated.index(None)].name
            raise SignalError(f"A sensor_radius must be stated of all records or of none; {blank} has none.")
        got = ", ".join(f"{radius:g}" for radius in sorted(r for r in radii if r is not None))
        raise SignalError(f"All records must be taken at one sensor_radius, got {got} m; explain them apart.")
    return dataclasses.replace(sensor, sample_rate=None, radius=radii.pop())
