"""The report for each answer: its sentence, its keys, a page without the network, and whatever fails behind it."""

import dataclasses
import functools
import json
import math
import re
import sys
from collections.abc import Callable
from html.parser import HTMLParser

import numpy as np
import pytest
import yaml

from discrepancy import Criteria, chain
from discrepancy import __main__ as command
from discrepancy.chain import STAGES, Outcome, run_chain
from discrepancy.estimates import Estimate
from discrepancy.fits import Fitted
from discrepancy.form import Form
from discrepancy.gap import Share
from discrepancy.grades import RULES
from discrepancy.origin import Origin, Place
from discrepancy.report import content, headline, plain, report_files, to_do
from discrepancy.report.figures import _tick, _titled, averaged
from discrepancy.report.ranking import NONE_OF_THESE
from discrepancy.report.words import percent, ranged
from discrepancy.search import Race, Search
from discrepancy.written import Written
from indexer_env.effects.spline import Axis
from tests.discrepancy.toy import ChordSubject, Loud, effect

PLACES = [Place("output", "phase", "a torque on the table that follows the cam's phase", 0.6),
          Place("input", "phase", "a torque on the cam shaft that follows the cam's phase", 0.3)]  # fmt: skip
FLOOR = Place("base", "time", "blows to the base, which rings at 31 Hz", math.nan)

KEYS = {
    "verdict", "headline", "findings", "effects", "remains", "ranking", "gap", "where", "where_after", "calibration",
    "question", "next", "search", "criteria", "failures", "seed", "version",
}  # fmt: skip
TWINS = ("tone", "twin", "beat")

Made = Callable[[str], Outcome]
Filed = Callable[[str], dict[str, str]]


@pytest.fixture(scope="module")
def made() -> Made:
    """The outcome of a case by its name, each made once."""
    subjects = {
        "found": lambda: ChordSubject({"tone": 10.0}),
        "two": lambda: ChordSubject({"tone": 10.0, "beat": 6.0, "rest": 2.0}),
        "family": lambda: ChordSubject({"tone": 10.0}, TWINS),
        "stands in": lambda: ChordSubject({"half": 8.0}),
        "nothing": lambda: ChordSubject({}),
        "remainder": lambda: ChordSubject({"rest": 5.0}),
    }
    kept: dict[str, Outcome] = {}

    def make(name: str) -> Outcome:
        if name not in kept:
            kept[name] = run_chain(subjects[name](), 5)
        return kept[name]

    return make


@pytest.fixture(scope="module")
def filed(made: Made) -> Filed:
    """The files of a case by its name, each drawn once."""
    return functools.cache(lambda name: report_files(made(name)))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("found", r"^Tone \d+\.?\d* N \(9\.\d+ to 10\.\d+\) closes \d+\.?\d* % of the gap; nothing else remains"),
        ("two", r"^Tone .* and beat .* close \d+\.?\d* % of the gap; 1\.\d\d times the noise remains"),
        ("family", r"^One of (tone|twin) .* or (tone|twin) .*, which these records cannot tell apart, closes"),
        ("stands in", r"^Something is missing to which no .*: \d\.\d times the noise .*; tone stands in for a part"),
        ("nothing", r"^Nothing is missing: the calibrated model comes .* \((0\.9|1\.0)\d times it\)\.$"),
        ("remainder", r"^Something is missing to which no effect of the library gives a name: 3\.\d times the"),
    ],
)  # fmt: skip
def test_each_answer_has_its_sentence(made: Made, name: str, said: str) -> None:
    assert re.search(said, headline(made(name))), headline(made(name))


def test_what_does_not_repeat_is_no_noise_without_a_word(made: Made) -> None:
    outcome = made("nothing")
    remains = dataclasses.replace(outcome.answer.remains, noise=5.2)
    noisy = dataclasses.replace(outcome.answer, before=5.3, remains=remains)
    said = headline(dataclasses.replace(outcome, answer=noisy))
    assert said.startswith("Nothing that repeats from turn to turn is missing: 5.3 times the noise remains")
    assert "(5.2 times of it does not repeat from turn to turn)" in said and "not locked to the table" in said


