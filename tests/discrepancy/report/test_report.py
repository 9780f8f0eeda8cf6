"""The report of a drive with hidden friction: every key, a page without the network, a machine with what was found."""

import dataclasses
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
import yaml

from discrepancy.chain import STAGES, Outcome, run_chain
from discrepancy.emps import EmpsModel, Motion
from discrepancy.findings import Estimate
from discrepancy.report import headline, report_files
from discrepancy.report.words import percent, ranged
from discrepancy.subjects.emps import EmpsSubject

KEYS = {"verdict", "effects", "ranking", "gap", "where", "calibration", "seed", "version"}


def drives(friction: float) -> EmpsSubject:
    """Seed 2: two motions of 7 s at 1 kHz, 95 kg, 200 N s/m known, dry friction, 0.3 N of noise."""
    rng = np.random.default_rng(2)
    time = np.arange(7000) * 1e-3
    made = []
    for shift in (0.0, 0.7):
        position = 0.1 * np.sin(1.3 * time + shift) + 0.03 * np.sin(4.1 * time)
        rate = np.gradient(position, 1e-3)
        motion = Motion(position, rate, np.gradient(rate, 1e-3), 1e-3)
        force = 95.0 * motion.acceleration + 200.0 * rate + friction * motion.sign
        made.append(EmpsModel(motion, force + 0.3 * 3.0 * rng.standard_normal(len(time)), 0.3, ("friction.viscous",)))
    return EmpsSubject(made[0], made[1])


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    seen: list[str] = []
    found = run_chain(drives(20.0), 5, seen.append)
    assert tuple(seen) == STAGES
    return found


@pytest.fixture(scope="module")
def files(outcome: Outcome) -> dict[str, str]:
    return report_files(outcome)


def test_json_has_every_key_and_the_friction(files: dict[str, str]) -> None:
    report = json.loads(files["report.json"])
    assert report.keys() >= KEYS
    assert (report["verdict"], report["seed"]) == ("named", 5)
    (effect,) = report["effects"]
    (force,) = effect["parameters"]
    assert (effect["name"], force["name"], force["unit"]) == ("friction.coulomb", "force", "N")
    assert force["interval"][0] < 20.0 < force["interval"][1] and force["value"] == pytest.approx(20.0, rel=0.02)
    gap = report["gap"]
    assert {"metric", "noise_floor", "before", "after", "closed_share"} <= gap.keys()
    assert gap["noise_floor"] < gap["after"] * 1.2 < gap["before"] and gap["closed_share"] > 0.98
    low, high = gap["intervals"]["closed_share"]
    assert low <= gap["closed_share"] <= high
    names = [row["name"] for row in report["ranking"]]
    assert names[0] == "friction.coulomb" and "none" in names
    assert sum(row["probability"] for row in report["ranking"]) == pytest.approx(1.0)
    assert report["where"] and {"axis", "cell", "level", "p"} <= report["where"][0].keys()
    assert "NaN" not in files["report.json"] and "Infinity" not in files["report.json"]


def test_the_page_opens_offline_and_says_the_verdict_first(outcome: Outcome, files: dict[str, str]) -> None:
    page = files["report.html"]

    class Links(HTMLParser):
        found: tuple[str, ...] = ()

        def handle_starttag(self, tag: str, attrs: list) -> None:
            outside = [v for k, v in attrs if k in ("src", "href") and v and not v.startswith("#")]
            self.found += tuple(outside) + ((tag,) if tag in ("script", "link", "img") else ())

    reader = Links()
    reader.feed(page)
    assert reader.found == ()
    assert page.count("<svg") == 3
    text = re.sub(r"<(style|svg).*?</\1>", "", page, flags=re.DOTALL)
    assert text.index(headline(outcome)) < text.index("What was found") < text.index("What was compared")
    assert "url(http" not in page and "{{" not in page


