"""What a drive's files and the table beside them say of time, noise and units."""

import re
from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.channels import Record, read_drive_records
from discrepancy.drives.course import courses_of
from discrepancy.drives.description import Drive
from discrepancy.drives.door import subject_of
from discrepancy.drives.units import in_si
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import FILE, drive, motion
from tests.discrepancy.drives.test_forward import FILE as PENDULUM

BOTH = PENDULUM.replace('"q": "q"', '"q": "q", "v": "v"')
"""The pendulum with its angle and its speed measured."""


def _file(folder: Path, header: str = "t [s],q [m],f [N]", step: float = 0.01, name: str = "a.csv") -> Path:
    t, q, v, a = motion(seconds=4.0, rate=100.0, shift=0.0 if name == "a.csv" else 0.7)
    columns = {"t": step / 0.01 * t, "q": q, "v": v, "a": a, "f": 95.0 * a, "u": a}
    named = [columns[title.partition(" ")[0]] for title in header.split(",")]
    folder.mkdir(parents=True, exist_ok=True)
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in zip(*named, strict=True))
    (folder / name).write_text(f"{header}\n{rows}\n")
    return folder


def _read(one: Drive, folder: Path, **known: float) -> list[Record]:
    return read_drive_records(one, str(folder), None, known, [])


@pytest.mark.parametrize(
    ("header", "channel", "rate"),
    [
        ("t", '("t", 0.001, "s")', 2e4),
        ("t [s]", '("t", 1.0, "ms")', 2e4),
        ("t [ms]", '("t", 2.0)', 1e4),
        ("t [ms]", '"t"', 2e4),
    ],
)
def test_time_has_the_factor_and_the_unit_of_its_channel(
    header: str, channel: str, rate: float, tmp_path: Path
) -> None:
    """Steps of 0.05."""
    one = drive(tmp_path, FILE.replace('"time": "t"', f'"time": {channel}'))
    (record,) = _read(one, _file(tmp_path / "runs", f"{header},q [m],f [N]", step=0.05))
    assert record.rate == pytest.approx(rate)


def test_a_unit_of_time_that_is_none_is_one_sentence(tmp_path: Path) -> None:
    one = drive(tmp_path, FILE.replace('"time": "t"', '"time": ("t", 1.0, "m")'))
    with pytest.raises(IndexerError, match=r"time must be in s, ms, us or min, got 'm'; correct it in channels\.$"):
        _read(one, _file(tmp_path / "runs"))


@pytest.mark.parametrize("above", [False, True])
def test_a_table_beside_files_in_a_subfolder_is_read(above: bool, tmp_path: Path) -> None:
    """The table stands beside the files, or above them in the folder of them all."""
    folder = tmp_path / "runs"
    _file(folder / "day")
    _file(folder / "day", name="b.csv")
    table = folder / "records.csv" if above else folder / "day" / "records.csv"
    table.write_text(f"file,held_out\n{'day/' if above else ''}b.csv,yes\n")
    found = _read(drive(tmp_path), folder)
    assert [(record.name, record.held_out) for record in found] == [("day/a.csv", False), ("day/b.csv", True)]


def test_a_copy_of_a_file_is_refused(tmp_path: Path) -> None:
    """Held out it would confirm whatever was fitted."""
    folder = _file(tmp_path / "runs")
    (folder / "b.csv").write_text((folder / "a.csv").read_text())
    with pytest.raises(IndexerError, match=r"b\.csv must differ .*, got the same samples as a\.csv; remove the copy"):
        _read(drive(tmp_path), folder)


@pytest.mark.parametrize(("mark", "refused"), [(-9999.0, True), (20.0, False)])
def test_marks_of_missing_samples_are_refused(mark: float, refused: bool, tmp_path: Path) -> None:
    _, q, _, a = motion(seconds=4.0, rate=100.0)
    force = 95.0 * a
    force[[20, 21, 300]] = mark
    folder = _written(tmp_path / "runs", 100.0, **{"q [m]": q, "f [N]": force})
    if not refused:
        assert _read(drive(tmp_path), folder)
        return
    with pytest.raises(IndexerError, match="force must be without marks of missing samples, got '-9999 N in 3 of 400'"):
        _read(drive(tmp_path), folder)


