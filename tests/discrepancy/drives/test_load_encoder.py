"""A drive with an encoder of its own at the load: stiffness, damping and play of the joint in the inverse form."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from discrepancy.chain import run_chain
from discrepancy.drives.channels import Record, read_drive_records
from discrepancy.drives.description import LOAD
from discrepancy.drives.door import subject_of
from discrepancy.drives.effects import EFFECTS
from discrepancy.drives.motions import imagined
from discrepancy.drives.second_look import known_effects
from discrepancy.explain import explain
from discrepancy.fit import fit
from discrepancy.model import NONE
from discrepancy.report import report_files
from discrepancy.subjects.base import Subject
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import drive, motion, start_of, values

UNITS = {"q": "rad", "q_load": "rad", "force": "N m"}

JOINT = """
parameters = {"motor": (1.1, "kg m^2", 0.2), "k": (900.0, "N m/rad", 200.0)}
channels = {"time": "t", "q": "q", "q_load": "x", "force": "f"}


def force(q, v, a, u, t, p):
    return p.motor * a + p.k * (q - u.q_load)
"""

DAMPED = JOINT.replace("200.0)}", '200.0), "r": (5.0, "N m s/rad", 2.0)}').replace(
    "u.q_load)", "u.q_load) + p.r * (v - u.v_load)"
)

JOINTS = {name for name in EFFECTS if name.startswith("joint.")}

RIGID = """
parameters = {"inertia": (2.6, "kg m^2", 0.2)}
channels = {"time": "t", "q": "q", "q_load": "x", "force": "f"}


def force(q, v, a, u, t, p):
    return p.inertia * a
"""


def coupled(play: float = 0.0, damping: float = 4.0, zero: float = 0.0, seed: int = 1, **told: object) -> Record:
    """Motor of 1 and load of 1.5 kg m², 1000 N m/rad between them, the motor under control, by SciPy's solver; encoders
    with 1 µrad of noise, the load's zeroed elsewhere."""
    rate = 500.0
    t = np.arange(round(12.0 * rate)) / rate
    waves = [(0.6, 2.1, 0.3 * seed), (0.2, 7.3, 1.0), (0.04, 21.0, 2.0)]

    def wanted(at: np.ndarray | float, order: int) -> np.ndarray | float:
        return sum(s * w**order * np.sin(w * at + p + 0.5 * np.pi * order) for s, w, p in waves)

    def torque(at: np.ndarray | float, q: np.ndarray | float, v: np.ndarray | float) -> np.ndarray | float:
        return 2.5 * wanted(at, 2) + 4000.0 * (wanted(at, 0) - q) + 150.0 * (wanted(at, 1) - v)

    def passed(d: float, rate_: float) -> float:
        beyond = d - min(max(d, -0.5 * play), 0.5 * play)
        return 1000.0 * beyond + damping * rate_ * (beyond != 0.0 or play == 0.0)

    def rates(at: float, s: np.ndarray) -> list[float]:
        q, v, x, y = s
        moment = passed(q - x, v - y)
        return [v, float(torque(at, q, v)) - moment, y, moment / 1.5]

    start = [wanted(0.0, 0), wanted(0.0, 1), wanted(0.0, 0), wanted(0.0, 1)]
    found = solve_ivp(rates, (0.0, t[-1]), start, "LSODA", t_eval=t, rtol=1e-7, atol=1e-9, max_step=2e-3)
    q, v, x, _ = found.y
    rng = np.random.default_rng(seed)
    rows = {
        "q": q + 1e-6 * rng.standard_normal(len(t)),
        "q_load": x + zero + 1e-6 * rng.standard_normal(len(t)),
        "force": torque(t, q, v) + 0.05 * rng.standard_normal(len(t)),
    }
    return Record(f"{seed}.csv", rate, rows, UNITS, **told)


def made(folder: Path, text: str, *records: Record) -> Subject:
    return subject_of(drive(folder, text), records)


def fitted(subject: Subject, *names: str) -> tuple[float, dict[str, float]]:
    """Level and values from the best of three starts of the effects named."""
    chosen = [subject.model.hypotheses()[name][0] for name in names]
    tried = [start_of(subject, *chosen, start=start) for start in range(3)]
    problem, place = min(((p, fit(p, at, steps=25).place) for p, at in tried), key=lambda pair: pair[1].cost)
    return place.level(subject.model), values(problem, place)


def test_damping_of_a_joint(tmp_path: Path) -> None:
    level, got = fitted(made(tmp_path, JOINT, coupled()), "joint.damping")
    assert level < 1.3
    assert got["joint.damping.damping"] == pytest.approx(4.0, rel=0.03)
    assert got["k"] == pytest.approx(1000.0, rel=0.01) and got["motor"] == pytest.approx(1.0, rel=0.01)


