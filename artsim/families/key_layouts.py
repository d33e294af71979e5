"""Layouts of keyboards: groups of cells, each of which moves as one part. Lengths are in key pitches."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from artsim.making.draws import Draws
from artsim.model.kinematics import Array

MOST_KEYS = 40
"""Parts that the keys of one keyboard make at most; larger ones move row by row."""

Cell = tuple[float, float, float, float]
"""Centre and size of a key along u and v, in key pitches."""


def grid_layout(v: float, columns: int, rows: int) -> list[list[Cell]]:
    """Single keys, with the upper left corner of the first at (0, v)."""
    return [[(c + 0.5, v - r - 0.5, 1.0, 1.0)] for r in range(rows) for c in range(columns)]


def key_row(draws: Draws, u: float, v: float, units: float, space: bool) -> list[Cell]:
    """Keys from u on, ``units`` pitches together, with wider ones at the ends or a space bar in the middle."""
    if space:
        sides = draws.integer("keys_beside_space", 1, 3)
        bar = units - 2 * sides * 1.25
        widths = [1.25] * sides + [bar] + [1.25] * sides
    else:
        first = draws.pick("first_key", [1.0, 1.5, 1.75, 2.25])
        count = int(units - first - 1.0)
        widths = [first, *[1.0] * count, units - first - count]
    edges = u + np.concatenate([[0.0], np.cumsum(widths)])
    return [(0.5 * (a + b), v - 0.5, b - a, 1.0) for a, b in pairwise(edges)]


def full_layout(draws: Draws) -> list[list[Cell]]:
    """Rows that move as one each; the space bar and some keys by themselves; blocks to the right."""
    units, rows = float(draws.integer("row_keys", 12, 15)), draws.integer("key_rows", 4, 5)
    groups = [key_row(draws, 0.0, float(rows - r), units, r == rows - 1) for r in range(rows)]
    last = groups.pop()
    middle = len(last) // 2
    groups += [[last[middle]], last[:middle], last[middle + 1 :]]
    if draws.chance("function_keys", 0.6):
        top = rows + 1.0 + draws.number("function_keys_gap", (0.1, 0.5))
        third = range(int(units / 3.0 - 0.2))
        groups += [[(c + 0.5 + k * units / 3.0 + 0.2, top - 0.5, 1.0, 0.85) for c in third] for k in range(3)]
    right = units
    if draws.chance("cursor_block", 0.6):
        right += 0.3
        groups.append([(right + c + 0.5, 0.5, 1.0, 1.0) for c in range(3)] + [(right + 1.5, 1.5, 1.0, 1.0)])
        groups.append([(right + c + 0.5, rows - r - 0.5, 1.0, 1.0) for r in range(2) for c in range(3)])
        right += 3.0
    if draws.chance("number_block", 0.5):
        right += 0.3
        groups += [[(right + c + 0.5, rows - r - 0.5, 1.0, 1.0) for c in range(4)] for r in range(rows)]
    return groups


def compact_layout(draws: Draws) -> list[list[Cell]]:
    """Three or four rows of single keys."""
    rows = draws.integer("key_rows", 3, 4)
    units = float(draws.integer("row_keys", 8, 12 if rows == 3 else 10))
    groups = [[cell] for r in range(rows - 1) for cell in key_row(draws, 0.0, float(rows - r), units, False)]
    return groups + [[cell] for cell in key_row(draws, 0.0, 1.0, units, units > 8)]


def number_layout(draws: Draws) -> list[list[Cell]]:
    """A number pad; at times with a double 0 and tall keys."""
    rows, columns = draws.integer("key_rows", 4, 6), draws.integer("key_columns", 3, 5)
    groups = grid_layout(float(rows), columns, rows)
    if draws.chance("wide_zero", 0.7):
        del groups[-columns : -columns + 2]
        groups.append([(1.0, 0.5, 2.0, 1.0)])
    if draws.chance("tall_key", 0.6):
        tall = [(columns - 0.5, 0.5, 1.0, 1.0), (columns - 0.5, 1.5, 1.0, 1.0)]
        if all([cell] in groups for cell in tall):
            groups = [group for group in groups if group[0] not in tall]
            groups.append([(columns - 0.5, 1.0, 1.0, 2.0)])
    return groups


def macro_layout(draws: Draws) -> list[list[Cell]]:
    """A few keys in a grid."""
    return grid_layout(0.0, draws.integer("key_columns", 1, 6), draws.integer("key_rows", 1, 4))


def extent(groups: Sequence[Sequence[Cell]]) -> Array:
    """(2,) extent of all cells along u and v, in pitches."""
    cells = np.array([cell for group in groups for cell in group])
    extent: Array = (cells[:, :2] + 0.5 * cells[:, 2:]).max(axis=0) - (cells[:, :2] - 0.5 * cells[:, 2:]).min(axis=0)
    return extent


def half_layout(draws: Draws) -> list[list[Cell]]:
    """Keys of one half: single ones, or rows."""
    rows, units = draws.integer("key_rows", 3, 5), float(draws.integer("row_keys", 4, 7))
    if rows * units <= 0.5 * MOST_KEYS:
        return grid_layout(float(rows), int(units), rows)
    return [key_row(draws, 0.0, float(rows - r), units, False) for r in range(rows)]
