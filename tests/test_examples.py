"""The example programs run and make what they promise."""

import runpy
from pathlib import Path

from PIL import Image

EXAMPLES = Path(__file__).parent.parent / "examples"


def test_pictures_of_one_index(tmp_path):
    make_pictures = runpy.run_path(str(EXAMPLES / "pictures_of_one_index.py"))["make_pictures"]
    film, picture = make_pictures(tmp_path / "pictures", frames=3)
    with Image.open(film) as frames:
        assert (frames.n_frames, frames.size) == (3, (640, 480))
    with Image.open(picture) as still:
        assert still.size == (960, 640)
