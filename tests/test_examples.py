"""The example programs run and make what they promise."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.signal import welch

from monitor.sources.demo import records

EXAMPLES = Path(__file__).parent.parent / "examples"


def test_pictures_of_one_index(tmp_path):
    make_pictures = runpy.run_path(str(EXAMPLES / "pictures_of_one_index.py"))["make_pictures"]
    film, picture = make_pictures(tmp_path / "pictures", frames=3)
    with Image.open(film) as frames:
        assert (frames.n_frames, frames.size) == (3, (640, 480))
    with Image.open(picture) as still:
        assert still.size == (960, 640)


@pytest.mark.parametrize("name", ["hidden_effect", "twin_bench", "unknown_drag"])
def test_a_missing_folder_is_said_in_one_sentence(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", [name])
    with pytest.raises(SystemExit, match=rf"^error: the folder to write is missing; python .*{name}.* OUT"):
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        (["hidden_effect", "/proc/nowhere"], "OUT must be a folder that can be made, got /proc/nowhere"),
        (["twin_bench", "/proc/nowhere"], "OUT must be a folder that can be made, got /proc/nowhere"),
        (["hidden_effect", "OUT", "two"], "turns must be a number of table turns > 0, got 'two'; python"),
        (["unknown_drag", "OUT", "0"], "turns must be a number of table turns > 0, got '0'; python"),
        (["hidden_effect", "--help"], "the folder to write is missing; python"),
        (["pictures_of_one_index", "--help"], r"FOLDER must be a folder; python .* \[FOLDER\]"),
        (["drives/records", "feed_axis", "--help"], "a drive and a folder to write are needed; python"),
        (["drives/records", "feed_axis"], "a drive and a folder to write are needed; python"),
        (["drives/records", "feed_axs", "OUT"], "DRIVE must be one of feed_axis, .*, got 'feed_axs'; python"),
        (
            ["drives/records", "feed_axis", "/proc/nowhere"],
            "OUT must be a folder that can be written, got /proc/nowhere",
        ),
    ],
)
def test_a_mistake_is_said_in_one_sentence(typed, said, tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    program, *words = typed
    monkeypatch.setattr("sys.argv", [program, *(str(tmp_path) if word == "OUT" else word for word in words)])
    with pytest.raises(SystemExit, match=f"^error: {said}"):
        runpy.run_path(str(EXAMPLES / f"{program}.py"), run_name="__main__")


def test_the_logger_says_what_to_install_where_it_has_no_client(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "paho.mqtt.client", None)
    said = r"^error: this example needs the package paho-mqtt; run: pip install .*\[monitor\].* -c constraints\.txt"
    with pytest.raises(SystemExit, match=said):
        runpy.run_path(str(EXAMPLES / "send_turns.py"))["main"]()


def test_the_logger_sends_turns_of_the_machine_that_the_monitor_s_model_is_taught() -> None:
    def decibels(turn: np.ndarray) -> np.ndarray:
        return 10.0 * np.log10(welch(turn, fs=1000.0, nperseg=1000)[1][1:101])

    sent = runpy.run_path(str(EXAMPLES / "send_turns.py"))["turns"](2)
    assert np.abs(decibels(sent[:8200]) - decibels(records("press-1", 1)[0])).max() < 1.0
    assert np.abs(decibels(sent[8200:]) - decibels(sent[:8200])).max() > 3.0