@pytest.mark.parametrize(
    ("tolerance", "said", "down_to"),
    [
        (0.1, "down to the noise and what is tolerated on records that were never fitted (1.02 times both).",
         "down to their noise and what is tolerated."),
        (None, "Nothing that repeats from turn to turn is missing",
         "down to what does not repeat from turn to turn, which is more than their noise."),
    ],
)  # fmt: skip
def test_what_nothing_comes_down_to_is_said(made: Made, tolerance: float | None, said: str, down_to: str) -> None:
    outcome = made("nothing")
    answer = dataclasses.replace(
        outcome.answer, before=5.3, after=5.3, remains=dataclasses.replace(outcome.answer.remains, noise=5.2),
        criteria=Criteria(tolerance=tolerance),
    )  # fmt: skip
    outcome = dataclasses.replace(outcome, answer=answer)
    assert said in headline(outcome)
    assert f"The calibrated machine explains the records {down_to}" in report_files(outcome)["report.html"]


def test_a_hint_within_the_noise_is_told_behind_it(made: Made) -> None:
    outcome = made("stands in")
    answer = dataclasses.replace(outcome.answer, verdict="nothing missing", before=0.87, after=0.87)
    outcome = dataclasses.replace(outcome, answer=answer)
    said = r"Nothing is missing: .* \(0\.87 times it\).*; tone would take up a part of what is left\."
    assert re.search(said, headline(outcome))


@pytest.mark.parametrize("name", ["found", "nothing"])
def test_what_the_records_fitted_show_beyond_chance_is_in_the_headline(made: Made, name: str) -> None:
    outcome = made(name)
    assert outcome.left is not None and "beyond chance" not in headline(outcome)
    cells = (dataclasses.replace(outcome.left.cells[0], level=1.4, p=0.005, significant=True), *outcome.left.cells[1:])
    left = dataclasses.replace(outcome.left, cells=cells)
    outcome = dataclasses.replace(outcome, left=left)
    assert ", though the records fitted disagree with it beyond chance, most at 0 turn (phase)." in headline(outcome)
    # what is tolerated may well be seen
    answer = dataclasses.replace(outcome.answer, criteria=Criteria(tolerance=0.2))
    tolerated = dataclasses.replace(outcome, answer=answer)
    assert "beyond chance" not in headline(tolerated) + to_do(tolerated)
    assert to_do(outcome).startswith("No name is open; the records fitted still disagree beyond chance")


def test_the_map_counts_cells_that_samples_lie_in(made: Made) -> None:
    """Each record of 4 s and each phase of a chord hold all 16 cells; two of them are emptied."""
    where = made("found").where
    assert where is not None
    levels = where.map.levels.copy()
    levels[0, :2] = np.nan
    emptied = dataclasses.replace(where, map=dataclasses.replace(where.map, levels=levels))
    for one, cells in ((where, 24), (emptied, 22)):
        told = content(dataclasses.replace(made("found"), where=one))["test"]
        assert told["cells"] == cells


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("found", "Nothing is open"),
        ("family", "Record a telling one: it would show which one of"),
        ("stands in", "Record .*: it would show whether tone is needed at all, though not what it stands in for"),
        ("nothing", "Nothing is open"),
        ("remainder", "with which of them the remainder grows"),
    ],
)
def test_each_answer_says_what_to_do_next(made: Made, name: str, said: str) -> None:
    assert re.search(said, to_do(made(name))), to_do(made(name))


def test_a_search_cut_short_says_so() -> None:
    outcome = run_chain(ChordSubject({"tone": 10.0}), 5, criteria=Criteria(seconds=1e-9))
    assert "time allowed ran out" in headline(outcome)
    assert json.loads(report_files(outcome)["report.json"])["search"]["complete"] is False