def test_stiffness_of_a_joint(tmp_path: Path) -> None:
    """The motor alone in the equation, and dampers of the joint known from the start."""
    text = JOINT.replace(', "k": (900.0, "N m/rad", 200.0)', "").replace(" + p.k * (q - u.q_load)", "")
    level, got = fitted(made(tmp_path, text, coupled()), "joint.stiffness", "joint.damping")
    assert level < 1.3 and got["joint.stiffness.stiffness"] == pytest.approx(1000.0, rel=0.01)


def test_a_load_that_a_rigid_model_takes_along(tmp_path: Path) -> None:
    level, got = fitted(made(tmp_path, RIGID, coupled()), "joint.load")
    assert level < 1.3
    assert got["joint.load.share"] == pytest.approx(0.6, abs=0.01) and got["inertia"] == pytest.approx(2.5, rel=0.01)


def test_play_of_a_joint_is_named(tmp_path: Path) -> None:
    """10 mrad of play in a joint that deflects by 130; the low-pass, 17 Hz, blurs its flanks."""
    subject = made(tmp_path, DAMPED, coupled(play=0.01))
    answer = explain(subject.model, subject.held_out)
    assert answer.names == ("joint.play",)
    sizes = {p.name: p.value for p in answer.findings[0].effects[0].parameters}
    assert sizes["play"] == pytest.approx(0.01, rel=0.08) and abs(sizes["middle"]) < 1e-3


def test_encoders_zeroed_elsewhere_take_a_parameter(tmp_path: Path) -> None:
    zeros = (0.3, -0.2)
    records = [coupled(zero=zero, seed=k) for k, zero in enumerate(zeros, start=1)]
    assert any("subtract a parameter" in note for note in made(tmp_path, JOINT, *records).notes)
    text = DAMPED.replace('"k":', '"zero": (0.0, "rad", 0.3), "k":').replace("u.q_load)", "u.q_load - p.zero)")
    level, got = fitted(made(tmp_path, f"{text}\nsessions = ('zero',)\n", *records))
    assert level < 1.3
    assert [got[f"record {k}.zero"] for k in (1, 2)] == pytest.approx([-zero for zero in zeros], rel=1e-3)
    assert not any("subtract a parameter" in note for note in made(tmp_path, JOINT, coupled()).notes)


def test_what_is_looked_for_fits_the_channels_and_the_equation(tmp_path: Path) -> None:
    def names(text: str, record: Record) -> set[str]:
        return set(made(tmp_path, text, record).model.hypotheses())

    seen = coupled()
    unseen = Record(seen.name, seen.rate, {k: v for k, v in seen.rows.items() if k != "q_load"}, UNITS)
    behind = {"play", "play.contact", "compliance"}
    assert names(RIGID, seen) & (behind | JOINTS) == {"joint.load", "joint.stiffness", "joint.damping"}
    assert names(JOINT, seen) & (behind | JOINTS) == {"joint.damping", "joint.play"}
    assert names(RIGID.replace(', "q_load": "x"', ""), unseen) & (behind | JOINTS) == behind


@pytest.mark.parametrize("name", sorted(JOINTS))
def test_an_effect_at_its_null_is_nothing(name: str, tmp_path: Path) -> None:
    rigid = RIGID if name in ("joint.load", "joint.stiffness") else JOINT
    model = made(tmp_path, rigid, coupled()).model
    hypothesis, own = model.hypotheses()[name][0], np.zeros(len(model.parameters))
    base = model.compared(0, NONE, own)[0]
    for start in hypothesis.starts[:3]:
        there = model.compared(0, hypothesis, np.concatenate([own, hypothesis.coordinates(start)]))[0]
        gone = model.compared(0, hypothesis, np.concatenate([own, hypothesis.coordinates((0.0, *start[1:]))]))[0]
        assert np.abs(there - base).max() > 1e-3
        np.testing.assert_allclose(gone, base, atol=1e-9)


def test_noise_of_the_loads_encoder_counts(tmp_path: Path) -> None:
    """1 mrad a sample: in an equation with the joint it is a torque, in a rigid one it is nothing. Seed 7."""
    quiet = coupled()
    q_load = quiet.rows["q_load"] + 1e-3 * np.random.default_rng(7).standard_normal(len(quiet.rows["q_load"]))
    noisy = dataclasses.replace(quiet, rows={**quiet.rows, "q_load": q_load})
    noise = {text: [float(made(tmp_path, text, r).model.noise[0]) for r in (quiet, noisy)] for text in (JOINT, RIGID)}
    assert noise[RIGID][1] == noise[RIGID][0]
    read = [made(tmp_path, JOINT, r).model.compared(0, NONE, np.zeros(2))[0] for r in (quiet, noisy)]
    assert noise[JOINT][1] == pytest.approx(float(np.std(read[1] - read[0])), rel=0.15)


