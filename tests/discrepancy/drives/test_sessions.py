"""Values that differ from record to record: fitted for each, held-out ones too, and named where nobody said so."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

from discrepancy.criteria import Criteria
from discrepancy.drives.channels import Record
from discrepancy.drives.differing import differing
from discrepancy.drives.door import subject_of
from discrepancy.explain import explain
from discrepancy.fit import fit
from discrepancy.held_out import held_place
from discrepancy.place import Point
from discrepancy.subjects.base import Subject
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import drive, record, start_of, values

FILE = """
import numpy as np

parameters = {"mass": (90.0, "kg", 15.0), "Fc": (20.0, "N", 5.0)}
channels = {"time": "t", "q": "q", "force": "f"}


def force(q, v, a, u, t, p):
    return p.mass * a + p.Fc * np.sign(v)
"""

KNOWN = """
parameters = {"mass": (90.0, "kg", 15.0)}
channels = {"time": "t", "q": "q", "force": "f"}
known = {"friction.coulomb": {"force": 20.0}}


def force(q, v, a, u, t, p):
    return p.mass * a
"""

DAYS = (18.0, 26.0, 21.0)
"""Dry friction of the records [N]; the last one is held out."""


def of_days(levels: tuple[float, ...] = DAYS, drag: float = 0.0, zeros: tuple[float, ...] = (0.0,) * 3) -> list[Record]:
    """One record of each day, 95 kg; seeds 1, 2, 3."""
    return [
        record(
            lambda t, q, v, a, level=level, zero=zero: 95.0 * a + level * np.sign(v) + drag * v + zero,
            name=f"day_{k}.csv", seed=k, shift=0.4 * k, held_out=k == len(levels),
        )
        for k, (level, zero) in enumerate(zip(levels, zeros, strict=True), start=1)
    ]  # fmt: skip


def fitted(made: Subject) -> tuple[Point, dict[str, float]]:
    problem, place = start_of(made)
    place = fit(problem, place, steps=25).place
    return place, values(problem, place)


@pytest.mark.parametrize(("text", "name"), [(FILE, "Fc"), (KNOWN, "friction.coulomb.force")])
def test_a_parameter_of_each_record(text: str, name: str, tmp_path: Path) -> None:
    plain = subject_of(drive(tmp_path, text), of_days())
    made = subject_of(drive(tmp_path, f"{text}\nsessions = ({name!r},)\n"), of_days())
    place, got = fitted(made)
    assert place.level(made.model) < 0.2 * fitted(plain)[0].level(plain.model)
    assert [got[f"record {k}.{name}"] for k in (1, 2)] == pytest.approx(DAYS[:2], rel=0.02)
    assert got["mass"] == pytest.approx(95.0, rel=0.01) and name not in got
    held = held_place(place, made.held_out)
    assert held.level(made.held_out) == pytest.approx(place.level(made.model), rel=0.3)
    found = yaml.safe_load(made.files(made.model, place)["machine.yaml"])
    assert found["records"]["day_2.csv"][name] == pytest.approx(DAYS[1], rel=0.02)
    (said,) = made.of_records(made.model, place)  # nothing more differs
    assert said.startswith(f"{name} of each record [N]: 1") and said.endswith("(day_2.csv).")
    # the nominal drive has one value for all
    nominal = dataclasses.replace(place, z=np.zeros_like(place.z))
    assert "records" not in yaml.safe_load(made.files(made.model, nominal)["machine.yaml"])
    again = subject_of(made.drive, of_days(), found)
    assert fitted(again)[0].level(again.model) == pytest.approx(place.level(made.model), rel=0.02)
    assert any(f"has its own: {name}" in note for note in made.notes)


def test_what_records_own_values_can_do_is_not_looked_for(tmp_path: Path) -> None:
    """An offset of each record takes the effect's place, and a parameter of that name is the drive's own."""
    own = f'{FILE}\nsessions = ("Fc", "offset")\n'
    left_out = subject_of(drive(tmp_path, own), of_days()).model.left_out
    assert "offset" in left_out and "offset" not in subject_of(drive(tmp_path, FILE), of_days()).model.left_out
    names = FILE.replace('"Fc"', '"offset"').replace("p.Fc", "p.offset")
    made = subject_of(drive(tmp_path, f"{names}\nsessions = True\n"), of_days())
    assert [p.name for p in made.model.parameters] == ["mass", "record 1.offset", "record 2.offset"]


def test_a_record_held_out_flatters_no_effect(tmp_path: Path) -> None:
    """Its own dry friction is fitted without the drag as well, so that only the drag's own share counts as closed;
    where no drag is missing nothing is found."""
    # above 20 Hz the sign of a smoothed speed differs from dry friction at reversals, which presliding stands in for
    text = f'{FILE}\nsessions = ("Fc", "offset")\neffects = ("friction.*", "spring.linear")\ncutoff = 18.75\n'
    made = subject_of(drive(tmp_path, text), of_days(drag=60.0, zeros=(3.0, -4.0, 6.0)))
    answer = explain(made.model, made.held_out)
    assert answer.names == ("friction.viscous",)
    assert answer.findings[0].effects[0].parameters[0].value == pytest.approx(60.0, rel=0.05)
    before = answer.held[answer.base.name]
    own = dict(zip((p.name for p in made.held_out.parameters), before.z, strict=True))
    assert own["record 1.offset"] != 0.0 and own["record 1.Fc"] != 0.0, "of the model as it came as well"
    made = subject_of(drive(tmp_path, text), of_days(zeros=(3.0, -4.0, 6.0)))
    assert explain(made.model, made.held_out).verdict == "nothing missing"


@pytest.mark.parametrize(
    ("text", "name", "lines"),
    [
        (FILE, "Fc", "sessions = ('Fc', 'offset')"),
        (f"{FILE}\nsessions = ('mass',)\n", "Fc", "sessions = ('mass', 'Fc', 'offset')"),
        (KNOWN, "friction.coulomb.force", "sessions = ('friction.coulomb.force', 'offset')"),
        (
            KNOWN.replace("known", "_known"), "friction.coulomb.force",
            "known = {'friction.coulomb': {'force': 21.97}} and sessions = ('friction.coulomb.force', 'offset')",
        ),
    ],
)  # fmt: skip
def test_records_that_differ_are_told_with_the_line_to_write(text: str, name: str, lines: str, tmp_path: Path) -> None:
    made = subject_of(drive(tmp_path, text), of_days(zeros=(3.0, -4.0, 6.0)))
    place = fitted(made)[0]
    found, share = differing(made.model, place, Criteria())
    assert {one.name: one.values for one in found} == {
        name: pytest.approx(DAYS[:2], rel=0.02), "offset": pytest.approx((3.0, -4.0), rel=0.02),
    }  # fmt: skip
    assert share == pytest.approx(1.0, abs=0.03)
    said = made.of_records(made.model, place)[-1]
    assert said.startswith(f"Records seem to differ: {name} is 1") and said.endswith(f"write {lines} into my_drive.py.")


def test_records_that_do_not_differ_are_not_said_to(tmp_path: Path) -> None:
    """Alike at the noise; alike where drag is missing and motions differ; and where friction grows within each record,
    by another rate: stretches of a record then differ as records do."""

    def said(records: list[Record]) -> tuple[str, ...]:
        made = subject_of(drive(tmp_path, FILE), records)
        return made.of_records(made.model, fitted(made)[0])

    same = (20.0, 20.0, 20.0)
    assert not said(of_days(same)) and not said(of_days(same, drag=60.0))
    hum = [
        record(lambda t, q, v, a, Fc=Fc: 95.0 * a + Fc * np.sign(v) + 9.0 * np.sin(40.0 * t), name=f"{Fc}.csv", seed=5)
        for Fc in (20.0, 20.6)
    ]
    assert not said(hum), "a hundredth of what remains"
    growing = [
        record(lambda t, q, v, a, rate=rate: 95.0 * a + (20.0 + rate * t) * np.sign(v), name=name, seed=4)
        for name, rate in (("slow.csv", 0.5), ("fast.csv", 1.5))
    ]
    assert not said(growing)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('sessions = "Fc"', "sessions must be a tuple of names of parameters"),
        ('sessions = ("FC",)', "got 'FC'; did you mean 'Fc'"),
        ('sessions = ("friction.coulomb.force",)', "they are offset, mass, Fc"),
        ('session = ("Fc",)', "did you mean 'sessions'"),
    ],
)
def test_a_mistake_is_one_sentence(line: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said) as raised:
        subject_of(drive(tmp_path, f"{FILE}\n{line}\n"), of_days())
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")
