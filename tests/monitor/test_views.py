"""What the page says of machines, by its own modules without a browser."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import monitor.web
from monitor.intake.states import UNTIL_GOOD_TURN, WORDS

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="needs Node.js: apt-get install nodejs")

STUB = """
class El { constructor() { this.kids = []; } append(...more) { this.kids.push(...more); } setAttribute() {} }
globalThis.document = { createElement: () => new El(), createElementNS: () => new El(), documentElement: {} };
globalThis.window = {};
const said = (one) => one == null || one === false ? "" : Array.isArray(one) ? one.map(said).join(" ")
  : one.kids ? one.kids.map(said).join("") + " " : String(one);
const views = await import("./views.mjs");
const { cases, view } = JSON.parse(process.argv[2]);
console.log(JSON.stringify(cases.map(({ machines, troubles }) => {
  const fleet = new Map(machines.map((one) => [one.machine, one]));
  const state = { fleet, troubles, words: {}, limits: { backlash_deg: [3, 6, 12] }, person: {}, events: [] };
  return said(view === "fleet" ? views.fleet(state) : views.machine(state, machines[0].machine)).replace(/\\s+/g, " ");
})));
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A function that gives the text of a view for each case: its machines, and what keeps samples from coming."""
    folder = tmp_path_factory.mktemp("page")
    for file in (Path(monitor.web.__file__).parent / "static").glob("*.js"):
        (folder / f"{file.stem}.mjs").write_text(file.read_text(encoding="utf-8").replace('.js"', '.mjs"'), "utf-8")
    (folder / "call.mjs").write_text(STUB, "utf-8")

    def told(*cases, view="fleet"):
        given = [{"machines": list(machines), "troubles": list(troubles)} for machines, troubles in cases]
        command = [str(NODE), "call.mjs", json.dumps({"cases": given, "view": view})]
        return json.loads(subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout)

    return told


def machine(*states, alarms=None, **last):
    """A machine whose newest turn was found healthy."""
    last = {"time_ns": 1_800_000_000e9, "verdict": "intact", "healthy": True, "problem": "", "mode": "60 rpm"} | last
    alarms = alarms or {}
    level = max((one["level_name"] for one in alarms.values()), default="normal")
    known = {name: {"text": WORDS[name], "active": True, "count": 1, "last_ns": 0} for name in states}
    return {
        "machine": "press-1", "level": level, "worst": next(iter(alarms), None), "alarms": alarms, "last": last,
        "states": known, "active_states": list(states),
    }  # fmt: skip


def test_a_machine_that_nobody_sees_does_not_run_as_usual(page):
    """A passing event, as a lost block, hides nothing."""
    hidden = (*UNTIL_GOOD_TURN, "stale", "broken_payload", "swapped", "overload")
    told = dict(zip(WORDS, page(*(([machine(name)], []) for name in WORDS)), strict=True))
    usual = {name for name, text in told.items() if text.startswith("The machine runs as usual.")}
    assert usual == set(WORDS) - set(hidden)
    assert all(told[name].startswith("One machine needs attention") for name in hidden)


def test_only_a_healthy_turn_of_each_machine_is_as_usual(page):
    usual, fresh = machine(), machine(verdict=None, healthy=None)
    worn, left_out = machine(healthy=False, verdict="backlash"), machine(problem="it is dead", problem_ns=1.8e18)
    told = page(([usual], []), ([fresh], []), ([worn], []), ([left_out], []), ([usual], ["the broker is away"]))
    assert told[0].startswith("The machine runs as usual.")
    assert told[3].startswith("One machine needs attention") and "Not diagnosed: it is dead" in told[3]
    for text in (told[1], told[2], told[4]):
        assert text.startswith("No alarm, but it is not certain that the machine runs as usual.")


def test_sizes_that_are_old_have_their_own_time_and_no_remaining_one(page):
    """The newest turn was not diagnosed, a month after the last one that was."""
    alarms = {"backlash_deg": {"level_name": "alert", "acknowledged": True}}
    known = {"60 rpm": {"time_ns": 1_800_000_000e9}}
    sizes = {"sizes": {"backlash_deg": [4, 3.5, 4.5]}, "remaining": {"backlash_deg": [172800, 86400, 345600]}}
    last = {**sizes, "modes": known, "size_mode": {"backlash_deg": "60 rpm"}}
    problem = {"problem": "the table rests", "problem_ns": 1_802_592_000e9}
    for view in ("fleet", "machine"):
        seen, hidden = page(
            ([machine(alarms=alarms, **last)], []), ([machine(alarms=alarms, **last, **problem)], []), view=view
        )
        assert "Danger in about 2 days" in seen and "as of" not in seen
        assert "Danger in" not in hidden and "as of 15 Jan 2027" in hidden and "newest turn 14 Feb 2027" in hidden


def test_a_size_is_told_with_its_speed_where_there_are_several(page):
    known = {"60 rpm": {"time_ns": 1.8e18}, "48 rpm": {"time_ns": 1.8e18}}
    alarms = {"backlash_deg": {"level_name": "alert", "acknowledged": True}}
    sizes = {"sizes": {"backlash_deg": [4, 3.5, 4.5]}, "size_mode": {"backlash_deg": "48 rpm"}}
    (told,) = page(([machine(alarms=alarms, modes=known, **sizes)], []))
    assert "(3.5° to 4.5°) at 48 rpm" in told