def test_a_table_that_was_not_read_off_for_want_of_time_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    form = Form("speed [m/s]", ("speed",), effect("tabulated"), (Axis(3, 0.0, 1.0, False),))
    said = "What remains was not read off as a table: the time allowed ran out."
    for forms, failures in (((form,), (said,)), ((), ())):
        monkeypatch.setattr(ChordSubject, "forms", lambda self, forms=forms: forms)
        assert run_chain(ChordSubject({"rest": 10.0}), 5, criteria=Criteria(seconds=1e-9)).failures == failures


def test_a_size_that_was_found_beside_a_hint_is_told_where_the_machine_has_another_one() -> None:
    """Half is known too vaguely for a name, and tone without it takes up a part of it."""
    files = report_files(run_chain(ChordSubject({"tone": 12.0, "half": 1.2}, ("tone", "half")), 5,
                                   criteria=Criteria(span=1.15)))  # fmt: skip
    report = json.loads(files["report.json"])
    (found,) = report["effects"][0]["parameters"]
    written = yaml.safe_load(files["machine.yaml"])["tone.size"]
    assert abs(written - found["value"]) > 0.5
    remark = (
        f"The size of tone is {written:.4g} here, where only what is named stands; it was found as "
        f"{found['value']:.4g} beside a hint that takes up a part of it."
    )
    assert report["calibration"]["remarks"] == [remark] and files["machine.yaml"].startswith(f"# {remark}\n")


def test_json_has_every_key_and_the_finding(filed: Filed) -> None:
    files = filed("found")
    report = json.loads(files["report.json"])
    assert report.keys() >= KEYS and (report["verdict"], report["seed"]) == ("found", 5)
    (finding,) = report["findings"]
    (size,) = finding["effects"][0]["parameters"]
    assert (finding["grade"], finding["name"], size["name"], size["unit"]) == ("established", "tone", "size", "N")
    assert size["interval"][0] < 10.0 < size["interval"][1]
    assert report["effects"] == finding["effects"]
    gap = report["gap"]
    assert gap["noise_floor"] < gap["after"] * 1.2 < gap["before"] and gap["closed_share"] > 0.98
    low, high = gap["intervals"]["closed_share"]
    assert low <= gap["closed_share"] <= high
    assert report["remains"]["times_noise"] == pytest.approx(1.0, abs=0.05)
    assert report["where"] and {"axis", "cell", "level", "p"} <= report["where"][0].keys()
    assert report["where_after"] == [] and report["failures"] == []
    assert "NaN" not in files["report.json"] and "Infinity" not in files["report.json"]


def test_json_holds_all_criteria_and_the_rule_table(filed: Filed) -> None:
    report = json.loads(filed("found")["report.json"])
    assert report["criteria"]["numbers"] == dataclasses.asdict(Criteria())
    assert [row["rule"] for row in report["criteria"]["rules"]] == [rule.name for rule in RULES]
    outcome = run_chain(ChordSubject({}), 5, criteria=Criteria(margin=44.0))
    assert json.loads(report_files(outcome)["report.json"])["criteria"]["numbers"]["margin"] == 44.0


@pytest.mark.parametrize(("hidden", "traced"), [({}, False), ({"rest": 5.0}, True)])
def test_what_does_not_differ_from_noise_is_not_traced(
    monkeypatch: pytest.MonkeyPatch, hidden: dict[str, float], traced: bool
) -> None:
    origin = Origin(PLACES[0], 0.7, (), ())
    monkeypatch.setattr(ChordSubject, "origin", lambda self, model, place: origin)
    assert run_chain(ChordSubject(hidden), 5).origin is (origin if traced else None)


