"""Tables, names and lengths as text, for what ``print`` shows of a record on one screen.

Names come out of files that nobody vouches for: they are shown escaped, and cut to the width of their column.
"""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from artsim.common.names import printable

WIDTH, HEIGHT = 100, 24
"""Columns and lines of a screen."""
_NAME = 22
"""Columns of a name."""


def table(rows: Sequence[Sequence[str]], left: int = 1, most: int = HEIGHT - 8) -> list[str]:
    """Rows as lines of equally wide columns; the first row is the heading.

    Parameters
    ----------
    rows : sequence of sequences of str
        Cells, already :func:`~artsim.common.names.printable`.
    left : int
        Columns that are aligned to the left; the others, numbers, to the right.
    most : int
        Rows below the heading that are shown; of the others, one line tells how many there are.

    Returns
    -------
    list of str
        At most ``most + 2`` lines, none wider than ``WIDTH``.
    """
    shown = rows[: most + 1]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    sides = [str.ljust] * left + [str.rjust] * (len(widths) - left)
    lines = [
        "  ".join(side(cell, width) for side, cell, width in zip(sides, row, widths, strict=True)) for row in shown
    ]
    if len(rows) > len(shown):
        lines.append(f"... and {len(rows) - len(shown)} more")
    return [cut(line.rstrip()) for line in lines]


def cut(line: str, width: int = WIDTH) -> str:
    """A line of at most ``width`` characters."""
    return line if len(line) <= width else f"{line[: width - 3]}..."


def label_of(text: object) -> str:
    """A name from a file, as a cell of a table."""
    return cut(printable(text), _NAME)


def centimetres(metres: Sequence[float] | np.ndarray) -> str:
    """Lengths in centimetres: ``31.2 x 22.0 x 2.1``, with three digits that count."""
    return " x ".join(three_digits(100.0 * float(value)) for value in metres)


def joint_value(value: float, kind: str) -> str:
    """A joint state in degrees or, where the joint slides, in centimetres."""
    if not np.isfinite(value):
        return "any"
    return f"{three_digits(100.0 * value)} cm" if kind == "prismatic" else f"{np.rad2deg(value) + 0.0:.1f} deg"


def brief(record: Any) -> str:
    """A dataclass on one line: arrays by type and shape, sequences by length.

    Meant to be a class's ``__repr__``: the one that dataclasses have prints whole arrays.
    """
    shown = (f"{field.name}={_brief(getattr(record, field.name))}" for field in fields(record))
    return cut(f"{type(record).__name__}({', '.join(shown)})", 4 * WIDTH)


def _brief(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape}"
    if isinstance(value, (tuple, list, dict)) and len(value) > 4:
        return f"<{len(value)} items>"
    if isinstance(value, (tuple, list)):
        return f"({', '.join(map(_brief, value))})"
    return printable(repr(value), 60)


def first_of(texts: Sequence[str], most: int, between: str = ", ") -> str:
    """The first of some texts, and how many more there are."""
    more = [f"and {len(texts) - most} more"] if len(texts) > most else []
    return between.join([*texts[:most], *more])


def plural(number: int, thing: str) -> str:
    """``1 part``, ``3 parts``."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def three_digits(value: float) -> str:
    """Three digits that count, never as a power of ten where a person would not write one."""
    if value == 0 or not 1e-3 <= abs(value) < 1e7:
        return f"{value + 0.0:.3g}"
    return f"{value:.{max(0, 2 - int(np.floor(np.log10(abs(value)))))}f}"