def test_imagined_motions_take_the_load_along(tmp_path: Path) -> None:
    """Its speed and acceleration stay rates of its position; at half the pace the joint gives way a quarter as much."""
    subject = made(tmp_path, JOINT, coupled())
    view = subject.view(subject.model)
    assert view.torque and "deflection [rad]" in view.torque.over and view.axis("deflection")
    (track,) = subject.model.tracks
    found = dict(imagined(track))
    slow = found["the same path at 0.5 times the speed"]
    np.testing.assert_allclose(slow.deflection, 0.25 * track.deflection, atol=1e-12)
    # half the band: of white noise a position keeps 0.5^0.5, an acceleration 0.5^2.5
    assert (slow.cutoff, slow.wide) == pytest.approx((0.5 * track.cutoff, 0.5 * track.wide))
    for now, before in ((slow.motion_noise, track.motion_noise), *(
        (tuple(one.input_noise[name] for name in LOAD) for one in (slow, track)),
    )):  # fmt: skip
        assert now == pytest.approx([0.5 ** (k + 0.5) * noise for k, noise in enumerate(before)])
    for words, one in found.items():
        if "standstill" in words:
            still = one.v == 0.0
            assert still.sum() > 100 and not one.u.v_load[still].any() and not one.u.a_load[still].any()
        else:
            for row, rate in (("q_load", "v_load"), ("v_load", "a_load")):
                slope = np.gradient(getattr(one.u, row), one.step)
                np.testing.assert_allclose(slope[1:-1], getattr(one.u, rate)[1:-1], atol=0.02 * np.ptp(slope))


def test_a_law_of_the_joint_outside_the_library_is_tabulated(tmp_path: Path) -> None:
    """A torque of 4e4 N m/rad³ times the cube of the deflection, the motor's spring and damper known."""
    record = coupled(damping=5.0)
    cube = 4e4 * (record.rows["q"] - record.rows["q_load"]) ** 3
    record = dataclasses.replace(record, rows={**record.rows, "force": record.rows["force"] + cube})
    text = f"{DAMPED}\neffects = ('offset',)\n".replace("900.0", "1000.0").replace("200.0", "2.0").replace("1.1", "1.0")
    outcome = run_chain(made(tmp_path, text, record), 1)
    table = outcome.table
    assert outcome.answer.names == () and table is not None and table.closes > 0.95
    assert table.form.over == "deflection [rad]"
    for (place,), value in zip(table.form.places, table.values, strict=True):
        assert value.value == pytest.approx(4e4 * place**3, abs=2.0)
    machine = yaml.safe_load(report_files(outcome)["with_table.yaml"])
    second = subject_of(drive(tmp_path, text), [record], machine)
    assert start_of(second)[1].level(second.model) < 0.2 * start_of(made(tmp_path, text, record))[1].level(second.model)
    blind = drive(tmp_path, text.replace(', "q_load": "x"', ""))
    with pytest.raises(IndexerError, match=r"got 'tabulated\.deflection'; it needs the inverse form with"):
        known_effects(blind, machine, {})


def _csv(folder: Path, times: float = 1.0, unit: str = "rad") -> str:
    t, q, _, a = motion(4.0, 100.0)
    lines = [f"{x:.4f},{y:.9g},{times * (y - 1e-3 * z):.9g},{95.0 * z:.9g}" for x, y, z in zip(t, q, a, strict=True)]
    folder.mkdir()
    (folder / "a.csv").write_text("\n".join([f"t [s],q [rad],x [{unit}],f [N m]", *lines]))
    return str(folder)


@pytest.mark.parametrize(
    ("given", "change", "said"),
    [
        (
            {"times": 0.01},
            ("", ""),
            "must be the position 'q' but for a deflection, got '0.01 times that'; .*channels, about 99.7, or",
        ),
        ({"unit": "m"}, ("", ""), "q_load must be in rad, got 'm'"),
        ({}, ('"q": "q"', '"v": "v"'), "with the role 'q' beside 'q_load'"),
        ({}, ('"x"', '"x", "v_load": "x"'), r"without roles that are made of 'q_load', got \['v_load'\]"),
    ],
)
def test_a_mistake_is_one_sentence(given: dict, change: tuple[str, str], said: str, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said) as raised:
        read_drive_records(drive(tmp_path, JOINT.replace(*change)), _csv(tmp_path / "runs", **given), None, {}, [])
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")


def test_a_gear_is_a_factor_of_the_channel(tmp_path: Path) -> None:
    text = JOINT.replace('"x"', '("x", 100.0)')
    (record,) = read_drive_records(drive(tmp_path, text), _csv(tmp_path / "runs", times=0.01), None, {}, [])
    assert np.ptp(record.rows["q_load"]) == pytest.approx(np.ptp(record.rows["q"]), rel=0.02)
