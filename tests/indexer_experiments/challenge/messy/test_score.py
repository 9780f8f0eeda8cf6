"""Every line of the table, each with a case that fails it."""

import copy
import math

import pytest

from indexer_experiments.challenge.messy import score

EFFECT = {"name": "friction.coulomb", "level": 4.0, "parameters": {"torque": 2.0, "smoothing": 0.005}}
OTHER = {"name": "load.imbalance", "level": 4.0, "parameters": {"torque": 40.0, "phase": 6.2}}
DRAG = {"name": "drag.quadratic", "level": 1.5, "size": 0.1, "joint": "output", "kinds": ["speed", "phase"]}


def finding(*members: str, grade: str = "established", probability: float = 0.9, intervals: tuple = ()) -> dict:
    return {"grade": grade, "members": list(members), "place": "", "probability": probability,
            "intervals": [{"name": n, "low": a, "high": b} for n, a, b in intervals]}  # fmt: skip


def row(hidden: list, findings: list, **answer: object) -> dict:
    empty = {"verdict": "named", "reason": "", "remains": None, "machine": [], "gap_before": 2.0, "gap_after": 1.0,
             "gaps_held_out": [[2.0, 1.0]], "cpu_s": 10.0}  # fmt: skip
    return {"half": "tune", "hidden": hidden, "disturbances": [], "disturbed": 0.0, "machine": {"table_inertia": 5.0},
            "records": [{"turns": 2.5}], "answer": {**empty, "findings": findings, **answer}}  # fmt: skip


def got(rows: list[dict]) -> dict[str, str]:
    lines = score.messy_table(rows).split("\n\n")[0].splitlines()[2:]
    return {line.split(" | ")[0].removeprefix("| "): line.split(" | ")[2] for line in lines}


ONE = "one hidden: right name or its family among the established"
WRONG_NONE = "a wrong name among the established, nothing hidden"
WRONG_SOME = "a wrong name among the established, something hidden"
UNNAMED = "nothing hidden: an answer without a name"
TWO = "two hidden: both established"
SIZES = "effects' sizes: 95 % intervals that hold the truth"
MACHINE = "the machine's parameters, common scale included: the same"
ERROR = "probabilities: expected calibration error"
HELD = "machine.yaml makes the gap on a record held out larger"
LARGER = "machine.yaml makes the gap on the judging record larger"
REMAINS = "what remains points at the right joint and kind"
MEDIAN, MOST = "processor time of a case, median", "processor time of a case, 95 %"


def test_one_hidden() -> None:
    """The name, or a family that holds it; a hint, another name or nothing is not enough."""
    right = [finding("friction.coulomb")], [finding("offset", "friction.coulomb", grade="family")]
    wrong = [finding("friction.coulomb", grade="stands in")], [finding("friction.viscous")], []
    assert got([row([EFFECT], f) for f in (*right, *wrong)])[ONE] == "2 of 5 (40.0 %)"


def test_wrong_names_are_counted_apart_where_nothing_and_where_something_is_hidden() -> None:
    named = [finding("friction.viscous")]
    rows = [row([], named), row([], []), row([EFFECT], named), row([EFFECT], [finding("friction.coulomb")])]
    rows.append(row([EFFECT], [finding("friction.coulomb"), finding("drive.slip", "roller.crack", grade="family")]))
    rows.append(row([], [finding("friction.viscous", grade="stands in")]))
    table = got(rows)
    assert table[WRONG_NONE] == "1 of 3 (33.3 %)"
    assert table[WRONG_SOME] == "2 of 3 (66.7 %)"


def test_nothing_hidden_wants_an_answer_without_a_name() -> None:
    rows = [row([], []), row([], [finding("drive.slip", grade="stands in")]), row([], [finding("drive.slip")])]
    rows += [row([], [], verdict=verdict) for verdict in ("turned away", "out of time", "failed")]
    assert got(rows)[UNNAMED] == "2 of 6 (33.3 %)"


