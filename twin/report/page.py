"""report.html: one file that opens offline; whether the twin is to be trusted and what it will see come first."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2

from indexer_env.machine import Machine
from twin.advice import advice
from twin.faults import FAULTS
from twin.quantities import meaning_of, shop_of, spread_of, value_of, words_of
from twin.remains import Remains
from twin.report import figures


def page(about: Mapping[str, Any], machine: Machine, remains: Remains) -> str:
    """The page of a twin whose twin.yaml holds `about`."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    faults = about["settings"]["faults"]
    return environment.get_template("page.html").render(
        about=about, name=machine.name, points=_points(about), rows=[_row(about, fault) for fault in faults],
        parameters=[_parameter(row, machine) for row in about["calibration"]["parameters"]], advice=advice(about),
        detection=figures.detection(about["detection"], faults), remains=figures.remains(remains),
        shared=f"{100.0 * remains.shared:.0f} %",
    )  # fmt: skip


def _points(about: Mapping[str, Any]) -> list[tuple[float, float]]:
    return list(dict.fromkeys((row["motor_speed_rpm"], row["load_torque"]) for row in about["detection"]))


def _row(about: Mapping[str, Any], fault: str) -> dict[str, Any]:
    """A line of the detection table."""
    mine = {(row["motor_speed_rpm"], row["load_torque"]): row for row in about["detection"] if row["fault"] == fault}
    sizes = [mine[point] for point in _points(about)]
    known = [row["size"] for row in sizes if row["size"] is not None]
    return {
        "words": FAULTS[fault].words, "unit": FAULTS[fault].unit,
        "cells": [
            {"point": f"{row['motor_speed_rpm']:.0f} rpm, {row['load_torque']:g} N m",
             "told": "not seen" if row["told"] is None else f"{row['told']:.2g}",
             "best": bool(known) and row["size"] == min(known)}
            for row in sizes
        ],
    }  # fmt: skip


def _parameter(row: Mapping[str, Any], machine: Machine) -> dict[str, str]:
    """A line of the table of parameters."""
    path = row["path"]
    return {
        "name": words_of(path), "meaning": meaning_of(path), "value": value_of(row), "shop": shop_of(row, machine),
        "spread": spread_of(row),
    }  # fmt: skip
