"""What is wrong with a drive's file or its records is said in one sentence; what is right is read as it stands."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from discrepancy import __main__ as command
from discrepancy.drives.channels import read_drive_records
from discrepancy.drives.description import load_drive
from discrepancy.drives.door import subject_of
from discrepancy.estimates import Calibration, Estimate, astray
from discrepancy.fit import fit
from indexer_cli.command import BAD_INPUT
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import FILE, drive, motion, record, start_of, subject, values

EXAMPLES = Path(__file__).parents[3] / "examples" / "drives"
EMPS = Path(__file__).parents[4] / "shared" / "data" / "emps" / "DATA_EMPS.mat"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("def force(q, v, a, u, t, p)", "def force(q, v)"), r"force must take \(q, v, a, u, t, p\), got \(q, v\)"),
        (("def force", "def forces"), "must define one function"),
        (("return p.mass", "return p.mas"), "got AttributeError in line 7"),
        (("p.mass * a", "(p.mass * a)[:5]"), "must give one number a sample"),
        (("p.mass * a", "p.mass * a / 0.0 * 0.0"), "must give finite numbers"),
        (('15.0)}', '15.0), "idle": (1.0, "N", 1.0)}'), "the parameter idle must change the force"),
        (('(90.0, "kg", 15.0)', '(90.0, "kg")'), r"\(value, unit, uncertainty\)"),
        (('"kg", 15.0', '"kg", 0.0'), "uncertainty"),
        (('"force": "f"', '"torque": "f"'), "with the role 'force'"),
        (('"q": "q", ', ""), "with the role 'q' or 'v'"),
        (('"f"}', '"f"}\nnoise = 0.0'), "noise must be a finite number > 0"),
        (('"f"}', '"f"}\neffects = ("friction.coulob",)'), "did you mean 'friction.coulomb'"),
        (('"f"}', '"f"}\ncutof = 3.0'), "did you mean 'cutoff'"),
        (('"f"}', '"f"}\nknown = {"friction.coulomb": {"forc": 1.0}}'), r"drive\.py\.friction\.coulomb must be one"),
        (('"f"}', '"f"}\nheld_out = 0.99'), "held_out must be"),
        (('"f"}', '"f"}\nimport gone'), "must run as Python, got ModuleNotFoundError in line 4"),
        (("def force", "def  = 3"), "must run as Python, got SyntaxError"),
        (("def force", "import sys\nsys.exit(3)\n\n\ndef force"), "must run as Python, got SystemExit in line 7"),
        (("return p.mass * a", "a *= p.mass\n    return a"), "got ValueError in line 7 .output array is read-only"),
        (("p.mass * a", "1j * p.mass * a"), "must give real numbers, got complex ones"),
        (("return p.mass * a", "return 'heavy'"), r"got ValueError \(could not convert string to float: 'heavy'\)"),
        (('"mass": (', '"_m": (1.0, "kg", 1.0), "mass": ('), "parameters must be named as .* got '_m'"),
        (('"mass": (', '"class": (1.0, "kg", 1.0), "mass": ('), "parameters must be named as .* got 'class'"),
        (("* a", "* a + u.q_load"), r"no attribute 'q_load'\); name 'q_load' in channels or in parameters"),
        (("p.mass", "p.mas"), r"no attribute 'mas'\); name 'mas' in channels or in parameters"),
        (('"f"}', '"f"}\nwindows = 2.0'), "windows must be left out beside force"),
        (('"f"}', '"f"}\ncutoff = 200.0'), "cutoff must be at most 0.15 of the sampling rate, 75 Hz, got 200"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_mistake_in_the_file_is_one_sentence(change: tuple[str, str], said: str, tmp_path: Path) -> None:
    text = FILE.replace(*change)
    assert text != FILE
    with pytest.raises(IndexerError, match=said) as raised:
        subject(tmp_path, lambda t, q, v, a: 95.0 * a, text)
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")


def test_a_machine_that_is_none_of_a_drive_is_refused(tmp_path: Path, run_command) -> None:
    (tmp_path / "drive.py").write_text(FILE)
    given = (f"system={tmp_path}/drive.py", f"measured={_csv(tmp_path / 'runs')}", f"out={tmp_path}/out")
    code, _, err = run_command(command, *given, "machine=smooth")
    assert code == BAD_INPUT and "machine must be left out for a drive, or the machine.yaml" in err


def _csv(folder: Path, header: str = "t [s],q [m],f [N]", spoil: int | None = None, rows: int = 400) -> Path:
    t, q, _, a = motion(seconds=rows / 100.0, rate=100.0)
    lines = [f"{x:.4f},{y:.9g},{95.0 * z:.9g}" for x, y, z in zip(t, q, a, strict=True)]
    if spoil is not None:
        lines[spoil] = lines[spoil].rpartition(",")[0] + ",nan"
    folder.mkdir(exist_ok=True)
    (folder / "a.csv").write_text("\n".join([header, *lines]))
    return folder


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"spoil": 7}, "column 'f': nan where a finite number must be|finite"),
        ({"header": "t [s],q,f [N]"}, r"the channel 'q' \(q\) must have a unit"),
        ({"header": "t [s],pos [m],f [N]"}, "must have one numeric column 'q'"),
        ({"rows": 100}, "at least 200 samples"),
        ({"header": "t [s],q [m],f [m]"}, "force must be in N, N m, A or V, got 'm'; correct the header"),
        ({"header": "t [s],q [furlong],f [N]"}, "q must be in m or rad, got 'furlong'"),
    ],
)
def test_a_mistake_in_the_records_is_one_sentence(given: dict, said: str, tmp_path: Path) -> None:
    folder = _csv(tmp_path / "runs", **given)
    with pytest.raises(IndexerError, match=said):
        read_drive_records(drive(tmp_path), str(folder), None, {}, [])


@pytest.mark.parametrize(
    ("unit", "factor", "said"),
    [
        ("rad/s", 1.0, "v must be in m/s, got 'rad/s'"),
        ("m/s", 10.0, "v must be the rate of 'q', got '10 times that'"),
        ("m/s", -1.0, "v must be the rate of 'q', got '-1 times that'"),
        ("m/s", 1.2, None),
    ],
)
def test_a_speed_is_the_rate_of_the_position(unit: str, factor: float, said: str | None, tmp_path: Path) -> None:
    t, q, v, a = motion(4.0, 100.0)
    lines = [f"{x:.4f},{y:.9g},{factor * w:.9g},{95.0 * z:.9g}" for x, y, w, z in zip(t, q, v, a, strict=True)]
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "a.csv").write_text("\n".join([f"t [s],q [m],v [{unit}],f [N]", *lines]))
    one = drive(tmp_path, FILE.replace('"q": "q"', '"q": "q", "v": "v"'))
    if said is None:
        assert len(read_drive_records(one, str(tmp_path / "runs"), None, {}, [])) == 1
        return
    with pytest.raises(IndexerError, match=said):
        read_drive_records(one, str(tmp_path / "runs"), None, {}, [])


def test_a_table_that_names_a_file_which_is_not_there_is_refused(tmp_path: Path) -> None:
    folder = _csv(tmp_path / "runs")
    (folder / "records.csv").write_text("file,noise\nb.csv,2\n")
    with pytest.raises(IndexerError, match=r"line 2: file must be one of those beside it, got 'b.csv'"):
        read_drive_records(drive(tmp_path), str(folder), None, {}, [])


def test_a_second_row_for_a_file_is_refused(tmp_path: Path) -> None:
    folder = _csv(tmp_path / "runs")
    (folder / "records.csv").write_text("file,noise\na.csv,2\n./a.csv,3\n")
    with pytest.raises(IndexerError, match=r"line 3: a file must have one row, got a second for a\.csv; keep one"):
        read_drive_records(drive(tmp_path), str(folder), None, {}, [])


def test_units_and_the_table_beside_the_files_are_read(tmp_path: Path) -> None:
    folder = _csv(tmp_path / "runs", header="t [ms],q [mm],f [kN]")
    title, _, *others = (folder / "a.csv").read_text().splitlines()
    (folder / "b.csv").write_text("\n".join([title, *others]) + "\n")
    (folder / "records.csv").write_text("file,motion,held_out,noise\na.csv,slow,no,2\nb.csv,fast,yes,\n")
    with pytest.raises(IndexerError, match="files or motions among a.csv, slow, b.csv, fast".replace(".", r"\.")):
        read_drive_records(drive(tmp_path), str(folder), None, {}, ["quick"])
    records = read_drive_records(drive(tmp_path), str(folder), None, {}, [])
    assert [(r.name, r.held_out, r.noise, r.motion) for r in records] == [
        ("a.csv", False, 2000.0, "slow"), ("b.csv", True, None, "fast"),
    ]  # fmt: skip
    assert records[0].rate == pytest.approx(1e5)
    assert records[0].units == {"q": "m", "force": "N"}
    assert np.ptp(records[0].rows["q"]) == pytest.approx(1e-3 * np.ptp(motion(4.0, 100.0)[1]), rel=1e-6)
    with pytest.raises(IndexerError, match="fewer than all"):
        read_drive_records(drive(tmp_path), str(folder), None, {}, ["slow"])


def test_a_record_held_out_is_no_window_of_the_fit(tmp_path: Path) -> None:
    one = record(lambda t, q, v, a: 95.0 * a)
    other = record(lambda t, q, v, a: 95.0 * a, name="b.csv", shift=0.7, held_out=True)
    made = subject_of(drive(tmp_path), [one, other])
    assert made.view(made.model).names == ("a.csv",) and made.view(made.held_out).names == ("b.csv",)
    alone = subject_of(drive(tmp_path), [one])
    last = alone.view(alone.held_out)
    assert last.names == ("a.csv",)
    assert last.time[last.inside].min() > alone.view(alone.model).time.max()


@pytest.mark.parametrize(("force", "length"), [(1e-3, 1.0), (1e3, 1.0), (1.0, 1e-3), (1.0, 1e3)])
def test_units_change_nothing(force: float, length: float, tmp_path: Path) -> None:
    """Multiplying forces or lengths leaves every start's residual the same, effect by effect."""

    def law(t, q, v, a):
        return 95.0 * a + 12.0 * np.sign(v) + 30.0 * q

    def every(factors: tuple[float, float]) -> dict[str, float]:
        text = FILE.replace("(90.0, ", f"({90.0 * factors[0] / factors[1]}, ").replace(
            "15.0)}", f"{15.0 * factors[0] / factors[1]})}}"
        )
        made = subject(tmp_path, law, text, scale=factors)
        found = {}
        for name, hypotheses in made.model.hypotheses().items():
            for k in range(min(3, len(hypotheses[-1].starts))):
                place = start_of(made, hypotheses[-1], start=k)[1]
                found[f"{name} {k}"] = place.level(made.model)
        return found

    plain, scaled = every((1.0, 1.0)), every((force, length))
    assert list(plain) == list(scaled)
    for name, level in plain.items():
        assert scaled[name] == pytest.approx(level, rel=1e-3), name


