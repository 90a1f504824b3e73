"""A small picture of errors against seconds, both logarithmic, for the sidebar. numpy only."""

import numpy as np

SIZE = 160, 160  # rows, columns of pixels
PAPER, GRID = (0.10, 0.11, 0.12, 1.0), (0.25, 0.27, 0.30, 1.0)
INKS = ((0.42, 0.71, 1.0, 1.0), (1.0, 0.64, 0.36, 1.0), (0.64, 0.85, 0.46, 1.0))
DOTS = 1, 2, 1  # half sizes of the curves' points, pixels: told apart without colour too
BORDER = 4


def graph(curves, level=None):
    """curves [[(seconds, error)]], level: an error marked across -> (rows, columns, 4) float32, bottom row first."""
    picture = np.tile(np.array(PAPER, np.float32), (*SIZE, 1))
    clean = [np.array([p for p in c if p[0] > 0 and 0 < p[1] < np.inf]).reshape(-1, 2) for c in curves]
    everything = np.concatenate([*clean, np.zeros((0, 2))])
    if not len(everything):
        return picture
    values = np.log10(everything)
    low, high = np.floor(values.min(axis=0)), np.ceil(values.max(axis=0))
    if level is not None and level > 0:
        low[1], high[1] = min(low[1], np.floor(np.log10(level))), max(high[1], np.ceil(np.log10(level)))
    span = np.maximum(high - low, 1.0)

    def place(points):
        share = (np.log10(points) - low) / span
        return BORDER + share * (np.array(SIZE)[::-1] - 1 - 2 * BORDER)

    for axis in range(2):
        for decade in np.arange(low[axis], low[axis] + span[axis] + 0.5):
            at = int(round(BORDER + (decade - low[axis]) / span[axis] * (SIZE[1 - axis] - 1 - 2 * BORDER)))
            picture[(slice(None), at) if axis == 0 else (at, slice(None))] = GRID
    if level is not None and level > 0:
        row = int(round(place(np.array([[10.0 ** low[0], level]]))[0, 1]))
        picture[row, ::4] = INKS[0]
    for number, points in enumerate(clean):
        if len(points):
            _draw(picture, place(points), INKS[number % len(INKS)], DOTS[number % len(DOTS)])
    return picture


def _draw(picture, at, ink, dot):
    """A line through places (n, 2) column and row, a square of half size dot at each."""
    steps = [np.linspace(a, b, int(np.abs(b - a).max()) + 2) for a, b in zip(at[:-1], at[1:])]
    for column, row in np.rint(np.concatenate([*steps, at])).astype(int):
        picture[row, column] = ink
    for column, row in np.rint(at).astype(int):
        picture[max(row - dot, 0) : row + dot + 1, max(column - dot, 0) : column + dot + 1] = ink