def test_two_hidden_want_a_finding_each() -> None:
    both = [finding("friction.coulomb"), finding("load.imbalance")]
    shared = [finding("friction.coulomb", "load.imbalance", grade="family")]
    crossed = [shared[0], finding("friction.coulomb")]
    rows = [row([EFFECT, OTHER], f) for f in (both, shared, crossed, both[:1], [])]
    assert got(rows)[TWO] == "2 of 5 (40.0 %)"


def test_intervals_of_sizes_hold_the_truth_or_not() -> None:
    """Those of a wrong finding or a hint are not asked; a phase is taken in the turn of its interval."""
    torque = ("friction.coulomb.torque", 1.9, 2.1)
    rows = [
        row([EFFECT], [finding("friction.coulomb", intervals=(torque,))]),
        row([EFFECT], [finding("friction.coulomb", intervals=(("friction.coulomb.torque", 2.1, 2.3),))]),
        row([EFFECT], [finding("friction.coulomb", grade="stands in", intervals=(torque,))]),
        row([EFFECT], [finding("friction.viscous", intervals=(("friction.viscous.coefficient", 0.0, 9.0),))]),
        row([OTHER], [finding("load.imbalance", intervals=(("load.imbalance.phase", -0.2, 0.0),))]),
    ]
    assert got(rows)[SIZES] == "2 of 3 (66.7 %)"


@pytest.mark.parametrize(("low", "high"), [(-math.inf, math.inf), (1.0, 7.5)])
def test_a_phase_of_which_nothing_is_told_holds_any(low: float, high: float) -> None:
    named = finding("load.imbalance", intervals=(("load.imbalance.phase", low, high),))
    assert score.size_intervals(row([OTHER], [named])) == [True]


def test_intervals_of_the_machine_hold_the_truth_or_not() -> None:
    """A common scale that is 10 % off misses with every parameter."""

    def interval(low: float, high: float) -> list:
        return [{"name": "table_inertia", "low": low, "high": high}, {"name": "record 0.speed", "low": 0, "high": 1}]

    rows = [row([], [], machine=interval(4.9, 5.1)), row([], [], machine=interval(5.4, 5.6))]
    assert got(rows)[MACHINE] == "1 of 2 (50.0 %)"


def at(probability: float, hits: int, of: int) -> list[dict]:
    """So many findings of one probability, of which some are right."""
    names = ["friction.coulomb"] * hits + ["friction.viscous"] * (of - hits)
    return [row([EFFECT], [finding(name, probability=probability)]) for name in names]


def test_probabilities_are_compared_with_shares_bin_by_bin() -> None:
    """Ten findings at 0.9 of which nine are right: 0; the same at 1.0 and six right: 0.4. Two that lie on either side
    do not make up for each other."""
    assert score.calibration_error(at(0.9, 9, 10)) == (pytest.approx(0.0), 10)
    assert score.calibration_error(at(1.0, 6, 10)) == (pytest.approx(0.4), 10)
    assert score.calibration_error([*at(0.95, 0, 1), *at(0.05, 1, 1)]) == (pytest.approx(0.95), 2)
    assert math.isnan(score.calibration_error([])[0])
    assert got(at(1.0, 6, 10))[ERROR] == "40.0 %"


def test_the_calibration_error_is_told_beside_that_of_chance() -> None:
    """Of one finding of 0.5 the error is 0.5 whatever comes; of many it falls with the root of their number."""
    assert score.error_by_chance(at(0.5, 1, 1)) == pytest.approx(0.5)
    assert score.error_by_chance(at(0.5, 50, 100)) == pytest.approx(0.5 * math.sqrt(2.0 / math.pi) / 10.0, rel=0.1)
    assert score.error_by_chance(at(1.0, 9, 10)) == 0.0
    assert "10 findings, 10 bins; 0.0 % by chance" in score.messy_table(at(1.0, 9, 10))


