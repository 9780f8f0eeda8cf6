"""report.html: plain words and numbers, and a page that can be read on a small screen."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from datagen.campaigns.own import LOAD_FACTOR
from discrepancy.indexer.library import HOUSING
from discrepancy.indexer.parameters import UNCERTAINTY
from discrepancy.indexer.together import GAIN
from indexer_env.effects import EFFECTS
from tests.twin.builders import CELLS, MACHINE, RANGE, view
from twin.advice import beyond
from twin.quantities import meaning_of, value_of, words_of
from twin.report.page import page


def row(path: str, value: float, unit: str = "-", spread: float = 0.08) -> dict[str, Any]:
    low, high = value * (1.0 - spread), value * (1.0 + spread)
    return {"path": path, "unit": unit, "value": value, "low": low, "high": high}


ROWS = [
    row("machine.output_joint.stiffness", 45335.6, "N m/rad"),
    row("machine.input_joint.backlash", 6.583e-4, "rad"),
    row(f"machine.{HOUSING}", 20.5, "kg m²"),
    row("effects.friction.coulomb.torque", 3.95, "N m"),
    row("effects.drive.slip.compliance", 2.6e-5, "rad/(s N m)"),
    row("effects.load.imbalance.phase", 0.0, "rad"),
    row(LOAD_FACTOR, 0.9826),
]


@pytest.fixture(scope="module")
def said() -> str:
    seen = {"fault": "crack", "motor_speed_rpm": 1400.0, "load_torque": 5.0, "size": 0.02, "told": 1.2, "unit": "%"}
    checked = {"file": "a.csv", "alarm": -3.0, "novelty": 0.5, "level": 1.0}
    about = {
        "format": "indexer-twin", "version": 1, "records": 10, "range": RANGE,
        "recorded": [[1200.0, 5.0], [1400.0, 5.0]],
        "settings": {"faults": ["crack"], "false_alarms": 0.01, "power": 0.95, "seed": 0, "housing_uncertainty": 0.2},
        "calibration": {
            "headline": "Nothing lacks.", "level": 1.0, "scale_spread": 0.01, "spread": {"cam_inertia": 0.2},
            "start_compared": False, "parameters": ROWS, "notes": [],
        },
        "weights": {"pooled": [True]}, "scores": {"networks": {"one": 0.9}, "paper": {"one": 0.5}}, "detection": [seen],
        "check": {"trusted": True, "reason": "Trusted.", "turns": [checked]},
    }  # fmt: skip
    remains = view().remains
    assert remains.fixed.shape[2] == CELLS.count and np.isfinite(remains.fixed).all()
    return page(about, MACHINE, remains)


def test_quantities_have_plain_names_and_numbers(said):
    table = said[said.index("<h2>The machine as") : said.index("<h2>What is left")]
    assert not re.search(r"\d[eE][+-]?\d|_joint|[a-z]\.[a-z]|load factor", table)
    for words in (
        "stiffness of the rollers",
        "45\N{NARROW NO-BREAK SPACE}300 N m/rad",
        "play in the reducer",
        "98.3 %",
    ):
        assert words in table
    assert "° at the motor shaft" in table and "Dry friction in the table bearing" in table and "±8 %" in table
    assert "Hardly known: inertia of the cam" in said


def test_everything_that_is_drawn_has_words():
    own = [f"machine.{name}" for name in (*UNCERTAINTY, HOUSING)] + [LOAD_FACTOR, GAIN]
    effects = [f"effects.{name}.{fields(kind)[0].name}" for name, kind in EFFECTS.items()]
    for path in (*own, *effects):
        assert not re.search(r"_joint|_inertia|_factor|effects\.|machine\.", words_of(path)), path
    assert all(meaning_of(path) for path in effects) and not any(map(meaning_of, own))
    assert value_of(row("machine.cam_inertia", 4.2e-7, "kg m²")) == "0.00000042 kg m²"


def test_on_a_small_screen_tables_stack_and_pictures_scroll(said):
    assert said.count("<table") == said.count('<table class="stack"') == 3
    assert said.count("<svg") == len(re.findall(r'<div class="figure"><svg', said)) == 2
    assert ".figure svg { min-width: 640px; }" in said and ".stack td[data-name]::before" in said
    assert 'data-name="1400 rpm, 5 N m">1.2</td>' in said


def test_what_was_not_recorded_and_intervals_that_are_not_a_faults_own_are_said(said):
    assert "The twin diagnoses 1200 to 1500 rpm and 0 to 20 N m, which is more than was recorded" in said
    assert "Too few simulated turns name cracked rollers: intervals of these sizes are those of all faults" in said
    assert beyond([(1200.0, 5.0), (1500.0, 20.0)], (1190.0, 1510.0), (5.0, 20.0)) == []
