"""Pictures of a running machine, for the screen and for films. Needs pygame, which the extra ``[render]`` installs.

Map, in reading order
---------------------
scene                 `Scene`: all that a picture shows; `scene_from` builds one from the simulator's channels
frame                 `draw`, `draw_spectra`: a picture as an array of pixels; `Window`: a scene on the screen
picture, layout       the whole picture; which part stands where, at any size
table_view            table from above, stations, mark, housing and its screws
cam_view              cam from its side, its tracks, the rollers in them
joint_view            play of joints 1 and 2, exaggerated, with the flank in contact
chart_view            the table's acceleration against the theoretical one
spectra_view          spectra of the turns of a diagnosis, what is left of the budget
canvas, palette       smooth shapes and words on a pygame surface; the colours

No module outside this package and none of `scene` and `frame` at import needs pygame. Pixels are counted from the top
left corner; angles turn clockwise in the picture, as on a clock, zero is at the top.
"""

from indexer_env.render.frame import Window, draw, draw_spectra
from indexer_env.render.scene import SCENE_CHANNELS, Scene, scene_from

__all__ = ["SCENE_CHANNELS", "Scene", "Window", "draw", "draw_spectra", "scene_from"]
