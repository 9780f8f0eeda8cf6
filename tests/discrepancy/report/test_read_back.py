"""What page and figures show is what the outcome holds, read back from them."""

import dataclasses
import html
import json
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from discrepancy.chain import Outcome, run_chain
from discrepancy.estimates import Estimate, FoundEffect
from discrepancy.form import Form
from discrepancy.gap import Gap, Share
from discrepancy.locate.result import Cell
from discrepancy.next_measurement import Separation
from discrepancy.report import content, figures, report_files, words
from discrepancy.table import Table
from indexer_env.effects.spline import Axis
from tests.discrepancy.toy import ChordSubject, effect

OFFSET = Estimate("offset", "N", 1.5, 1.2, 1.9, 0.7, 1.25)


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    made = run_chain(ChordSubject({"tone": 10.0, "rest": 2.0}), 5)
    share = [Share(k / 100.0, k / 100.0 - e, k / 100.0 + e) for k, e in ((3, 0.001), (42, 0.02), (11, 0.01))]
    calibration = dataclasses.replace(
        made.answer.calibration, estimates=(OFFSET,), undetermined=("a +0.71, b -0.70",), bounds_hit=("offset",)
    )
    answer = dataclasses.replace(made.answer, calibration=calibration)
    return dataclasses.replace(made, answer=answer, gap=Gap(*share, Share(0.8, 0.7, 0.9)))


def page_of(outcome: Outcome) -> str:
    return html.unescape(report_files(outcome)["report.html"])


def cells(page: str, begin: str) -> list[str]:
    """The cells' texts of the row in which a text stands."""
    row = page[page.rindex("<tr>", 0, page.index(begin) + 1) :].partition("</tr>")[0]
    return [re.sub(r"<[^>]*>", "", cell).strip() for cell in re.findall(r"<td.*?</td>", row, flags=re.DOTALL)]


def test_the_tiles_show_the_gap_before_and_after(outcome: Outcome) -> None:
    page = page_of(outcome)
    tiles = re.findall(r'<div class="tile (before|after)"><b>([^<]*)</b><span>([^<]*)</span>', page)
    assert [(name, number) for name, number, _ in tiles] == [("before", "42 %"), ("after", "11 %")]
    assert tiles[0][2] == "residual before, 40 % to 44 % of the record; noise 3.0 %"
    assert tiles[1][2] == "residual with what was found, 10 % to 12 %"


def test_the_calibration_shows_each_number_in_its_place(outcome: Outcome) -> None:
    page = page_of(outcome)
    assert cells(page, "<td>offset</td>") == ["offset", "0.7", "1.5", "1.2 to 1.9", "N", "+1.2"]
    assert '<i style="left: 85.0px">' in page, "60 px in the middle, 20 px for each standard deviation"
    assert "move along this direction, in standard deviations of what was known: a +0.71, b -0.70." in page


def test_sizes_are_those_of_the_findings(outcome: Outcome) -> None:
    (finding,) = [one for one in outcome.answer.findings if one.name == "tone"]
    size = finding.effects[0].parameters[0]
    (shown,) = re.findall(r'<td class="name">size</td><td>([\d.]+) N, ([\d.]+) to ([\d.]+)', page_of(outcome))
    assert list(shown) == [words.number(value, size) for value in (size.value, size.low, size.high)]
    assert [float(one) for one in shown] == pytest.approx([size.value, size.low, size.high], rel=0.05)


def test_a_bound_that_holds_a_number_is_told(outcome: Outcome) -> None:
    first, *others = outcome.answer.findings
    tone: FoundEffect = dataclasses.replace(first.effects[0], bound="tone.size 90 N and tone.share 1")
    held = dataclasses.replace(first, effects=(tone,))
    answer = dataclasses.replace(outcome.answer, findings=(held, *others))
    page = page_of(dataclasses.replace(outcome, answer=answer))
    assert "Held at the bound of what is possible: tone.size 90 N and tone.share 1." in page


