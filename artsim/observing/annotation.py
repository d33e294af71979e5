"""What is drawn into every picture: a colour for each part, boxes, joint axes, and surfaces shaded by part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.common.palette import PALETTE
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.transforms import transform_points
from artsim.observing.sample import Sample

_LIGHT = np.array([0.35, -0.55, -0.76])  # towards the light, camera frame
BOX_EDGES = np.array([(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit])


@dataclass(frozen=True)
class Shown:
    """A sample with the frame it was seen in."""

    sample: Sample
    frame: Frame
    title: str

    @property
    def camera(self) -> Camera:
        """The sample's camera."""
        s = self.sample
        return Camera(s.K, s.width, s.height, s.T_world_camera)


def box_corners(sample: Sample, k: int) -> Array:
    """(8, 3) corners of part k's box in the camera frame."""
    signs = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool) - 0.5
    return transform_points(sample.T_camera_part[k], sample.box_center[k] + signs * sample.box_size[k])


def axis_segment(sample: Sample, k: int) -> tuple[Array, Array]:
    """Start and end of an arrow along joint k's axis, camera frame: about a third of the object long."""
    center = transform_points(sample.T_camera_part[k], sample.box_center[k][None])[0]
    axis, origin = sample.joint_axis_camera[k], sample.joint_origin_camera[k]
    return segment_at(sample.joint_type[k], axis, origin, center, sample.diagonal)


def segment_at(kind: str, axis: Array, origin: Array, center: Array, diagonal: float) -> tuple[Array, Array]:
    """Start and end of an arrow along a joint's axis, beside the centre of the part that it moves.

    Parameters
    ----------
    kind : str
    axis, origin, center : (3,) float
        Of the joint, and of the part's box, metres, in one frame.
    diagonal : float
        Of the object, metres.
    """
    # The origin may lie anywhere on the axis, and a slide has no line of its own: draw where the part is.
    middle = center if kind == "prismatic" else origin + axis * ((center - origin) @ axis)
    half = 0.18 * diagonal * axis
    return middle - half, middle + half


def shade_parts(frame: Frame, camera: Camera) -> NDArray[np.uint8]:
    """(H, W, 3) part colours, lit by the surface's orientation."""
    height, width = frame.depth.shape
    points = camera.unproject(np.arange(height * width), frame.depth.ravel()).reshape(height, width, 3)
    across, down = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normal = np.cross(across, down)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    light = 0.45 + 0.55 * np.abs(normal @ _LIGHT)
    seen = frame.part_ids != BACKGROUND
    image = np.full((height, width, 3), 255.0)
    image[seen] = PALETTE[frame.part_ids[seen] % len(PALETTE)] * light[seen][:, None]
    return image.clip(0, 255).astype(np.uint8)
