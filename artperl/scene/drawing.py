"""Estimates drawn over their image: boxes of parts, joint axes, what each object is and how sure."""

import io
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from artperl.core.confidence import LIKELY
from artperl.core.estimate import Estimate
from artperl.scene.estimator import SceneEstimate
from artsim.common.names import printable
from artsim.common.palette import PALETTE
from artsim.model.camera import Camera

Rectangle: TypeAlias = "tuple[float, float, float, float]"

_OVER = 2  # drawn larger, then reduced: smooth lines
_NEAREST = 1e-3  # metres before the camera: what comes nearer is not drawn
_AXIS = (235, 25, 45)
_LUMA = (0.299, 0.587, 0.114)
_BRIGHT = 140
"""Luma of BT.601 from which black is easier to read on a colour than white."""
_REACH = 0.18
"""Half of an axis, over the diagonal of all sizes."""
_SIGNS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) - 0.5
_EDGES = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]


def scene_gallery(pictures: Sequence[bytes], columns: int = 3, width: int = 480) -> bytes:
    """PNG of several pictures side by side, in 256 colours: a quarter of the size, and it looks the same.

    Parameters
    ----------
    pictures : sequence of bytes
        Of :func:`draw_scene`, all of one size.
    columns : int
    width : int
        Pixels of each.
    """
    images = [Image.open(io.BytesIO(picture)) for picture in pictures]
    height = round(width * images[0].height / images[0].width)
    sheet = Image.new("RGB", (columns * width, -(-len(images) // columns) * height), (255, 255, 255))
    for number, image in enumerate(images):
        row, column = divmod(number, columns)
        sheet.paste(image.resize((width, height), Image.Resampling.LANCZOS), (column * width, row * height))
    buffer = io.BytesIO()
    sheet.quantize(256).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def draw_scene(rgb: NDArray[np.uint8], K: NDArray[np.float64], scene: SceneEstimate) -> bytes:
    """PNG of an image with its objects; boxes of parts and axes are drawn of what is more likely right than wrong.

    Parameters
    ----------
    rgb : (H, W, 3) uint8
    K : (3, 3) float
    scene : SceneEstimate
    """
    height, width = rgb.shape[:2]
    camera = Camera(K, width, height, np.eye(4))
    canvas = Image.fromarray(rgb).resize((width * _OVER, height * _OVER), Image.Resampling.BILINEAR)
    draw = ImageDraw.Draw(canvas)
    for number, obj in enumerate(scene.objects):
        if obj.estimate is not None and obj.estimate.confidence >= LIKELY:
            _draw_boxes(draw, obj.estimate, camera, number)
            _draw_axes(draw, obj.estimate, camera)
    taken: list[Rectangle] = []
    for number, obj in enumerate(scene.objects):  # on top of all lines
        unsure = "" if obj.estimate is None or obj.estimate.confidence >= LIKELY else ", not drawn"
        sure = "no estimate" if obj.estimate is None else f"{100 * obj.score:.0f} %{unsure}"
        text = f"{number} {printable(obj.detection.category, 40)} {sure}"
        taken.append(_label(draw, obj.detection.box, text, number, height // 20, taken))
    buffer = io.BytesIO()
    canvas.resize((width, height), Image.Resampling.BOX).save(buffer, "PNG")
    return buffer.getvalue()


def _colour(number: int) -> tuple[int, int, int]:
    red, green, blue = PALETTE[number % len(PALETTE)].tolist()
    return red, green, blue


def _draw_boxes(draw: ImageDraw.ImageDraw, estimate: Estimate, camera: Camera, number: int) -> None:
    for k in range(len(estimate.state)):
        corners = (_SIGNS * estimate.size[k]) @ estimate.rotation[k].T + estimate.translation[k]
        if (corners[:, 2] > _NEAREST).all():
            image = camera.project(corners) * _OVER
            for a, b in _EDGES:
                draw.line([tuple(image[a]), tuple(image[b])], fill=_colour(3 * number + k), width=_OVER + 1)


def _draw_axes(draw: ImageDraw.ImageDraw, estimate: Estimate, camera: Camera) -> None:
    reach = _REACH * float(np.linalg.norm(estimate.size.max(axis=0)))
    for k in range(1, len(estimate.state)):
        axis, origin, center = estimate.joint_axis[k], estimate.joint_origin[k], estimate.translation[k]
        # A slide has no line of its own, and the origin may lie anywhere on an axis: draw where the part is.
        middle = center if estimate.joint_type[k] == "prismatic" else origin + axis * ((center - origin) @ axis)
        ends = np.stack([middle - reach * axis, middle + reach * axis])
        if (ends[:, 2] <= _NEAREST).any():
            continue
        start, end = camera.project(ends) * _OVER
        length = float(np.hypot(*(end - start)))
        if length < 1.0:
            continue
        along = (end - start) / length
        tip, side = min(7.0 * _OVER, 0.4 * length), np.array([-along[1], along[0]])
        draw.line([tuple(start), tuple(end - 0.6 * tip * along)], fill=_AXIS, width=2 * _OVER)
        draw.polygon([tuple(end), *(tuple(end - tip * along + s * 0.45 * tip * side) for s in (1, -1))], fill=_AXIS)


def _label(
    draw: ImageDraw.ImageDraw, box: Rectangle, text: str, number: int, size: int, taken: Sequence[Rectangle]
) -> Rectangle:
    """Draw a detection and its label, below what labels have taken: the place of the label."""
    left, top, width, tall = (v * _OVER for v in box)
    colour = _colour(3 * number)
    draw.rectangle((left, top, left + width - 1, top + tall - 1), outline=colour, width=1)
    place = (left + 4, max(top - size - 6, 2))
    ends = draw.textbbox(place, text, font_size=size)
    while any(ends[0] < e and ends[1] < s and ends[2] > w and ends[3] > n for w, n, e, s in taken):
        place = (place[0], place[1] + size)
        ends = draw.textbbox(place, text, font_size=size)
    draw.rectangle(ends, fill=colour)
    bright = float(np.dot(colour, _LUMA)) > _BRIGHT
    draw.text(place, text, fill=(0, 0, 0) if bright else (255, 255, 255), font_size=size)
    return ends