def test_the_best_measurements_are_shown_first(outcome: Outcome) -> None:
    following = tuple(Separation(f"record {k}", 90.0 - k, ("tone", "beat")) for k in range(9))
    page = page_of(dataclasses.replace(outcome, next=following))
    assert re.findall(r"<td>(record \d)</td><td class=\"num\">(\d+)</td>", page) == [
        (f"record {k}", f"{90 - k}") for k in range(6)
    ]


def test_json_holds_what_the_answer_holds(outcome: Outcome, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ChordSubject, "shop", lambda self, name, values: f"{name} of {len(values)}", raising=False)
    remains = dataclasses.replace(outcome.answer.remains, level=1.75)
    told = content(dataclasses.replace(outcome, answer=dataclasses.replace(outcome.answer, remains=remains)))
    (offset,) = told["calibration"]["parameters"]
    assert offset == {
        "name": "offset", "value": 1.5, "unit": "N", "interval": [1.2, 1.9], "nominal": 0.7, "moved": 1.25,
        "shop": "offset of 3",
    }  # fmt: skip
    assert told["calibration"]["undetermined"] == ["a +0.71, b -0.70"]
    assert told["calibration"]["bounds_hit"] == ["offset"]
    assert (told["remains"]["times_noise"], told["remains"]["with_hints"]) == (outcome.answer.after, 1.75)
    assert (told["gap"]["before"], told["gap"]["after"], told["gap"]["noise_floor"]) == (0.42, 0.11, 0.03)


def test_the_record_shows_what_is_simulated(outcome: Outcome) -> None:
    """The base model lacks a tone of 10 N that the record has."""
    figure = figures._records(outcome)
    above, below = figure.axes
    measured, base, found = (np.asarray(line.get_ydata()) for line in above.lines)
    left_base, left_found = (np.asarray(line.get_ydata()) for line in below.lines)
    assert np.allclose(base - measured, left_base) and np.allclose(found - measured, left_found)
    assert np.std(base) < 0.3 * np.std(measured) and np.std(left_found) < 0.4 * np.std(left_base)


def test_a_missing_torque_has_the_sign_of_what_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    made, seen = run_chain(ChordSubject({"rest": 5.0}), 5), []
    averaged = figures.averaged
    monkeypatch.setattr(figures, "averaged", lambda *given: seen.append(given[1]) or averaged(*given))
    figures.missing_torque(made)
    assert np.corrcoef(seen[0].ravel(), made.answer.model.y.ravel())[0, 1] > 0.9


def test_stars_stand_at_the_cells_beyond_chance() -> None:
    before = [Cell("phase", f"{k}°", 2.0 + k, 1.0, 0.01, k in (1, 3)) for k in range(5)]
    ax = Figure().subplots()
    figures._bars(ax, "phase", before, None)
    (stars,) = [line for line in ax.lines if line.get_marker() == "*"]
    assert np.asarray(stars.get_xdata()).tolist() == [1, 3]
    assert [bar.get_height() for bar in ax.patches] == [cell.level for cell in before]


def test_a_table_is_written_with_its_variable_and_what_holds(outcome: Outcome) -> None:
    form = Form("speed [m/s]", ("speed",), effect("tabulated"), (Axis(3, -0.1, 1.1, False),))
    place = outcome.answer.accepted.place
    values = tuple(Estimate(f"at {k}", "N", float(k), k - 0.5, k + 0.5, 0.0, None) for k in range(len(form.places)))
    table = Table(form, values, 3.0, 1.5, 0.7, place)
    answer = dataclasses.replace(outcome.answer, written=dataclasses.replace(outcome.answer.written, held_back="it is"))
    files = report_files(dataclasses.replace(outcome, answer=answer, table=table))
    told = json.loads(files["report.json"])["table"]
    assert (told["before"], told["after"], told["closes"]) == (3.0, 1.5, 0.7)
    assert [row["value"] for row in told["rows"]] == [one.value for one in values]
    comments = [line for line in files["with_table.yaml"].splitlines() if line.startswith("#")]
    assert comments[:3] == [
        "# tabulated is a table over the speed [m/s], not a law.",
        "# Its places lie from -0.1 to 1.1; those that no record passed stay at nothing.",
        "# All else is the calibrated machine, which machine.yaml holds back.",
    ]
