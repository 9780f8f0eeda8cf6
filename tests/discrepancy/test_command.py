"""Each refusal in one sentence before any fit. (The command from end to end: test_page.)"""

from functools import partial
from pathlib import Path

import pytest

from discrepancy import __main__ as command


@pytest.fixture
def run(run_command):
    """Run the command with these arguments; gives exit code, stdout and stderr."""
    return partial(run_command, command)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["measured=gone", "out=x"], "a folder or pattern with measured files, got 'gone'; check the path"),
        (["measured=[gone.csv]", "out=x"], "must be files that exist"),
        (["measured=gone", "out=x", "machine=gone.yaml"], "There is no machine preset or YAML file 'gone.yaml'"),
        (["measured=gone", "out=x", "seed=-1"], "seed must be a whole number >= 0"),
        (["measured=gone", "out=x", "seconds=-1"], "seconds must be"),
        (["measured=gone", "out=x", "check_motion=maybe"], "check_motion must be true or false, got 'maybe'"),
        (["measured=gone"], "out must be given"),
    ],
)
def test_a_mistake_is_one_sentence(run, tmp_path: Path, monkeypatch, arguments: list[str], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = run(*arguments)
    assert code == 2 and said in err and err.count("\n") == 1, err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            "drive: my_drive.py\nparameters: {}\n",
            "an indexing table's and not a drive's, got 'my_drive.py'; add system=",
        ),
        ("radius: 0.4\n", "other.yaml: Machine has no parameter 'radius'"),
    ],
)
def test_another_file_in_the_place_of_the_machine_s_is_told_as_what_it_is(run, tmp_path, content, said) -> None:
    (tmp_path / "other.yaml").write_text(content)
    code, _, err = run("measured=gone", f"machine={tmp_path}/other.yaml", f"out={tmp_path}/x")
    assert code == 2 and said in err and err.count("\n") == 1, err


def test_a_file_with_a_hole_is_refused_with_its_place(run, tmp_path: Path) -> None:
    text = "time [s],acc [rad/s^2]\n" + "".join(f"{k / 1000},{'nan' if k == 70 else 1.0 + k % 3}\n" for k in range(200))
    (tmp_path / "run.csv").write_text(text)
    known = ("known.motor_speed_rpm=1500", "known.load_torque=2")
    code, _, err = run(f"measured={tmp_path}", f"out={tmp_path / 'out'}", *known)
    assert code == 2 and "run.csv" in err and "nan" in err.lower(), err
    code, _, err = run(f"measured={tmp_path}", f"out={tmp_path / 'out'}")
    assert code == 2 and "lacks motor_speed, load_torque" in err, err


def test_a_file_given_twice_is_refused(run, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("time [s],acc [rad/s^2]\n0,1\n")
    code, _, err = run(f"measured=[{tmp_path}/run.csv,{tmp_path}/run.csv]", f"out={tmp_path / 'out'}")
    assert code == 2 and "must be different files" in err, err