@pytest.mark.parametrize("name", ["found", "family", "stands in", "nothing", "remainder"])
def test_every_ranking_has_none_of_these(filed: Filed, name: str) -> None:
    for ranking in json.loads(filed(name)["report.json"])["ranking"]:
        rows = {row["name"]: row for row in ranking["rows"]}
        assert NONE_OF_THESE in rows
        shares = [row["probability"] for row in rows.values() if row["probability"] is not None]
        assert not shares or sum(shares) == pytest.approx(1.0)
        if shares and name != "family":
            # whose sets were compared share what is left to the library by their posterior weights
            weights = {key: math.exp(-0.5 * row["behind"]) for key, row in rows.items() if key != NONE_OF_THESE}
            library = 1.0 - rows[NONE_OF_THESE]["probability"]
            for key, weight in weights.items():
                expected = library * weight / sum(weights.values())
                assert rows[key]["probability"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", ["found", "two", "family", "stands in", "nothing", "remainder"])
def test_the_page_opens_offline_and_says_first_what_is_missing(made: Made, filed: Filed, name: str) -> None:
    outcome = made(name)
    page = filed(name)["report.html"]

    class Links(HTMLParser):
        found: tuple[str, ...] = ()

        def handle_starttag(self, tag: str, attrs: list) -> None:
            outside = [v for k, v in attrs if k in ("src", "href") and v and not v.startswith("#")]
            self.found += tuple(outside) + ((tag,) if tag in ("script", "link", "img") else ())

    reader = Links()
    reader.feed(page)
    assert reader.found == ()
    assert page.count("<svg") == 4
    text = re.sub(r"<(style|svg).*?</\1>", "", page, flags=re.DOTALL)
    order = [headline(outcome), "What remains", "What to do next", "Evidence", "What competed"]
    assert [text.index(part) for part in order] == sorted(text.index(part) for part in order)
    for finding in outcome.answer.findings:
        assert finding.grade in text and finding.why in text
        share = f"closes {percent(finding.closes)} of the gap on records held out, with the machine's own numbers"
        assert f"{share} fitted to those records" in text
    assert "url(http" not in page and "{{" not in page


def test_a_name_with_dollars_is_no_formula(made: Made, monkeypatch) -> None:
    outcome, view = made("found"), ChordSubject.view
    odd = ("run_$1_{$2.csv", "b")
    monkeypatch.setattr(ChordSubject, "view", lambda self, model: dataclasses.replace(view(self, model), names=odd))
    assert "run_$1_{$2.csv" in report_files(outcome)["report.html"]


def test_a_name_that_is_no_text_can_be_written(made: Made, monkeypatch) -> None:
    """As Python reads a file's name in Latin-1."""
    outcome, view = made("found"), ChordSubject.view
    odd = ("Pr\udcfcfung.csv", "b")
    monkeypatch.setattr(ChordSubject, "view", lambda self, model: dataclasses.replace(view(self, model), names=odd))
    files = report_files(outcome)
    assert all(text.encode("utf-8") for text in files.values())
    assert "Pr\\udcfcfung.csv" in files["report.html"] and files["report.html"].count("<svg") == 4
    assert json.loads(files["report.json"])["records"]["fitted"] == list(odd)
    assert plain("4′", "ascii") == "4\\u2032"


def test_the_console_tells_what_no_encoding_holds(made: Made, monkeypatch, tmp_path, capsys) -> None:
    outcome = dataclasses.replace(made("found"), of_records=("Pr\udcfcfung.csv: heavier.",))
    monkeypatch.setattr(command, "_subject", lambda config: outcome.subject)
    monkeypatch.setattr(command, "run_chain", lambda *_: outcome)
    config = {"overwrite": False, "seed": 5, "seconds": None, "tolerance": None, "out": str(tmp_path / "out")}
    command.run(config)
    assert "  Pr\\udcfcfung.csv: heavier.\n" in capsys.readouterr().out


def test_a_report_is_the_same_for_the_same_seed(filed: Filed) -> None:
    seen: list[str] = []
    again = run_chain(ChordSubject({"tone": 10.0}), 5, seen.append)
    assert tuple(seen) == STAGES
    assert report_files(again) == filed("found")


@pytest.mark.parametrize(
    ("stage", "function"),
    [(STAGES[1], "locate"), (STAGES[2], "gap_of"), (STAGES[3], "tabulate"), (STAGES[4], "separations")],
)
def test_a_stage_that_fails_takes_no_answer_away(stage: str, function: str, monkeypatch, caplog) -> None:
    def fails(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(chain, function, fails)
    outcome = run_chain(ChordSubject({"tone": 10.0}, TWINS), 5)
    files = report_files(outcome)
    report = json.loads(files["report.json"])
    assert report["verdict"] == "found" and report["findings"][0]["name"] in ("tone or twin", "twin or tone")
    (said,) = report["failures"]
    assert (
        stage in said and "LinAlgError: Singular matrix" in said and said in files["report.html"].replace("&#39;", "'")
    )
    assert "Singular matrix" in caplog.text, "the log has the traceback"
    assert headline(outcome) in files["report.html"]


def test_one_window_held_out_tells_no_interval(made: Made) -> None:
    outcome = made("found")
    assert outcome.gap is not None
    gap = dataclasses.replace(outcome.gap, before=Share(0.2, np.nan, np.nan), after=Share(0.1, np.nan, np.nan))
    files = report_files(dataclasses.replace(outcome, gap=gap))
    assert json.loads(files["report.json"])["gap"]["intervals"]["before"] == [None, None]
    assert "residual before (of one window: no interval)" in files["report.html"] and "nan" not in files["report.html"]


def test_a_figure_that_fails_leaves_the_page(made: Made, monkeypatch, caplog) -> None:
    def fails(*_):
        raise ValueError("nothing to draw")

    monkeypatch.setattr("discrepancy.report.figures.averaged", fails)
    assert report_files(made("found"))["report.html"].count("<svg") == 3
    assert "the figure torque cannot be drawn" in caplog.text


def test_a_torque_is_averaged_over_windows_with_its_spread() -> None:
    """Two windows of three samples that lie in three cells, one of them shared by name alone: 1 and 3 give 2 ± √2."""
    values = np.array([[0.0, 0.5, 1.0], [0.0, 0.5, 1.0]])
    lacking = np.array([[1.0, 0.0, 5.0], [3.0, 0.0, 5.0]])
    middle, mean, spread = averaged(values, lacking, np.ones((2, 3), dtype=bool))
    assert mean.tolist() == [2.0, 0.0, 5.0] and spread == pytest.approx([np.sqrt(2.0), 0.0, 0.0])
    assert len(middle) == 3


def test_the_machine_holds_what_is_established_and_no_hint(filed: Filed) -> None:
    assert yaml.safe_load(filed("found")["machine.yaml"])["tone.size"] == pytest.approx(10.0, abs=0.3)
    assert "tone.size" not in filed("stands in")["machine.yaml"]


def test_what_is_said_of_the_machine_stands_in_its_file_and_on_the_page(made: Made) -> None:
    outcome = made("found")
    remark = "offset is nominal: the fit holds it at the bound of what is believable, so its number says nothing."
    answer = dataclasses.replace(outcome.answer, written=Written(outcome.answer.written.place, "", (remark,)))
    files = report_files(dataclasses.replace(outcome, answer=answer))
    assert files["machine.yaml"].startswith(f"# {remark}\n")
    assert "offset is nominal" in files["report.html"]


@pytest.mark.parametrize(
    ("held_back", "bounds_hit", "said"),
    [("it predicts worse", (), "the nominal ones."), ("", (), "them."), ("", ("offset",), "them, but for those held")],
)
def test_the_page_tells_which_numbers_the_machine_holds(made: Made, held_back: str, bounds_hit, said: str) -> None:
    outcome = made("found")
    found = Written(outcome.answer.written.place, held_back, ())
    calibration = dataclasses.replace(outcome.answer.calibration, bounds_hit=bounds_hit)
    answer = dataclasses.replace(outcome.answer, written=found, calibration=calibration)
    page = report_files(dataclasses.replace(outcome, answer=answer))["report.html"]
    assert f"These are the most believable values. machine.yaml holds {said}" in page


@pytest.mark.parametrize(
    ("held_back", "with_names"), [("", True), ("it predicts worse", True), ("it predicts worse", False)]
)
def test_what_to_do_says_which_machine_is_written(made: Made, held_back: str, with_names: bool) -> None:
    outcome = made("found")
    place = outcome.answer.written.place if with_names else outcome.answer.base.place
    answer = dataclasses.replace(outcome.answer, written=Written(place, held_back, ()))
    said = to_do(dataclasses.replace(outcome, answer=answer, question=None))
    which = "machine as the records show it" if not held_back else "nominal machine"
    assert said.endswith(f"machine.yaml is the {which}{' with what is named' if held_back and with_names else ''}.")


def test_numbers_have_no_more_digits_than_their_interval_bears() -> None:
    assert ranged(Estimate("k", "N m/rad", 8113.27, 7914.2, 8316.1, 8000.0, 0.1)) == "8110 N m/rad, 7910 to 8320"
    assert ranged(Estimate("c", "N s/m", 198.27, 172.0, 226.4, 0.0, None)) == "200 N s/m, 170 to 230"
    assert (percent(0.0432), percent(0.5), percent(0.996), percent(0.0)) == ("4.3 %", "50 %", "99.6 %", "0 %")


def test_a_label_that_is_no_number_has_no_unit() -> None:
    directions = ("forwards", "backwards", "at rest")
    assert [_tick(label) for label in (*directions, "2.5 s")] == [*directions, "2.5"]
    assert _titled("direction", directions[::-1]) == "direction" and _titled("time", ("0 s", "2 s")) == "time [s]"


def test_the_calibrated_machine_has_no_infinite_bound(made: Made) -> None:
    outcome = made("found")
    offset = Estimate("offset", "N", 0.01, 0.0, math.inf, 0.0, 0.1)
    calibration = dataclasses.replace(outcome.answer.calibration, estimates=(offset,))
    answer = dataclasses.replace(outcome.answer, calibration=calibration)
    page = report_files(dataclasses.replace(outcome, answer=answer))["report.html"]
    assert "0 to no bound</td>" in page


def test_an_interval_without_an_end_says_so() -> None:
    told = Estimate("torque", "N m", 891.1, 0.0, math.inf, 0.0, None)
    assert ranged(told) == "890 N m, 0 to no bound"


def test_where_the_remainder_comes_from_is_said_in_report_and_page(made: Made) -> None:
    origin = Origin(PLACES[0], 0.7, (PLACES[1],), (FLOOR,))
    files = report_files(dataclasses.replace(made("remainder"), origin=origin))
    said = (
        "Of the causes that were compared, a torque on the table that follows the cam's phase is the most likely "
        "(among them it is the indexer, the output joint or the table, varying with phase, with 60 %); these records "
        "hardly tell it from a torque on the cam shaft that follows the cam's phase; beside it they show blows to the "
        "base, which rings at 31 Hz."
    )
    told = json.loads(files["report.json"])["remains"]["origin"]
    assert told["in_words"] == said and (told["joint"], told["kind"], told["share"]) == ("output", "phase", 0.7)
    assert [other["joint"] for other in told["others"]] == ["input"] and told["beside"] == [FLOOR.name]
    assert said.replace("'", "&#39;") in files["report.html"]
    assert json.loads(report_files(made("remainder"))["report.json"])["remains"]["origin"] is None


def out_of_time(monkeypatch) -> None:
    """The time allowed runs out once a first set was selected."""
    left = [True]

    def floated(search: Search, fitted: Fitted) -> Fitted:
        left[0] = False
        return fitted

    monkeypatch.setattr(Search, "in_time", lambda search: left[0])
    monkeypatch.setattr(Search, "_floated", floated)


@pytest.mark.parametrize(("alike", "grade"), [(("twin",), "family"), ((), "established")])
def test_what_is_known_to_look_alike_is_compared_though_time_ran_out(alike, grade, monkeypatch) -> None:
    """`tone` and its twin of the same shape; where it is not known to look alike, what was not compared is told."""
    subject = ChordSubject({"tone": 10.0}, TWINS)
    subject.model.library = {name: (effect(name, alike if name == "tone" else ()),) for name in ("tone", "twin")}
    monkeypatch.setattr(Race, "rival", lambda *_: False)
    out_of_time(monkeypatch)
    answer = run_chain(subject, 5).answer
    (finding,) = answer.findings
    assert not answer.selection.complete and finding.grade == grade
    assert ("The time allowed ran out before others were tried in its place" in finding.why) == (grade != "family")


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_nothing_behind_the_search_takes_its_answer_away(stop, monkeypatch) -> None:
    def fails(answer):
        raise stop

    monkeypatch.setattr("discrepancy.chain.question_of", fails)
    outcome = run_chain(ChordSubject({"tone": 10.0}), 5)
    assert outcome.answer.names == ("tone",) and len(outcome.failures) == 1
    assert "the findings stand" in outcome.failures[0]
    said = "Whether anything is open is not known, as that stage failed. machine.yaml is the machine"
    assert to_do(outcome).startswith(said) and said in report_files(outcome)["report.html"]


def test_a_page_whose_drawing_library_cannot_be_loaded_costs_the_page_alone(monkeypatch) -> None:
    """As with an MPLBACKEND that matplotlib does not know."""
    monkeypatch.setitem(sys.modules, "discrepancy.report.page", None)
    monkeypatch.delattr("discrepancy.report.page", raising=False)
    files = report_files(run_chain(ChordSubject({"tone": 10.0}), 5))
    assert "could not be drawn" in files["report.html"] and json.loads(files["report.json"])["verdict"] == "found"


def test_a_page_that_cannot_be_drawn_costs_the_page_alone(monkeypatch) -> None:
    def fails(outcome, whole):
        raise ValueError("no font")

    monkeypatch.setattr("discrepancy.report.page.page", fails)
    files = report_files(run_chain(ChordSubject({"tone": 10.0}), 5))
    assert "no font" in files["report.html"] and "report.json" in files["report.html"]
    assert json.loads(files["report.json"])["verdict"] == "found" and "machine.yaml" in files


@pytest.mark.parametrize(
    ("tolerance", "said"),
    [(None, "(1.70 times of it does not repeat from turn to turn)"), (0.2, "nothing else remains above the noise")],
)
def test_what_is_tolerated_does_not_remain(made: Made, tolerance: float | None, said: str) -> None:
    """1.7 times the noise does not repeat, or is tolerated, and 1.74 times remain."""
    answer = made("two").answer
    remains = dataclasses.replace(answer.remains, noise=1.7)
    answer = dataclasses.replace(answer, remains=remains, criteria=Criteria(tolerance=tolerance))
    assert said in headline(dataclasses.replace(made("two"), answer=answer))


def test_all_stages_go_by_the_noise_that_is_believed(made: Made) -> None:
    """Noise that was taken for three times too much, with a tone of the size of the other subject's."""
    subject = ChordSubject({"tone": 10.0})
    for k, name in ((5, "model"), (6, "held_out")):
        model = Loud({"tone": 10.0}, k)
        model.shows, model.y = 0.3, 0.3 * model.y
        model.shapes = {one: 0.3 * shape for one, shape in model.shapes.items()}
        setattr(subject, name, model)
    found, right = run_chain(subject, 5), made("found")
    assert found.of_records[0].startswith("The noise is 30 % of what the records themselves seem to show")
    assert not any("noise" in one for one in right.of_records)
    assert found.answer.noise_share == 0.3 and found.answer.model is not subject.model
    assert found.where is not None and right.where is not None and found.gap is not None and right.gap is not None
    assert found.where.level == pytest.approx(right.where.level)
    assert found.gap.before.value == pytest.approx(right.gap.before.value)
    assert content(found)["gap"]["noise_floor"] == pytest.approx(content(right)["gap"]["noise_floor"])
