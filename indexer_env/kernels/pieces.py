"""The straight lines of the joints and the pieces of the motion law, loaded into a lane."""

from __future__ import annotations

import math

import numpy as np

from .compiling import outlined, scalar
from .effects import mesh_share
from .joints import region_line
from .layout import *


@scalar
def set_line(w, i, region, line, joint, ratio):
    """Put the joint whose coefficient rows begin at `joint` on the line of its region."""
    k, offset, r = region_line(
        w[region + i], w[joint + i], w[joint + R_1 - K_1 + i], w[joint + EDGE_1 - K_1 + i], ratio,
        w[joint + FREE_R_1 - K_1 + i],
    )  # fmt: skip
    w[line + i], w[line + LINE_OFFSET_1 - LINE_K_1 + i], w[line + LINE_R_1 - LINE_K_1 + i] = k, offset, r


@outlined
def set_lines(w, i):
    """Put all three joints of lane i on the lines of their regions."""
    set_line(w, i, REGION_1, LINE_K_1, K_1, w[RATIO_1 + i])
    share = mesh_share(w[REGION_1 + i], w[MESH_FRICTION + i])
    w[LINE_K_1 + i], w[LINE_R_1 + i] = share * w[LINE_K_1 + i], share * w[LINE_R_1 + i]
    set_line(w, i, REGION_2, LINE_K_2, K_2, w[STATION_RATIO_2 + i])
    set_line(w, i, REGION_3, LINE_K_3, K_3, w[RATIO_3 + i])
    w[LINE_CUBIC_2 + i] = 0.0 if w[REGION_2 + i] == 0.0 else w[CUBIC_2 + i]


@outlined
def set_turn(w, i, turn, pieces):
    """Put lane i into a cam turn: where its law stands there, and the stiffness ratio of its station.

    A station whose spacing is off by ε lengthens the index that leads to it by the factor 1 + ε/h, shortens the next.
    """
    stations, advance, spacing = w[STATIONS + i], w[ADVANCE + i], w[SPACING_ERROR + i]
    station = turn - stations * math.floor(turn / stations)
    following = station + 1.0 - stations * math.floor((station + 1.0) / stations)
    factor, offset = 1.0, turn * advance
    if spacing != 0.0 and following == w[SPACING_STATION + i]:
        factor = 1.0 + spacing / advance
    elif spacing != 0.0 and station == w[SPACING_STATION + i]:
        factor, offset = 1.0 - spacing / advance, offset + spacing
    rest = pieces[np.uint64(int(w[LAW_FIRST + i])), PIECE_C_0]
    w[CAM_TURN + i], w[TURN_START + i], w[TURN_FACTOR + i] = turn, TWO_PI * turn, factor
    w[TURN_TABLE + i] = offset + rest - factor * rest
    ratio = w[RATIO_2 + i] * (w[SINGLE_RATIO_2 + i] if station == w[SINGLE_STATION + i] else 1.0)
    if ratio != w[STATION_RATIO_2 + i]:
        w[STATION_RATIO_2 + i] = ratio
        w[RELEASE_MINUS_2 + i] = w[RELEASE_2 + i] / ratio
        w[HARDENING_MINUS_2 + i] = w[HARDENING_2 + i] / ratio
        set_lines(w, i)


@scalar
def steady(w, i):
    """Whether what ripples on the drive of lane i, if anything, is of a constant frequency: no ramp of its motor."""
    still = w[RIPPLE_AMPLITUDE + i] == 0.0 and w[TRANSMISSION_AMPLITUDE + i] == 0.0
    return still or w[MOTOR_ACCELERATION + i] == 0.0


@outlined
def load_piece(w, i, piece, pieces):
    """Load piece `piece` of the law in its present cam turn into lane i; indices beyond it wrap into its neighbours."""
    count = int(w[LAW_COUNT + i])
    if piece < 0:
        piece = count - 1
        set_turn(w, i, w[CAM_TURN + i] - 1.0, pieces)
    elif piece >= count:
        piece = 0
        set_turn(w, i, w[CAM_TURN + i] + 1.0, pieces)
    row = np.uint64(int(w[LAW_FIRST + i]) + piece)
    start, factor = w[TURN_START + i], w[TURN_FACTOR + i]
    low, high = start + pieces[row, PIECE_LOW], start + pieces[row, PIECE_HIGH]
    w[PIECE + i] = float(piece)
    w[ORIGIN + i], w[REACH_LOW + i], w[REACH_HIGH + i] = low, low, high
    w[BREAK_LOW + i] = low if pieces[row, PIECE_BREAK_LOW] != 0.0 else -math.inf
    w[BREAK_HIGH + i] = high if pieces[row, PIECE_BREAK_HIGH] != 0.0 else math.inf
    w[DWELLS + i] = w[LINEAR_DWELL + i] * pieces[row, PIECE_STILL] if steady(w, i) else 0.0
    w[C_0 + i] = w[TURN_TABLE + i] + factor * pieces[row, PIECE_C_0]
    for j in range(1, 6):
        w[C_0 + np.uint64(j) * LANES + i] = factor * pieces[row, np.uint64(PIECE_C_0 + j)]


@outlined
def find_piece(w, i, pieces):
    """Load the piece that holds the cam's angle, from any state."""
    turn = float(math.floor(w[CAM + i] / TWO_PI))
    angle = w[CAM + i] - TWO_PI * turn
    first, low, high = int(w[LAW_FIRST + i]), 0, int(w[LAW_COUNT + i]) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if pieces[np.uint64(first + middle), PIECE_LOW] <= angle:
            low = middle
        else:
            high = middle - 1
    set_turn(w, i, turn, pieces)
    load_piece(w, i, low, pieces)


@outlined
def follow_pieces(w, i, pieces):
    """Load the law's piece that the cam has reached. Smooth junctions need no landing and no new rates: the two
    polynomials agree there far below the step's error. A cam that jumped further (a run about to be rejected) is looked
    up, never walked to."""
    piece = int(w[PIECE + i])
    if w[CAM + i] >= w[REACH_HIGH + i]:
        load_piece(w, i, piece + 1, pieces)
    elif w[CAM + i] < w[REACH_LOW + i]:
        load_piece(w, i, piece - 1, pieces)
    if w[CAM + i] >= w[REACH_HIGH + i] or w[CAM + i] < w[REACH_LOW + i]:
        find_piece(w, i, pieces)