def test_machine_yaml_is_never_worse() -> None:
    """Equal is as good; no machine.yaml is not asked; one that cannot run is worse."""
    rows = [row([], [], gap_after=g) for g in (1.0, 2.0, 2.05, 2.5, math.inf, None)]
    assert got(rows)[LARGER] == "2 of 5 (40.0 %)"


def test_machine_yaml_is_worse_where_it_is_on_any_record_held_out() -> None:
    gaps = [[2.0, 1.0]], [[2.0, 1.0], [2.0, 2.05]], [[2.0, 1.0], [2.0, 2.2]], [[2.0, math.inf]]
    rows = [row([], [], gaps_held_out=one) for one in gaps]
    assert got([*rows, row([], [], gap_after=None, gaps_held_out=[[2.0, None]])])[HELD] == "2 of 4 (50.0 %)"


@pytest.mark.parametrize(
    ("said", "right"),
    [
        ({"joint": "output", "kind": "speed"}, True),
        ({"joint": "output", "kind": "phase"}, True),
        ({"joint": "output", "kind": "time"}, False),
        ({"joint": "input", "kind": "speed"}, False),
        ({"joint": "", "kind": "speed"}, False),
        (None, False),
    ],
)
def test_what_remains_points_at_joint_and_kind(said: dict | None, right: bool) -> None:
    case = {**row([], [], remains=said), "disturbances": [DRAG], "disturbed": 1.5}
    assert got([case])[REMAINS] == ("1 of 1 (100.0 %)" if right else "0 of 1 (0.0 %)")


def test_a_minor_disturbance_is_not_what_remains() -> None:
    minor = {**DRAG, "level": 0.7, "joint": "sensor", "kinds": ["time"]}
    case = {**row([], [], remains={"joint": "sensor", "kind": "time"}), "disturbances": [DRAG, minor], "disturbed": 1.7}
    assert not score.pointed_at(case)
    assert score.pointed_at({**case, "disturbances": [DRAG, {**minor, "level": 0.8}]})


def test_in_short_records_station_and_time_are_one() -> None:
    case = {**row([], [], remains={"joint": "output", "kind": "station"}),
            "disturbances": [{**DRAG, "kinds": ["time"]}], "disturbed": 2.0}  # fmt: skip
    assert not score.pointed_at(case)
    assert score.pointed_at({**case, "records": [{"turns": 1.9}, {"turns": 1.2}]})


def test_disturbances_below_the_noise_are_not_asked_for() -> None:
    small = {**row([], []), "disturbances": [DRAG], "disturbed": 0.9}
    assert got([small])[REMAINS] == "no case"


def test_times() -> None:
    rows = [row([], [], cpu_s=float(k)) for k in range(1, 101)]
    table = got(rows)
    assert (table[MEDIAN], table[MOST]) == ("50.5 s", "95.0 s")


def test_other_tables_name_disturbances_effects_and_verdicts() -> None:
    case = {**row([EFFECT], [finding("friction.viscous")]), "disturbances": [DRAG], "disturbed": 1.5}
    other = copy.deepcopy({**case, "half": "judge"})
    text = score.messy_tables([case, other])
    assert "| drag.quadratic | 1 | 0 of 1 | 1 of 1 | 0 of 1 |" in text
    assert "| friction.coulomb | 0 of 1 | friction.viscous |" in text
    assert "| named | 0 | 1 | 0 |" in text
    assert text.index("half `tune`") < text.index("half `judge`")


def test_cases_of_different_limits_are_not_counted_together() -> None:
    case = {**row([], []), "disturbances": [DRAG], "disturbed": 1.5}
    text = score.messy_tables([{**case, "limit": 60.0}, {**case, "limit": 300.0}, {**case, "limit": None}])
    assert [line for line in text.splitlines() if line.startswith("## ")] == [
        "## Messy challenge, half `tune`, at most 60 s a case", "## Messy challenge, half `tune`, at most 300 s a case",
        "## Messy challenge, half `tune`",
    ]  # fmt: skip
    assert text.count("| drag.quadratic | 1 |") == 3
