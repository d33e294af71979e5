"""A gallery of procedural objects: each category's objects in a few joint states, as one picture."""

import io
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from artsim.common.names import printable
from artsim.common.progress import track
from artsim.model.draws import farther_ends
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.portrait import portrait

_TILE = 260  # pixels
_HEADER = 40
_FONT = 27
"""Pixels: on a page that shows the picture at 900 columns, a name is as large as small print."""
_TILES_PER_ROW = 9


def draw_gallery(objects: Sequence[ArticulatedObject], states: int = 3) -> bytes:
    """PNG with every object at rest and opened further and further, nine pictures in a row.

    Parameters
    ----------
    objects : sequence of ArticulatedObject
    states : int
        Pictures of each object; one shows it opened.
    """
    columns = min(len(objects), max(1, _TILES_PER_ROW // states))
    rows = -(-len(objects) // columns)
    width = columns * states * _TILE
    sheet = Image.new("RGB", (width, rows * (_TILE + _HEADER)), "white")
    draw = ImageDraw.Draw(sheet)
    alike = len({obj.category for obj in objects}) < len(objects)
    font = ImageFont.load_default(size=_FONT)
    for number, obj in enumerate(track("gallery", objects, unit="object", leave=False)):
        row, column = divmod(number, columns)
        x, y = column * states * _TILE, row * (_TILE + _HEADER)
        title = printable(f"{obj.category} {obj.object_id if alike else ''}".replace("_", " "))
        draw.text((x + 6, y + 2), title, "black", font)
        for i, q in enumerate(opening_states(obj, states)):
            sheet.paste(Image.fromarray(portrait(obj, q, _TILE)), (x + i * _TILE, y + _HEADER))
    buffer = io.BytesIO()
    sheet.quantize(256).save(buffer, "PNG", optimize=True)  # a third of the size
    return buffer.getvalue()


def opening_states(obj: ArticulatedObject, count: int) -> list[Array]:
    """At rest, then every joint on its way to its farther limit, the last time by 0.4 to 0.9 of it; one is the last."""
    rng = np.random.default_rng(0)
    rest = obj.tree.rest
    share = rng.uniform(0.4, 0.9, len(rest))
    steps = np.linspace(0.0, 1.0, count) if count > 1 else [1.0]
    return [obj.tree.complete_state(rest + step * share * (farther_ends(obj) - rest)) for step in steps]
