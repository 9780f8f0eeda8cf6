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


def rows_of(cases: list[dict]) -> dict[str, list[str]]:
    """The cells of each row of the aims by its first."""
    lines = [line.strip("| ").split(" | ") for line in criteria(cases).splitlines()]
    return {first: rest for first, *rest in lines}


def test_intervals_of_one_case_miss_together() -> None:
    """20 cases of 8 parameters, two of which miss all: as uncertain as 2 of 20, down to 75 %; 16 misses of as many
    cases as there are intervals would go down to 84 %."""
    missed, held = [["table_inertia", 5.0, 5.3, 5.1, 5.5]] * 8, [["table_inertia", 5.2, 5.3, 5.1, 5.5]] * 8
    cases = [{**CASES[0], "intervals": missed if k < 2 else held} for k in range(20)]
    _, got, interval = rows_of(cases)["95 % intervals of the machine's parameters that hold the truth"]
    assert got == "144 of 160 (90.0 %)"
    assert float(interval.split("–")[0]) <= 76.0


def test_the_effect_named_worst_was_picked_for_it() -> None:
    """Three effects right in 20 of 20, 20 of 20 and 17 of 20: wide enough for all three, where 17 of 20 that were
    meant from the start have 64.0 to 94.8 %."""
    cases = [case(name, "named", [name], "right", 4.0) for name in ("a", "b", "c") for _ in range(20)]
    for one in cases[-3:]:
        one["outcome"] = "wrong"
    _, got, interval = rows_of(cases)["one effect, gap ≥ 3, play healthy: the effect named worst"]
    assert got == "c: 17 of 20 (85.0 %)"
    assert interval == "58.6–95.8 %, for 3 at once"


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
    got = {first: rest[1] for first, rest in rows_of([*CASES, *others, loose]).items() if rest}
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
