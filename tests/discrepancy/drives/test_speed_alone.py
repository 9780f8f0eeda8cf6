"""A drive of which the speed alone is measured: its position is added up, and means another place in every record."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.effects import EFFECTS
from discrepancy.subjects.base import Subject
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import FILE, drive, motion
from tests.discrepancy.drives.test_forward import FILE as PENDULUM

PLACED = {name for name, effect in EFFECTS.items() if effect.placed}


PLACELESS = PENDULUM.replace("sin(x.q)", "cos(3.0 * t)").replace("import sin", "import cos")
"""Its forward form with a weight that does not ask where it is."""


def _made(folder: Path, text: str, count: int) -> Subject:
    records = []
    for k in range(count):
        _, _, v, a = motion(shift=0.7 * k)
        rows = {"v": v, "force": 95.0 * a} if "def force" in text else {"v": v, "u": 0.05 * a}
        units = {"v": "rad/s", "force": "N m", "u": "N m"}
        records.append(Record(f"{k}.csv", 500.0, rows, {role: units[role] for role in rows}))
    return subject_of(drive(folder, text.replace('"q": "q"', '"v": "v"')), records)


@pytest.mark.parametrize("text", [FILE, PLACELESS], ids=["inverse", "forward"])
def test_the_position_is_said_to_be_added_up(text: str, tmp_path: Path) -> None:
    one, two = (_made(tmp_path, text, count) for count in (1, 2))
    said = "The position q is added up from the speed and is 0 at {} record's first sample{}."
    assert said.format("the", "") in one.notes
    assert said.format("each", ", so that effects over it are not looked for") in two.notes
    assert PLACED & set(one.model.hypotheses()) and not PLACED & set(two.model.hypotheses())
    assert {form.over for form in two.forms()} == {"speed [rad/s]"}


def test_effects_over_the_position_are_those_that_a_shift_of_it_changes(tmp_path: Path) -> None:
    model = subject_of(drive(tmp_path), [Record("a.csv", 500.0, _rows(), {"q": "rad", "force": "N m"})]).model
    (track,) = model.tracks
    shifted = dataclasses.replace(track, q=track.q + 0.37, name="shifted")
    for name, hypotheses in model.hypotheses().items():
        effect = EFFECTS[name]
        if effect.acts == "reading":
            continue
        start = hypotheses[0].starts[-1]
        rows = [np.asarray(model._term(m, effect, hypotheses[0], start, (90.0,))) for m in (track, shifted)]
        changed = float(np.abs(rows[1] - rows[0]).max()) > 1e-6 * max(float(np.abs(rows[0]).max()), 1e-12)
        assert changed == effect.placed, name


WEIGHED = FILE.replace("p.mass * a", "p.mass * a + p.weight * np.sin(QQ)").replace(
    '(90.0, "kg", 15.0)', '(90.0, "kg", 15.0), "weight": (6.0, "N m", 1.0)'
)
"""The inverse form with a weight."""


def _written(form: str, zero: bool, sessions: bool) -> str:
    """A file whose equation asks where q is; with a parameter that says so, which may be one of each record."""
    text, q = {"inverse": ("import numpy as np\n" + WEIGHED.replace("QQ", "q"), "q"), "forward": (PENDULUM, "x.q")}[
        form
    ]
    if zero:
        text = text.replace(f"sin({q})", f"sin({q} + p.q0)")
        text = text.replace("parameters = {", 'parameters = {"q0": (0.0, "rad", 1.0), ')
    return text + "\nsessions = ('q0',)\n" * sessions


@pytest.mark.parametrize("form", ["inverse", "forward"])
@pytest.mark.parametrize("count", [1, 2])
def test_an_equation_that_asks_where_it_is_must_say_so(form: str, count: int, tmp_path: Path) -> None:
    written = {"inverse": "q", "forward": "x.q"}[form]
    more = ", and sessions = ('q0',)" if count > 1 else ""
    said = f"write {written} + p.q0 for {written}, with q0: (0.0, 'rad', UNCERTAINTY) among the parameters{more}."
    with pytest.raises(IndexerError, match=f"{re.escape(said)}$"):
        _made(tmp_path, _written(form, False, False), count)
    assert _made(tmp_path, _written(form, True, count > 1), count).notes
    if count > 1:
        with pytest.raises(IndexerError, match=f"{re.escape(said)}$"):
            _made(tmp_path, _written(form, True, False), count)


def test_a_law_with_a_step_in_it_asks_where_it_is(tmp_path: Path) -> None:
    """Where a small shift meets no sample."""
    text = "import numpy as np\n" + WEIGHED.replace("np.sin(QQ)", "np.sign(np.round(q - 0.0712345, 1))")
    with pytest.raises(IndexerError, match="force must not change with where q is 0"):
        _made(tmp_path, text, 1)


def test_a_shift_that_the_parameters_can_make_up_for_is_none(tmp_path: Path) -> None:
    """A spring of unknown rest."""
    text = WEIGHED.replace("p.weight * np.sin(QQ)", "50.0 * q + p.weight")
    assert _made(tmp_path, text, 1).notes


def _rows() -> dict[str, np.ndarray]:
    _, q, _, a = motion()
    return {"q": q, "force": 95.0 * a}