def test_a_second_look_stands_where_the_first_one_ended(tmp_path: Path) -> None:
    import yaml

    first = subject(tmp_path, lambda t, q, v, a: 95.0 * a + 12.0 * np.sign(v) + 20.0 * v)
    chosen = [first.model.hypotheses()[name][0] for name in ("friction.coulomb", "friction.viscous")]
    problem, place = start_of(first, *chosen)
    place = fit(problem, place, steps=20).place
    machine = yaml.safe_load(first.files(first.model, place)["machine.yaml"])
    assert machine["effects"]["friction.coulomb"]["force"] == pytest.approx(12.0, rel=0.02)
    second = subject_of(drive(tmp_path), [record(lambda t, q, v, a: 95.0 * a + 12.0 * np.sign(v) + 20.0 * v)], machine)
    assert {"friction.coulomb", "friction.viscous"}.isdisjoint(second.model.hypotheses())
    assert start_of(second)[1].level(second.model) == pytest.approx(place.level(first.model), rel=1e-6)
    with pytest.raises(IndexerError, match=r"machine must be of the drive my_drive.py, got 'other.py'"):
        subject_of(drive(tmp_path), [record(lambda t, q, v, a: 95.0 * a)], {**machine, "drive": "other.py"})


@pytest.mark.parametrize(
    ("machine", "said"),
    [
        (
            {"parameters": {"mass": 2.0}},
            r"machine.mass must be a mapping with its value \[kg\], got 2.0; write mass: {v",
        ),
        ({"parameters": {"mass": [2.0]}}, r"machine.mass must be a mapping with its value \[kg\], got \[2.0\]; write"),
        ({"parameters": {"mass": {}}}, "machine.mass must be a finite number kg, got None"),
        ({"parameters": [2.0]}, r"machine.parameters must be a mapping of names to values, got \[2.0\]; write"),
        ({"effects": ["offset"]}, "machine.effects must be a mapping of effects to their parameters.* got"),
        ({"effects": {"offset": 3.0}}, "machine.effects must be a mapping of effects to their parameters.* got"),
    ],
)
def test_a_mistake_in_the_machine_of_a_first_look_is_one_sentence(machine: dict, said: str, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said):
        subject_of(drive(tmp_path), [record(lambda t, q, v, a: 95.0 * a)], {"drive": "my_drive.py", **machine})


