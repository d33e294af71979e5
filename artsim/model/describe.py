"""What ``print`` shows of objects and samples: what matters, on one screen.

Names come out of files that nobody vouches for: they are shown escaped, and cut to the width of their column.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from artsim.common.names import printable

if TYPE_CHECKING:
    from artsim.model.objects import ArticulatedObject
    from artsim.observing.sample import Sample

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


def name(text: object) -> str:
    """A name from a file, as a cell of a table."""
    return cut(printable(text), _NAME)


def lengths(metres: Sequence[float] | np.ndarray) -> str:
    """Lengths in centimetres: ``31.2 x 22.0 x 2.1``, with three digits that count."""
    return " x ".join(_number(100.0 * float(value)) for value in metres)


def joint_value(value: float, kind: str) -> str:
    """A joint state in degrees or, where the joint slides, in centimetres."""
    if not np.isfinite(value):
        return "any"
    return f"{_number(100.0 * value)} cm" if kind == "prismatic" else f"{np.rad2deg(value) + 0.0:.1f} deg"


def object_text(obj: ArticulatedObject) -> str:
    """What ``print(obj)`` shows: who it is, its size, and a table of its parts."""
    tree = obj.tree
    rows: list[tuple[str, ...]] = [("part", "name", "joint", "from", "to", "size, cm", "triangles")]
    for k, (part, joint) in enumerate(zip(obj.parts, tree.joints, strict=True)):
        ends = [joint_value(end, joint.type) if k else "" for end in (joint.lower, joint.upper)]
        kind = joint.type if joint.mimic is None else f"{joint.type} (follows {joint.mimic.source})"
        rows.append((str(k), name(part.label), kind, *ends, lengths(obj.box_size[k]), f"{len(part.faces):,}"))
    inside = f"{_count(len(obj), 'part')}, {_count(len(tree.free_joints), 'free joint')}, {obj.num_faces:,} triangles"
    size = "no geometry"
    if obj.has_surface.any():
        size = f"{lengths(obj.bounds[1] - obj.bounds[0])} cm, diagonal {_number(100 * obj.diagonal)} cm"
    return "\n".join(
        [
            cut(f"{name(obj.category)} {name(obj.object_id)}   from {printable(obj.source or 'memory', 60)}"),
            f"{inside}, {_count(len(obj.repairs), 'repair')}",
            f"{size}, scale {obj.scale:.4g}",
            "",
            *table(rows, left=3),
        ]
    )


def object_line(obj: ArticulatedObject) -> str:
    """What ``repr(obj)`` shows."""
    return (
        f"<{type(obj).__name__} {name(obj.category)} {name(obj.object_id)}: {_count(len(obj), 'part')}, "
        f"{_count(len(obj.tree.free_joints), 'free joint')}>"
    )


def sample_text(sample: Sample) -> str:
    """What ``print(sample)`` shows: the view, and a table of what it shows of each part."""
    rows: list[tuple[str, ...]] = [("part", "name", "joint", "points", "visible", "state", "from", "to", "size, cm")]
    counts = np.bincount(sample.part, minlength=len(sample.joint_type))
    for k, kind in enumerate(sample.joint_type):
        values = (sample.joint_state[k], *sample.joint_limits[k]) if k else ()
        state, low, high = (joint_value(float(value), kind) for value in values) if k else ("", "", "")
        visible = f"{100 * sample.visible_fraction[k]:.0f} %"
        shown = (str(k), name(sample.part_names[k]), kind, f"{counts[k]:,}", visible, state, low, high)
        rows.append((*shown, lengths(sample.box_size[k])))
    origin = f"sample {sample.index} of seed {sample.seed}" if sample.index >= 0 else "a view that was asked for"
    images = [image for image in ("depth", "part_mask", "rgb") if getattr(sample, image) is not None]
    distance = np.linalg.norm(sample.T_camera_part[0, :3, 3])  # of the middle of the object at rest
    inside = f"{len(sample.points):,} points, {_count(len(sample.joint_type), 'part')}"
    made = f"renderer {name(sample.renderer)}, noise {name(sample.noise)}, images {', '.join(images) or 'none'}"
    return "\n".join(
        [
            cut(f"{name(sample.category)} {name(sample.object_id)}   {origin}"),
            f"{inside}, diagonal {_number(100 * sample.diagonal)} cm, {distance:.2f} m from the camera",
            cut(f"camera {sample.width} x {sample.height}, {made}"),
            "",
            *table(rows, left=3),
        ]
    )


def sample_line(sample: Sample) -> str:
    """What ``repr(sample)`` shows."""
    return (
        f"<{type(sample).__name__} {name(sample.category)} {name(sample.object_id)}: {len(sample.points):,} points, "
        f"{_count(len(sample.joint_type), 'part')}>"
    )


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


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def _number(value: float) -> str:
    """Three digits that count, never as a power of ten where a person would not write one."""
    if value == 0 or not 1e-3 <= abs(value) < 1e7:
        return f"{value + 0.0:.3g}"
    return f"{value:.{max(0, 2 - int(np.floor(np.log10(abs(value)))))}f}"
