"""Tables of a challenge."""

from indexer_experiments.challenge.criteria import criteria
from indexer_experiments.challenge.score import confusion, summary


def case(hidden: str, verdict: str, names: list[str], outcome: str, gap: float) -> dict:
    return {
        "kind": "single", "play": "healthy", "hidden": [{"name": hidden}], "verdict": verdict, "names": names,
        "outcome": outcome, "gap": gap, "closed_share": 0.97, "cpu_s": 9.0, "wall_s": 12.0, "truth_s": 2.0,
        "intervals": [[f"{hidden}.size", 1.0, 1.1, 0.9, 1.2], ["table_inertia", 5.0, 5.3, 5.1, 5.5]],
    }  # fmt: skip


CASES = [
    case("friction.viscous", "named", ["friction.viscous"], "right", 4.0),
    case("friction.viscous", "named", ["drive.slip"], "wrong", 3.5),
    case("drive.slip", "none", [], "missed", 1.2),
]


def test_answers_are_counted_by_what_was_hidden() -> None:
    counted = confusion(CASES)
    assert counted["friction.viscous", "drive.slip"] == 1
    assert counted["drive.slip", "none"] == 1


def test_tables_hold_shares_by_size_and_effect() -> None:
    text = summary(CASES)
    assert "| single | healthy | ≥ 3 | 2 | 1 (50 %) |" in text
    assert "| friction.viscous | 1 of 2 | 0 of 0 | drive.slip 1 |" in text


def test_every_number_that_must_be_shown_has_its_row() -> None:
    others = [
        {**case("friction.viscous", verdict, names, outcome, 4.0), "kind": kind, "hidden": hidden}
        for kind, verdict, names, outcome, hidden in (
            ("none", "none", [], "right", []),
            ("none", "named", ["drive.slip"], "wrong", []),
            ("outside", "unexplained", [], "right", [{"name": "friction.viscous"}]),
            ("outside", "ambiguous", ["drive.slip"], "wrong", [{"name": "friction.viscous"}]),
            ("outside", "none", [], "missed", [{"name": "friction.viscous"}]),
            ("two", "named", ["friction.viscous"], "partly", [{"name": "friction.viscous"}, {"name": "drive.slip"}]),
        )
    ]
    loose = {**case("drive.slip", "named", ["drive.slip"], "right", 5.0), "play": "20"}
    got = {
        row.split(" | ")[0].removeprefix("| "): row.split(" | ")[2]
        for row in criteria([*CASES, *others, loose]).splitlines()
    }
    assert got["one effect, gap ≥ 3, play healthy: right name first"] == "1 of 2 (50.0 %)"
    assert got["one effect, gap ≥ 3, play healthy: the effect named worst"] == "friction.viscous: 1 of 2 (50.0 %)"
    assert got["one effect, gap ≥ 3, play none: right name first"] == "no case"
    assert got["one effect, gap ≥ 3, play 20: right name first"] == "1 of 1 (100.0 %)"
    assert got["nothing hidden: a name is given"] == "1 of 2 (50.0 %)"
    assert got["outside the library: no name, something remains"] == "1 of 3 (33.3 %)"
    assert got["outside the library: a wrong name"] == "1 of 3 (33.3 %)"
    assert got["two effects: both named"] == "0 of 1 (0.0 %)"
    assert got["closed share on the speed and load never fitted, median"] == "97.0 %"
    assert got["95 % intervals of effects' sizes that hold the truth"] == "2 of 2 (100.0 %)"
    assert got["95 % intervals of the machine's parameters that hold the truth"] == "0 of 2 (0.0 %)"
    assert got["time of a case by the clock, median"] == "12.0 s"