def test_what_the_model_can_do_itself_is_not_looked_for(tmp_path: Path) -> None:
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * a)
    assert made.model.left_out == ("inertia", "sensor.gain")
    assert any("Not looked for" in note and "inertia" in note for note in made.notes)


def test_sessions_have_offsets_of_their_own(tmp_path: Path) -> None:
    """Two records whose sensors were zeroed 9 N apart; without `sessions` the difference is left."""

    def level(text: str) -> float:
        records = [
            record(lambda t, q, v, a, zero=zero: 95.0 * a + zero, name=name, seed=seed)
            for name, zero, seed in (("a.csv", 4.0, 1), ("b.csv", -5.0, 2))
        ]
        made = subject_of(drive(tmp_path, text), records)
        assert ("offset" in made.model.left_out) == ("sessions" in text)
        problem, place = start_of(made)
        return fit(problem, place, steps=20).place.level(made.model)

    assert level(FILE + "\nsessions = True\n") < 0.2 * level(FILE)


def test_an_effect_of_ones_own_takes_part(tmp_path: Path) -> None:
    text = FILE + (
        "\nfrom discrepancy.drives import DriveEffect, Size\n"
        "own_effects = (DriveEffect('grease', 'Grease drags.', 'F += c sqrt|v|', 'ours',\n"
        "    (Size('drag', 'c', 'F', (0.1,), 0.0, 5.0, 0.0),), lambda m, p, base: p.drag * abs(m.v / 0.1)**0.5),)\n"
        "effects = ('friction.*',)\n"
    )
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * a + 7.0 * np.sqrt(np.abs(v) / 0.1), text)
    assert "grease" in made.model.hypotheses() and "offset" not in made.model.hypotheses()
    problem, place = start_of(made, made.model.hypotheses()["grease"][0])
    assert values(problem, fit(problem, place, steps=20).place)["grease.drag"] == pytest.approx(7.0, rel=0.03)


