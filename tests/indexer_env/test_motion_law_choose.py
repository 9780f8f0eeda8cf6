"""From a name, a mapping or a CSV file to a motion law, and what is refused on the way."""

import math
from pathlib import Path

import numpy as np
import pytest

from indexer_env.errors import ParameterError
from indexer_env.motion_law import RiseLaw, motion_law


def written(path: Path, text: str) -> dict[str, str]:
    path.write_text(text, encoding="utf-8")
    return {"name": "table", "file": str(path)}


def test_mapping_and_file_give_the_same_law(tmp_path: Path) -> None:
    cam = np.linspace(0.0, 2.0 * math.pi, 49)
    follower = motion_law("modified_sine").evaluate(cam, 8, 0.5)[0]
    columns = {"cam_angle_deg": np.degrees(cam).tolist(), "follower_angle_deg": np.degrees(follower).tolist()}
    rows = zip(*columns.values(), strict=True)
    text = "\ufefffollower_angle_deg, note ,cam_angle_deg\n" + "".join(f'{b!r},"a, b",{a!r}\n\n' for a, b in rows)
    from_file = motion_law(written(tmp_path / "law.csv", text))
    assert from_file == motion_law({"name": "table", **columns})
    assert not isinstance(from_file, RiseLaw) and from_file.pieces(8, 0.5).edges[-1] == 1.0


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("modified_sin", r"name must be one of .*did you mean 'modified_sine'"),
        (None, r"name must be one of .*got None"),
        ({}, r"name must be one of .*got None"),
        ({"name": ["table"]}, r"name must be one of"),
        ({"name": "cycloidal", "stations": 8}, r"key must be one of name, got 'stations'"),
        ({"name": "table", "cam_angle": []}, r"key must be one of .*did you mean 'cam_angle_deg'"),
        (
            {"name": "table"},
            r"table must be given as cam_angle_deg and follower_angle_deg, or as file alone, got \[\]",
        ),
        ({"name": "table", "file": "a.csv", "cam_angle_deg": []}, r"table must be given as"),
        (
            {"name": "table", "cam_angle_deg": [0.0, "x"], "follower_angle_deg": []},
            r"cam_angle_deg\[1\] must be",
        ),
        (
            {"name": "table", "cam_angle_deg": "0 1", "follower_angle_deg": []},
            r"cam_angle_deg must be a row of",
        ),
        ({"name": "table", "file": 3}, r"file must be a path to a CSV file, got 3"),
        (
            {"name": "table", "file": "no/such.csv"},
            r"file must be a CSV file that can be read, got 'no/such\.csv'; No",
        ),
    ],
)
def test_a_bad_description_is_refused_in_one_sentence(given, says: str) -> None:
    with pytest.raises(ParameterError, match=rf"^motion_law\.{says}.*\.$"):
        motion_law(given)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"file must be a CSV file with one column cam_angle_deg in its first line.*got \[\]"),
        ("cam_angle_deg;follower_angle_deg\n", r"file must be a CSV file with one column cam_angle_deg"),
        ("cam_angle_deg,beta\n", r"file must be a CSV file with one column follower_angle_deg"),
        (
            "cam_angle_deg,follower_angle_deg\n0,0\n1,\n",
            r"follower_angle_deg must be .*line 3\), got ''; fill",
        ),
        ("cam_angle_deg,follower_angle_deg\n0,0\n1\n", r"follower_angle_deg must be .*line 3\), got ''"),
        ("cam_angle_deg,follower_angle_deg\nnan,0\n", r"cam_angle_deg must be .*line 2\), got 'nan'"),
        ('cam_angle_deg,follower_angle_deg\n"0,0\n', r"file must be well-formed CSV"),
    ],
)
def test_a_bad_file_is_refused_with_its_line(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ParameterError, match=rf"^motion_law\.{says}"):
        motion_law(written(tmp_path / "law.csv", text))
    (tmp_path / "law.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ParameterError, match="save it as UTF-8 text"):
        motion_law({"name": "table", "file": str(tmp_path / "law.csv")})