def test_channels_of_different_rates_are_refused(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    _, q, _, a = motion(seconds=4.0, rate=1000.0)
    (tmp_path / "runs").mkdir()
    with h5py.File(tmp_path / "runs" / "a.h5", "w") as file:
        for name, row, rate in (("q", q, 1000.0), ("f", 95.0 * a, 500.0)):
            file[name] = row
            file[name].attrs.update(sampling_rate=rate, unit="m" if name == "q" else "N")
    with pytest.raises(IndexerError, match=r"must be sampled together, got 1000 and 500 Hz of 'q' and 'f'"):
        _read(drive(tmp_path, FILE.replace('"time": "t", ', "")), tmp_path / "runs")


def test_a_table_that_a_drive_does_not_read_is_refused(tmp_path: Path) -> None:
    (_file(tmp_path / "runs") / "records.yaml").write_text("a.csv: {noise: 2.0}\n")
    with pytest.raises(IndexerError, match=r"records must be a CSV table for a drive.*; write it as records\.csv\.$"):
        _read(drive(tmp_path), tmp_path / "runs")


def test_noise_counts_in_the_numbers_of_the_file(tmp_path: Path) -> None:
    one = drive(tmp_path, FILE.replace('"force": "f"', '"force": ("f", -2.0, "kN")'))
    folder = _file(tmp_path / "runs")
    assert _read(one, folder, noise=0.5)[0].noise == 1000.0
    (folder / "records.csv").write_text("file,noise\na.csv,0.25\n")
    assert _read(one, folder, noise=0.5)[0].noise == 500.0


def test_noise_of_channels_in_one_unit_is_one_number(tmp_path: Path) -> None:
    (record,) = _read(drive(tmp_path, PENDULUM), _file(tmp_path / "one", "t [s],q [deg],u [N m]"), noise=2.0)
    assert record.noise == pytest.approx(np.pi / 90.0)
    header = "t [s],q [rad],v [rad/s],u [N m]"
    with pytest.raises(IndexerError, match=r"known.noise must be left out where q and v are not measured in one unit"):
        _read(drive(tmp_path, BOTH), _file(tmp_path / "both", header), noise=2.0)


def _courses(folder: Path, noise: str):
    one = drive(folder, BOTH.replace("noise = 0.001", f"noise = {noise}"))
    return courses_of(one, _read(one, _file(folder / "runs", "t [s],q [rad],v [rad/s],u [N m]")))[0]


def test_noise_is_stated_channel_by_channel(tmp_path: Path) -> None:
    assert _courses(tmp_path, '{"q": 0.001, "v": 0.02}')[0].noise.tolist() == [0.001, 0.02]
    by_record = _courses(tmp_path, '{"v": 0.02}')[0].noise
    assert by_record[0] < 1e-4 and by_record[1] == 0.02


@pytest.mark.parametrize(
    ("noise", "said"),
    [
        (
            "0.001",
            r"noise must be given by role where channels differ in their unit, got 0.001; write noise = {'q': NUM",
        ),
        ('{"u": 0.1}', "noise must be one of q, v, got 'u'"),
        ('{"q": 0.0}', r"noise\['q'\] must be a finite number > 0 rad, got 0.0"),
        ("-1.0", "noise must be a finite number > 0 of the measured channels"),
    ],
)
def test_a_noise_that_fits_no_channel_is_one_sentence(noise: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=said) as raised:
        _courses(tmp_path, noise)
    assert "\n" not in str(raised.value) and str(raised.value).endswith(".")


def test_an_acceleration_has_the_unit_of_its_joint(tmp_path: Path) -> None:
    one = drive(tmp_path, PENDULUM.replace('"q": "q"', '"q": "q", "a": "a"'))
    with pytest.raises(IndexerError, match=r"a must be in rad/s\^2, got 'm/s\^2'; correct the header"):
        _read(one, _file(tmp_path / "runs", "t [s],q [rad],a [g],u [N m]"))
    assert len(_read(one, _file(tmp_path / "right", "t [s],q [rad],a [rad/s^2],u [N m]"))) == 1


def test_records_in_different_units_are_refused_in_the_forward_form(tmp_path: Path) -> None:
    folder = _file(tmp_path / "runs", "t [s],q [rad],u [N m]")
    _file(folder, "t [s],q [m],u [N m]", name="b.csv")
    one = drive(tmp_path, PENDULUM)
    with pytest.raises(IndexerError, match=r"All records must have 'q' in the same unit, got m and rad\.$"):
        courses_of(one, _read(one, folder))


def _written(folder: Path, rate: float, **columns: np.ndarray) -> Path:
    folder.mkdir(parents=True)
    rows = np.column_stack([np.arange(len(next(iter(columns.values())))) / rate, *columns.values()])
    np.savetxt(folder / "a.csv", rows, "%.10g", ",", header="t [s]," + ",".join(columns), comments="")
    return folder


@pytest.mark.parametrize("factor", [1.0, 0.02])
def test_an_encoder_that_begins_anew_after_each_turn_is_refused(factor: float, tmp_path: Path) -> None:
    """Whatever the factor of its channel is."""
    t, _, _, a = motion(seconds=12.0, rate=100.0)
    q = 1.5 * t
    one = drive(tmp_path, FILE.replace('"q": "q"', f'"q": ("q", {factor})'))
    assert len(_read(one, _written(tmp_path / "right", 100.0, **{"q [rad]": q, "f [N m]": a}))) == 1
    folder = _written(tmp_path / "wrapped", 100.0, **{"q [rad]": np.mod(q, 2.0 * np.pi), "f [N m]": a})
    said = r"q must be a position that does not jump, got 'a step of .* rad at .* s'; unwrap an encoder .*\.$"
    with pytest.raises(IndexerError, match=said):
        _read(one, folder)


def _jumped(q: np.ndarray, kind: str) -> np.ndarray:
    """A turn lost by an encoder that made several, and one sample that was not read."""
    n = np.arange(len(q))
    return np.where(n > 600, q - 2.0 * np.pi, q) if kind == "turn" else np.where(n == 600, 0.0, q)


@pytest.mark.parametrize("kind", ["turn", "zero"])
def test_a_jump_that_no_neighbour_explains_is_refused(kind: str, tmp_path: Path) -> None:
    """At 6 s, far less than the range of the position."""
    t, _, _, a = motion(seconds=12.0, rate=100.0)
    q = 3.0 * t + np.sin(t)
    folder = _written(tmp_path / "runs", 100.0, **{"q [rad]": _jumped(q, kind), "f [N m]": a})
    said = r"q must be a position that does not jump, got 'a step of .* rad at 6(\.01)? s'; .* or mend a lost sample\.$"
    with pytest.raises(IndexerError, match=said):
        _read(drive(tmp_path), folder)


@pytest.mark.parametrize("kind", ["coarse", "stop", "move", "slip"])
def test_a_motion_with_steps_is_no_jump(kind: str, tmp_path: Path) -> None:
    """A coarse encoder, a drive that a stop halts at once, one that moves for 50 ms, one that slips. Seed 4."""
    t, q, _, a = motion(seconds=12.0, rate=100.0)
    noise = 1e-6 * np.random.default_rng(4).standard_normal(len(t))
    rows = {
        "coarse": 0.02 * np.round(q / 0.02),
        "stop": np.minimum(0.1 * t, 0.6) + noise,
        "move": np.clip(4.0 * (t - 6.0), 0.0, 0.2) + noise,
        "slip": 1e-3 * np.floor(0.15 * t) * (t > 3.0) + q * (t < 3.0) + q[300] * (t >= 3.0) + noise,
    }
    folder = _written(tmp_path / "runs", 100.0, **{"q [m]": rows[kind], "f [N]": a})
    assert len(_read(drive(tmp_path), folder)) == 1


@pytest.mark.parametrize(
    ("role", "written", "worth", "unit"),
    [
        ("q", "cm", 1e-2, "m"), ("q", "degrees", np.pi / 180.0, "rad"), ("q", "Degree", np.pi / 180.0, "rad"),
        ("q", "rev", 2.0 * np.pi, "rad"), ("v", "RPM", np.pi / 30.0, "rad/s"), ("v", "1/min", np.pi / 30.0, "rad/s"),
        ("v", "m/min", 1.0 / 60.0, "m/s"), ("a", "g", 9.80665, "m/s^2"), ("force", "kNm", 1e3, "N m"),
        ("force", "N cm", 1e-2, "N m"), ("force", "mA", 1e-3, "A"), ("force", "mN", 1e-3, "N"),
        ("force", "MN", 1e6, "N"), ("force", "N·m", 1.0, "N m"), ("u", "g", 1.0, "g"), ("u", "bar", 1.0, "bar"),
    ],
)  # fmt: skip
def test_a_unit_as_shops_write_it(role: str, written: str, worth: float, unit: str) -> None:
    assert in_si(written, acceleration=role == "a") == (pytest.approx(worth), unit)


@pytest.mark.parametrize(
    ("header", "channel", "said"),
    [
        ("q [m],f", '("f", 0.5)', r"'force': \('f', 0.5, 'N'\)\} with the unit that it has"),
        ("q,f [N]", '"f"', r"'q': \('q', 1.0, 'm'\)\} with the unit that it has"),
        ("q [rad],f [%]", '"f"', r"force must be in N, N m, A or V, got '%'; .* \(column, factor, 'N m'\)"),
    ],
)
def test_a_unit_that_is_missing_is_asked_for_by_its_kind(header: str, channel: str, said: str, tmp_path: Path) -> None:
    one = drive(tmp_path, FILE.replace('"force": "f"', f'"force": {channel}'))
    with pytest.raises(IndexerError, match=said):
        _read(one, _file(tmp_path / "runs", f"t [s],{header}"))


@pytest.mark.parametrize(("titles", "numbers"), [(",", ";"), (";", ","), ("\t", ",")])
def test_titles_with_another_separator_are_one_sentence(titles: str, numbers: str, tmp_path: Path) -> None:
    path = _file(tmp_path / "runs") / "a.csv"
    first, rest = path.read_text().split("\n", 1)
    path.write_text(first.replace(",", titles) + "\n" + rest.replace(",", numbers))
    said = rf"must have one separator, got {re.escape(repr(titles))} between the titles and .*; correct .*\.$"
    with pytest.raises(IndexerError, match=said):
        _read(drive(tmp_path), tmp_path / "runs")


@pytest.mark.parametrize(("role", "unit"), [("v", "m/s"), ("a", "m/s^2")])
def test_an_offset_of_a_sensor_is_subtracted_and_told(role: str, unit: str, tmp_path: Path) -> None:
    """While the drive also goes on to another place and speed, which is no offset. Seed 2, a tenth of the rms speed
    or acceleration."""
    t, q, v, a = motion(seconds=20.0, rate=200.0)
    q, v, a = q + 0.01 * t + 0.004 * t**2, v + 0.01 + 0.008 * t, a + 0.008
    row = {"v": v, "a": a}[role]
    row = row + 0.02 * np.std(row) * np.random.default_rng(2).standard_normal(len(t))
    one, found = drive(tmp_path, FILE.replace('"q": "q"', f'"q": "q", "{role}": "{role}"')), []
    for k, offset in enumerate((0.0, 0.1 * float(np.std(row)))):
        columns = {"q [m]": q, "f [N]": 95.0 * a, f"{role} [{unit}]": row + offset}
        (record,) = _read(one, _written(tmp_path / str(k), 200.0, **columns))
        assert record.offsets.get(role, 0.0) == pytest.approx(offset, abs=2e-3 * float(np.std(row)))
        assert float(record.rows[role].mean()) == pytest.approx(float(row.mean()), abs=2e-3 * float(np.std(row)))
        found.append(record)
    assert not found[0].offsets
    (said,) = [note for note in subject_of(one, found).notes if "above what" in note]
    assert said.startswith(f"The measured {role} is ") and said.endswith("on average; this was subtracted.")
    assert not [note for note in subject_of(one, found[:1]).notes if "above what" in note]


@pytest.mark.parametrize("role", ["v", "a"])
def test_a_rate_in_another_unit_is_told_behind_the_noise_of_a_fast_encoder(role: str, tmp_path: Path) -> None:
    """10 kHz and 10 µm of noise, a speed or an acceleration 1000 times too large. Seed 1."""
    t, q, v, a = motion(seconds=4.0, rate=1e4)
    q = q + 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    unit, row = {"v": ("m/s", v), "a": ("m/s^2", a)}[role]
    one = drive(tmp_path, FILE.replace('"q": "q"', f'"q": "q", "{role}": "{role}"'))
    columns = {"q [m]": q, "f [N]": 95.0 * a, f"{role} [{unit}]": row}
    assert len(_read(one, _written(tmp_path / "right", 1e4, **columns))) == 1
    columns[f"{role} [{unit}]"] = 1e3 * row
    said = rf"{role} must be the (rate|second derivative) of 'q', got '(1e\+03|9\d\d|10\d\d) times that'"
    with pytest.raises(IndexerError, match=said):
        _read(one, _written(tmp_path / "wrong", 1e4, **columns))