@pytest.mark.skipif(not EMPS.exists(), reason="the measured data are not here")
def test_emps_takes_ten_lines(tmp_path: Path) -> None:
    """Published: 95.1 kg, 203.5 N s/m, 20.4 N, offset -3.2 N, 4.1 % of the force left."""
    file = EXAMPLES / "emps.py"
    assert len([line for line in file.read_text().splitlines() if line.strip()]) <= 20
    one = load_drive(file)
    made = subject_of(one, read_drive_records(one, str(EMPS), None, {}, []))
    chosen = [made.model.hypotheses()[n][0] for n in ("friction.coulomb", "friction.viscous", "offset")]
    problem, place = start_of(made, *chosen)
    got = values(problem, fit(problem, place, steps=20).place)
    assert got["mass"] == pytest.approx(95.1, rel=0.005)
    assert got["friction.viscous.coefficient"] == pytest.approx(203.5, rel=0.015)
    assert got["friction.coulomb.force"] == pytest.approx(20.4, rel=0.015)
    assert got["offset.force"] == pytest.approx(-3.2, abs=0.25)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (
            '"k": (5.0, "N/mm", 0.5)',
            r"parameters\['k'\] \(unit\) must be in m, rad, s, kg, N .*, got 'N/mm'; .* without mm",
        ),
        ('"n": (3.0, "rev/min", 1.0)', "got 'rev/min'"),
    ],
)
def test_a_parameter_in_another_unit_than_the_channels_is_refused(row: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said):
        drive(tmp_path, FILE.replace('"mass": (90.0, "kg", 15.0)', f'"mass": (90.0, "kg", 15.0), {row}'))


