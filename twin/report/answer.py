"""answer.html: what is wrong, where, how large, how sure, by which evidence, and what to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2

from twin.answer import Answer, FoundFault
from twin.diagnosis import FAULTY, HEALTHY, NOT_COMPARABLE, UNKNOWN, TurnDiagnosis
from twin.faults import FAULTS, number_of, share_of
from twin.twin import Twin

PLACES: dict[str, tuple[str, str]] = {
    "crack": (
        "turret, all rollers",
        "Inspect the rollers, their bearings and the cam's flanks.",
    ),
    "crack_single": ("turret, one roller", "Inspect the roller that carries the load at that station."),
    "reducer_play": (
        "reducer, between motor and cam",
        "Measure the play at the motor shaft; set the reducer anew.",
    ),
    "follower_play": ("between cam and rollers", "Check the centre distance of cam and turret, and the rollers' wear."),
    "loose_base": ("base screws of the housing", "Check the torque of the base screws and the bed beneath."),
    "friction": ("bearing of the table", "Check the table's bearing: lubrication, seals, preload."),
    "imbalance": ("load on the table", "Check how the load is placed and clamped on the table."),
    "mesh_wear": ("reducer, its mesh", "Inspect the reducer's gears; look at the oil for particles."),
    "sensor_loose": ("sensor", "Fasten the sensor, then record again before anything else is repaired."),
    "sensor_gain": ("sensor", "Check the sensor's sensitivity and the amplifier's setting, then record again."),
}
"""Where each fault sits, and what to do about it."""

_GENERAL = {
    HEALTHY: "Nothing: go on, and record again as planned.",
    UNKNOWN: "Check the speed and load that were stated, and record again to see whether it stays; ask what changed "
    "at the machine since its healthy records. If nobody knows, look at the machine before it runs on: the cause is in "
    "no table of this twin.",
    NOT_COMPARABLE: "Record again as the twin's healthy records were taken, or state what was different.",
}

_PHYSICS = 0.95
"""Level of physics' intervals, as `discrepancy` gives them; the networks' is the twin's coverage."""

_TONES = {HEALTHY: "good", FAULTY: "bad"}


def answer_page(answer: Answer, each: Sequence[tuple[str, TurnDiagnosis]], twin: Twin) -> str:
    """The page of an answer and of what the networks say of each record."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("answer.html").render(
        answer=answer, each=each, names=[name for name, _ in each], machine=twin.machine.name,
        check=twin.about["check"], tone=_TONES.get(answer.verdict, "open"), advice=advice_of(answer),
        rows=[_row(fault, twin) for fault in answer.faults], probabilities=_probabilities(answer.network),
        level=_percent(twin.about["settings"]["coverage"]),
    )  # fmt: skip


def advice_of(answer: Answer) -> list[str]:
    """What to do, in the order of what was found."""
    found = [PLACES[fault.name][1] for fault in answer.faults if fault.matters and fault.name in PLACES]
    if answer.verdict == FAULTY and found:
        sensor = [fault.name for fault in answer.faults if fault.matters and fault.name.startswith("sensor")]
        first = [PLACES[name][1] for name in sensor]
        return list(dict.fromkeys([*first, *found, "Record again after the repair: the twin tells whether it helped."]))
    slight = [fault.told for fault in answer.faults if not fault.matters]
    more = [f"Keep an eye on {' and '.join(slight)}."] if slight and answer.verdict == HEALTHY else []
    return [_GENERAL.get(answer.verdict, _GENERAL[UNKNOWN]), *more]


def _row(fault: FoundFault, twin: Twin) -> dict[str, Any]:
    """A line of the table of faults."""
    size = fault.told.removeprefix(fault.words).removeprefix(f" at station {fault.station}").removeprefix(", ")
    place = PLACES.get(fault.name, ("", ""))[0]
    if fault.station is not None:
        place = f"{place}, station {fault.station}"
    level = _percent(_PHYSICS if fault.sized_by == "physics" else twin.about["settings"]["coverage"])
    return {"fault": fault, "size": size, "level": level, "place": place, "bar": _bar(fault, twin)}


def _percent(share: float) -> str:
    return f"{100.0 * share:g} %"


def _bar(fault: FoundFault, twin: Twin) -> dict[str, float | None] | None:
    """Places along the bar in per cent of the largest size; None for what is in no table."""
    of = next((one for one in twin.faults if one.name == fault.name), None)
    if of is None:
        return None
    told = (fault.size, fault.low, fault.high)
    at, one, other = (100.0 * min(1.0, abs(share_of(of, abs(value), twin.machine))) for value in told)
    low, high = min(one, other), max(one, other)
    matters = twin.matters.get(fault.name)
    return {
        "at": at,
        "low": low,
        "width": high - low,
        "matters": None if matters is None else 100.0 * min(1.0, matters),
    }


def _probabilities(network: TurnDiagnosis) -> list[dict[str, str]]:
    """A line for each fault of the table, the most probable first."""
    rows = []
    for name, chance in sorted(network.probabilities.items(), key=lambda item: -item[1]):
        size, low, high = (number_of(value) for value in network.severities[name])
        told = f"{size} {FAULTS[name].unit} ({low} to {high})"
        rows.append({"words": FAULTS[name].words, "chance": f"{100.0 * chance:.0f} %", "size": told})
    return rows
