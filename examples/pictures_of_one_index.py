"""A film and a picture of one index of a worn machine: cracked roller, loose screws, play in the reducer.

    python examples/pictures_of_one_index.py [FOLDER]

writes indexer.gif and indexer.png, into docs/pictures where no folder is named. Needs the extra ``[render]``.
"""

import math
import sys
from pathlib import Path

from PIL import Image

from indexer_env import Faults, Run, load_machine, simulate
from indexer_env.render import SCENE_CHANNELS, draw, scene_from

STATION = 2
"""The index shown is the one from this station, whose roller is cracked, to the next [-]."""

FILM = (640, 480)
PICTURE = (960, 640)
"""Width and height [px]."""

FRAMES = 80
FRAME_TIME = 0.08
"""Frames of one cam turn, and how long each stands [s]: 1.025 s of machine time in 6.4 s."""

PICTURE_PHASE = 0.3
"""Cam phase of the picture [cam turns]: late in the index, where play opens as the table is braked."""


def make_pictures(folder: Path, frames: int = FRAMES) -> tuple[Path, Path]:
    """Write the film of so many frames, and the picture; returns their paths."""
    machine = load_machine("reference")
    faults = Faults(backlash=math.radians(10.0), roller_crack=0.5, cracked_station=STATION, screw_looseness=1.0)
    worn = faults.applied_to(machine)
    record = simulate(worn, run=Run(channels=SCENE_CHANNELS))
    history = {"time": record.time, **record.channels}
    samples_per_index = len(record.time) / machine.stations

    def pixels(cam_turns: float, size: tuple[int, int]) -> Image.Image:
        index = round(cam_turns * samples_per_index)
        sample = {name: float(values[index]) for name, values in record.channels.items()}
        scene = scene_from(worn, sample, time=float(record.time[index]), history=history)
        return Image.fromarray(draw(scene, *size))

    folder.mkdir(parents=True, exist_ok=True)
    film, picture = folder / "indexer.gif", folder / "indexer.png"
    pixels(STATION + PICTURE_PHASE, PICTURE).save(picture, optimize=True)
    colours = pixels(STATION + PICTURE_PHASE, FILM).quantize(96, dither=Image.Dither.NONE)
    # one palette for all frames: what does not move is then equal in them, and takes no room
    shown = [
        pixels(STATION + number / frames, FILM).quantize(palette=colours, dither=Image.Dither.NONE)
        for number in range(frames)
    ]
    shown[0].save(film, save_all=True, append_images=shown[1:], duration=round(1e3 * FRAME_TIME), loop=0, optimize=True)
    return film, picture


if __name__ == "__main__":
    if sys.argv[1:] and sys.argv[1].startswith("-"):
        sys.exit("error: FOLDER must be a folder; python examples/pictures_of_one_index.py [FOLDER]")
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "docs" / "pictures"
    for path in make_pictures(target):
        print(f"{path} ({path.stat().st_size / 1e3:.0f} kB)")