def test_a_function_that_writes_to_its_inputs_or_returns_nothing_is_told(tmp_path: Path) -> None:
    one = record(lambda t, q, v, a: 95.0 * a)
    for body, said in (
        ("    t += 1.0\n    return p.mass * a", "read-only"),
        ("    p.mass * a", "must give one number a sample, got None; end it with return"),
    ):
        with pytest.raises(IndexerError, match=said):
            start_of(subject_of(drive(tmp_path, FILE.replace("    return p.mass * a", body)), [one]))


OWN = """
from discrepancy.drives import DriveEffect, Size
own_effects = (DriveEffect("grease", "Grease drags.", "F += c v", "ours", ({size},), {law}{more}),)
"""
SIZE = 'Size("drag", "c", "F V-1", (0.1, 0.3), 0.0, 5.0, 0.0)'


@pytest.mark.parametrize(
    ("size", "law", "more", "said"),
    [
        (
            SIZE,
            "lambda m, p, base: p.drag * m.v",
            ', acts="Dry"',
            r"acts must be one of force, dry, reading, got 'Dry'; .*dry",
        ),
        (
            SIZE.replace("F V-1", "N"),
            "lambda m, p, base: m.v",
            "",
            "a product of scales such as 'F V-1', or '', got 'N'",
        ),
        (
            SIZE.replace("(0.1, 0.3)", "0.1"),
            "lambda m, p, base: m.v",
            "",
            r"a tuple of numbers, \(0\.1, 0\.3\), got 0\.1",
        ),
        (SIZE.replace("(0.1, 0.3)", "(0.0,)"), "lambda m, p, base: m.v", "", "one or more that are not nothing"),
    ],
)
def test_an_effect_of_ones_own_that_no_fit_could_use_is_refused(size, law, more, said, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said):
        drive(tmp_path, FILE + OWN.format(size=size, law=law, more=more))


def test_what_the_law_of_an_own_effect_raises_is_one_sentence(tmp_path: Path) -> None:
    one = drive(tmp_path, FILE + OWN.format(size=SIZE, law="lambda m, p, base: p.drag * m.speed", more=""))
    with pytest.raises(IndexerError, match=r"my_drive\.py: the law of the effect grease must take arrays .*'speed'"):
        subject_of(one, [record(lambda t, q, v, a: 95.0 * a)]).model.hypotheses()


def test_a_parameter_that_left_what_was_stated_of_it_is_told() -> None:
    """A force in kN that a header calls N: a mass of 0.095 kg for 90, and everything fits."""
    lost = Estimate("mass", "kg", 0.095, 0.094, 0.096, 90.0, -41.2)
    near = Estimate("drag", "N", 1.0, 0.5, 1.5, 2.0, -3.0)
    (said,) = astray(Calibration((lost, near), (), ()))
    assert said.startswith("mass is 0.095 kg, 41 standard deviations from the 90 stated: look for a wrong unit")


def test_a_force_of_the_other_sign_is_told(tmp_path: Path) -> None:
    for sign in (1.0, -1.0):
        made = subject_of(drive(tmp_path), [record(lambda t, q, v, a, sign=sign: sign * 95.0 * a)])
        assert any("give its channel the factor -1" in note for note in made.notes) == (sign < 0.0)


def test_a_channel_that_is_measured_more_slowly_than_it_is_written_is_told(tmp_path: Path) -> None:
    """A position from a bus at 250 Hz beside a force at 1 kHz; an encoder's steps are no such thing."""
    for held, expected in ((4, True), (1, False)):
        one = record(lambda t, q, v, a: 95.0 * a, rate=1000.0)
        q = one.rows["q"]
        rows = {**one.rows, "q": np.repeat(q[::4], 4)[: len(q)] if held > 1 else 1e-4 * np.round(q / 1e-4)}
        notes = subject_of(drive(tmp_path), [dataclasses.replace(one, rows=rows)]).notes
        told = any("The channel q keeps each value for 4 samples (a.csv): it is measured at 250 Hz" in n for n in notes)
        assert told == expected
