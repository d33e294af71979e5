"""Pictures of a scene's ground truth: colour, depth, parts and instances, with boxes and joint axes drawn in."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from artsim.common.files import write_atomic
from artsim.common.names import printable
from artsim.common.palette import PALETTE
from artsim.datasets.shards import png_bytes
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND
from artsim.observing.annotation import BOX_EDGES, axis_segment, box_corners
from artsim.observing.sample import Sample
from artsim.scenes.ground_truth import SceneView, write_view

_OVER = 2  # drawn larger, then reduced: smooth lines
_TINT = 0.62  # of a part's or instance's colour over the picture
_AXIS = (215, 25, 45)
_NEAREST = 1e-3  # metres before the camera: what comes nearer is not drawn


def overview(view: SceneView) -> NDArray[np.uint8]:
    """(2 H, 2 W, 3) picture: colour and depth above, parts with boxes and joint axes and instances below."""
    top = np.hstack([colour_picture(view), depth_picture(view)])
    return np.vstack([top, np.hstack([parts_picture(view), instances_picture(view)])])


def overview_files(view: SceneView) -> dict[str, bytes]:
    """``overview.png``, by its name."""
    return {"overview.png": png_bytes(overview(view))}


def write_overview(view: SceneView, folder: Path) -> None:
    """Write a view's files (see :func:`artsim.scenes.ground_truth.write_view`), and ``overview.png``."""
    write_view(view, folder)
    for name, content in overview_files(view).items():
        write_atomic(folder / name, content)


def colour_picture(view: SceneView) -> NDArray[np.uint8]:
    """(H, W, 3) the colour image; where the renderer made none, the depth in shades of grey."""
    if view.frame.rgb is not None:
        return view.frame.rgb
    grey = 255 - (200.0 * _share(view)).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)


def depth_picture(view: SceneView) -> NDArray[np.uint8]:
    """(H, W, 3) what the sensor reports, from yellow (near) to blue (far); black where it reports nothing."""
    share = _share(view)
    place = np.linspace(0.0, 1.0, len(_RAMP))
    picture = np.stack([np.interp(share, place, _RAMP[:, channel]) for channel in range(3)], axis=2)
    picture[view.depth == 0] = 0.0
    return picture.round().astype(np.uint8)


_RAMP = np.array([(253, 231, 37), (122, 209, 81), (34, 168, 132), (42, 120, 142), (65, 68, 135), (68, 1, 84)], float)


def _share(view: SceneView) -> NDArray[np.float64]:
    """(H, W) from near to far, 0 to 1: even in 1 / depth, between its 1st and 99th percentile."""
    inverse = 1.0 / np.where(view.depth > 0, view.depth, np.inf).astype(np.float64)
    seen = inverse[view.depth > 0]
    far, near = np.percentile(seen, [1.0, 99.0]) if len(seen) else (0.0, 1.0)
    share: NDArray[np.float64] = ((near - inverse) / max(near - far, 1e-9)).clip(0.0, 1.0)
    return share


def parts_picture(view: SceneView) -> NDArray[np.uint8]:
    """(H, W, 3) a colour for each part, its box, and an arrow along each joint's axis."""
    frame = view.frame
    shown = frame.part_ids != BACKGROUND
    number = 3 * frame.instance_ids.astype(np.int64) + frame.part_ids
    canvas = _canvas(_tint(view, shown, number))
    draw = ImageDraw.Draw(canvas)
    for i, sample in enumerate(view.samples):
        if sample is not None:
            for k in range(len(sample.joint_type)):
                _draw_box(draw, sample, k, view.camera, (3 * i + k) % len(PALETTE))
            for k in range(1, len(sample.joint_type)):
                _draw_axis(draw, sample, k, view.camera)
    return _reduce(canvas)


def instances_picture(view: SceneView) -> NDArray[np.uint8]:
    """(H, W, 3) a colour for each articulated object, the rectangle around it, its name and how much of it is seen."""
    ids = view.frame.instance_ids
    shown = ids < len(view.scene.instances)
    canvas = _canvas(_tint(view, shown, ids.astype(np.int64)))
    draw = ImageDraw.Draw(canvas)
    for i, thing in enumerate(view.scene.instances):
        if not view.boxes[i].any():
            continue
        colour = _colour(i)
        left, top, right, bottom = (int(v) * _OVER for v in view.boxes[i])
        draw.rectangle((left, top, right - 1, bottom - 1), outline=colour, width=2 * _OVER)
        text = f"{i} {printable(thing.obj.category.replace('_', ' '), 40)} {100 * view.visible_fraction[i]:.0f}%"
        size = 7 * _OVER + canvas.height // 90
        place = (left + 4, max(top - size - 6, 2))
        draw.rectangle(draw.textbbox(place, text, font_size=size), fill=colour)
        draw.text(place, text, fill=(255, 255, 255), font_size=size)
    return _reduce(canvas)


def _tint(view: SceneView, shown: NDArray[np.bool_], number: NDArray[np.int64]) -> NDArray[np.uint8]:
    """The picture without much colour, but for pixels that have a number."""
    grey = colour_picture(view).mean(axis=2, keepdims=True)
    picture = np.repeat(0.55 * grey + 110.0, 3, axis=2)
    light = 0.45 + 0.75 * grey[shown] / 255.0
    picture[shown] = _TINT * PALETTE[number[shown] % len(PALETTE)] * light + (1.0 - _TINT) * grey[shown]
    return picture.clip(0, 255).astype(np.uint8)


def _draw_box(draw: ImageDraw.ImageDraw, sample: Sample, k: int, camera: Camera, number: int) -> None:
    corners = box_corners(sample, k)
    if (corners[:, 2] > _NEAREST).all():
        image = camera.project(corners) * _OVER
        for a, b in BOX_EDGES:
            draw.line([tuple(image[a]), tuple(image[b])], fill=_colour(number), width=_OVER)


def _draw_axis(draw: ImageDraw.ImageDraw, sample: Sample, k: int, camera: Camera) -> None:
    ends = np.stack(axis_segment(sample, k))
    if (ends[:, 2] <= _NEAREST).any():
        return
    start, end = camera.project(ends) * _OVER
    along = end - start
    length = float(np.hypot(*along))
    if length < 1.0:
        return
    along, tip = along / length, min(7.0 * _OVER, 0.4 * length)
    side = np.array([-along[1], along[0]])
    draw.line([tuple(start), tuple(end - 0.6 * tip * along)], fill=_AXIS, width=int(1.5 * _OVER))
    draw.polygon([tuple(end), *(tuple(end - tip * along + s * 0.45 * tip * side) for s in (1, -1))], fill=_AXIS)


def _colour(number: int) -> tuple[int, int, int]:
    red, green, blue = PALETTE[number % len(PALETTE)].tolist()
    return red, green, blue


def _canvas(picture: NDArray[np.uint8]) -> Image.Image:
    height, width = picture.shape[:2]
    return Image.fromarray(picture).resize((width * _OVER, height * _OVER), Image.Resampling.BILINEAR)


def _reduce(canvas: Image.Image) -> NDArray[np.uint8]:
    return np.asarray(canvas.resize((canvas.width // _OVER, canvas.height // _OVER), Image.Resampling.BOX))