def test_a_name_with_dollars_is_no_formula(outcome: Outcome, monkeypatch) -> None:
    view = EmpsSubject.view
    odd = ("run_$1_{$2.csv",)
    monkeypatch.setattr(EmpsSubject, "view", lambda self, model: dataclasses.replace(view(self, model), names=odd))
    assert "run_$1_{$2.csv" in report_files(outcome)["report.html"]


def test_a_report_is_the_same_for_the_same_seed(outcome: Outcome, files: dict[str, str]) -> None:
    again = report_files(run_chain(drives(20.0), 5))
    assert again["report.json"] == files["report.json"] and again["report.html"] == files["report.html"]


def test_the_machine_says_what_was_found(files: dict[str, str]) -> None:
    machine = yaml.safe_load(files["machine.yaml"])
    assert machine["mass"] == pytest.approx(95.0, rel=0.02)
    assert machine["effects"]["friction.coulomb"]["force"] == pytest.approx(20.0, rel=0.02)


def test_nothing_is_named_where_nothing_is_missing() -> None:
    outcome = run_chain(drives(0.0), 5)
    files = report_files(outcome)
    report = json.loads(files["report.json"])
    assert (report["verdict"], report["effects"], report["where"]) == ("none", [], [])
    assert headline(outcome).startswith("Nothing is missing")
    assert "is enough" in re.search(r"<b>none</b>.*?</tr>", files["report.html"], flags=re.DOTALL)[0]  # type: ignore[index]
    assert report["gap"]["closed_share"] is None and "no gap to close" in files["report.html"]
    assert "friction.coulomb" not in yaml.safe_load(files["machine.yaml"])["effects"]


@pytest.mark.parametrize("verdict", ["unexplained", "not_converged"])
def test_a_refusal_adds_nothing(outcome: Outcome, verdict: str) -> None:
    answer = dataclasses.replace(outcome.answer, verdict=verdict, reason="nothing fits")
    refused = dataclasses.replace(
        outcome, answer=answer, effects=(), after=outcome.before, where_after=outcome.where, next=()
    )
    files = report_files(refused)
    assert json.loads(files["report.json"])["effects"] == []
    assert "nothing fits" in headline(refused) and "What was found" not in files["report.html"]
    assert yaml.safe_load(files["machine.yaml"])["effects"].keys() == {"friction.viscous"}


def test_what_was_fitted_in_any_round_was_not_ruled_out_before(outcome: Outcome) -> None:
    """The last round of a refused answer is one of another model, beside an effect found before."""
    answer = outcome.answer
    last = dataclasses.replace(answer.first, candidates=answer.first.candidates[-1:])
    again = dataclasses.replace(
        answer, verdict="unexplained", rounds=(answer.first, last), effects=(answer.effects[0], answer.effects[0])
    )
    refused = dataclasses.replace(outcome, answer=again, effects=(), after=outcome.before, next=())
    files = report_files(refused)
    said = re.search(r"Ruled out before a full fit.*?</p>", files["report.html"], flags=re.DOTALL)
    fitted = {candidate.name for candidate in answer.first.candidates}
    assert "friction.coulomb" in fitted and said is not None
    assert not any(name in said[0] for name in fitted)
    assert "with friction.coulomb in place, found before" in files["report.html"]
    assert json.loads(files["report.json"])["ranking_beside"] == ["friction.coulomb"]


def test_numbers_have_no_more_digits_than_their_interval_bears() -> None:
    assert ranged(Estimate("k", "N m/rad", 8113.27, 7914.2, 8316.1, 8000.0, 0.1)) == "8110 N m/rad, 7910 to 8320"
    assert ranged(Estimate("c", "N s/m", 198.27, 172.0, 226.4, 0.0, None)) == "200 N s/m, 170 to 230"
    assert (percent(0.0432), percent(0.5), percent(0.996), percent(0.0)) == ("4.3 %", "50 %", "99.6 %", "0 %")
