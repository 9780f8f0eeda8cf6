"""The forward form with two joints, or two measured channels of one."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.forward_subject import ForwardSubject
from discrepancy.locate import locate
from discrepancy.locate.lines import with_found_lines
from discrepancy.locate.statistics import CHANNEL
from discrepancy.report.figures import _records
from discrepancy.subjects.base import View
from tests.discrepancy.drives.made import drive, start_of

FILE = """
parameters = {"mass": (2.0, "kg", 0.2), "inertia": (0.05, "kg m^2", 0.005)}
states = ("x", "w", "q", "v")
joints = {"axis": ("x", "w", "mass"), "pivot": ("q", "v", "inertia")}
channels = {"time": "t", "q": "q", "w": "w", "push": "push", "turn": "turn"}
noise = {"q": 0.001, "w": 0.01}
effects = ("friction.viscous",)


def rates(x, u, t, p):
    return x.w, u.push / p.mass, x.v, u.turn / p.inertia
"""

RATE = 200.0
T = np.arange(1200) / RATE


def two_joints(folder: Path, more: str = "") -> ForwardSubject:
    """An axis of which the speed is measured, and a pivot of which the angle is; seed 11."""
    rng = np.random.default_rng(11)
    rows = {
        "q": 0.3 * np.sin(3.0 * T) + 0.001 * rng.standard_normal(len(T)),
        "w": np.sin(2.0 * T) + 0.01 * rng.standard_normal(len(T)), "push": 4.0 * np.cos(2.0 * T),
        "turn": -0.05 * 2.7 * np.sin(3.0 * T),
    }  # fmt: skip
    units = {"q": "rad", "w": "m/s", "push": "N", "turn": "N m"}
    made = subject_of(drive(folder, FILE + more), [Record("a.csv", RATE, rows, units)])
    assert isinstance(made, ForwardSubject)
    return made


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> ForwardSubject:
    return two_joints(tmp_path_factory.mktemp("plain"))


def test_each_joint_has_the_unit_of_its_own_channel(plain: ForwardSubject) -> None:
    """The first channel is the pivot's."""
    assert [(s.position_unit, s.force_unit) for s in plain.model.scales] == [("m", "N"), ("rad", "N m")]


def test_what_is_known_at_a_joint_counts_in_that_joints_scales(plain: ForwardSubject, tmp_path: Path) -> None:
    stated = 'known = {"friction.viscous": {"coefficient": 0.02, "joint": 1}}\n'
    (known,) = two_joints(tmp_path, stated).model.known
    ((_, other),) = plain.model.hypotheses().values()
    (p,), (searched,) = known.parameters, other.parameters
    assert known.fixed == {"joint": 1.0} and p.nominal == 0.02
    assert (p.unit, p.scale, p.high) == (searched.unit, searched.scale, searched.high)


def _humming(view: View, of: tuple[float, ...]) -> View:
    """The view with what is found of a hum of 7.3 Hz of these amplitudes in its channels; seed 12."""
    channel = view.axis(CHANNEL).cells
    hum = np.where(channel >= 0, np.array(of)[channel], 0.0) * np.sin(2.0 * np.pi * 7.3 * view.time)
    return with_found_lines(view, (np.random.default_rng(12).standard_normal(hum.shape) + hum) * view.inside)


def test_several_channels_are_located_each_by_itself(plain: ForwardSubject) -> None:
    model = plain.model
    view = plain.view(model)
    place = start_of(plain)[1]
    found = locate(model, place, view, np.random.default_rng(1))
    assert {cell.axis for cell in found.cells} >= {"time", CHANNEL} and 0.5 < found.level < 1.5
    (line,) = _humming(view, (1.5, 1.5)).lines
    assert line.frequency == pytest.approx([7.3], abs=0.1)
    assert _humming(view, (0.0, 1.5)).lines == (), "it must stand in both"


def test_one_channel_is_drawn(plain: ForwardSubject) -> None:
    place = start_of(SimpleNamespace(model=plain.held_out))[1]  # type: ignore[arg-type]
    base = SimpleNamespace(name="none")
    answer = SimpleNamespace(base=base, accepted=base, held={"none": place}, held_out=plain.held_out)
    figure = _records(SimpleNamespace(answer=answer, subject=plain, extended=False))  # type: ignore[arg-type]
    above, below = figure.axes
    for line in (*above.lines, *below.lines):
        assert (np.diff(line.get_xdata()) > 0.0).all(), "time goes on"
    assert above.get_title().endswith("worst (q)") and above.get_ylabel() == "[rad]"
