"""The example programs run and make what they promise."""

import runpy
from pathlib import Path

import pytest
from PIL import Image

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
