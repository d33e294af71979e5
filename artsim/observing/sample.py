"""The Sample record: one camera view of one posed object, with everything that is true of it."""

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.common.outputs import write_output
from artsim.common.products import matmul, norm
from artsim.common.showing import Showable
from artsim.common.tables import centimetres, cut, joint_value, label_of, plural, table, three_digits
from artsim.model.details import DetailFrame
from artsim.model.kinematics import Array
from artsim.model.ply import cloud_ply

ARTSIM_VERSION = version("artsim")
"""Of this installation; each sample names the one that made it."""

__version__ = ARTSIM_VERSION

IMAGES = ("depth", "part_mask", "rgb")
"""Images that a sample can carry besides its cloud."""


@dataclass(frozen=True, eq=False)
class Sample(Showable):
    """One view of one posed object. N points, K parts; camera frame = OpenCV, metres, radians.

    Attributes
    ----------
    points : (N, 3) float32
        Partial cloud in the camera frame, as the sensor reports it: each point on the ray through its pixel's centre.
    part : (N,) uint8
        Part of each point: that which its ray truly meets.
    npcs : (N, 3) float32
        Normalised part coordinates ``(p_rest - box_center) / ||box_size|| + 0.5`` of the place that its ray truly
        meets, whatever the sensor reports.
    T_camera_part : (K, 4, 4) float64
        Maps the rest frame, as carried by part k, to the camera.
    box_center, box_size : (K, 3) float64
        Amodal box of each part, axis-aligned in the rest frame.
    visible_fraction : (K,) float64
        Visible over amodal pixels; exact when images are made, otherwise estimated from the rays cast.
    joint_type : tuple of str, length K
        "free" for the root, else revolute, continuous, prismatic or screw.
    joint_parent : (K,) int64
        Index of the parent part, -1 for the root.
    joint_axis, joint_origin : (K, 3) float64
        In the rest frame, at rest.
    joint_axis_camera, joint_origin_camera : (K, 3) float64
        As posed, in the camera frame.
    joint_state, joint_rest : (K,) float64
    joint_limits : (K, 2) float64
        Infinite where a joint turns freely.
    K : (3, 3) float64
        Camera intrinsics in pixels.
    T_world_camera : (4, 4) float64
    width, height : int
    part_names : tuple of str, length K
    category, object_id, object_sha256 : str
    scale, diagonal : float
        Size over native size; diagonal of the rest-state box in metres.
    seed, index : int
        What the sample was drawn from; -1 when it was asked for directly.
    renderer, artsim_version : str
    noise : str
        Name of the depth sensor.
    depth : (H, W) float32 or None
        z-depth in metres as the sensor reports it, 0 = no return.
    part_mask : (H, W) uint8 or None
        Part ids without noise, 255 = background.
    rgb : (H, W, 3) uint8 or None
    details : tuple of DetailFrame
        Handles, knobs, panes and other labelled pieces of the parts, each with a frame.
    detail : (N,) uint8 or None
        Number in ``details`` of the piece that each point's ray truly meets; 255 for none.
    """

    points: NDArray[np.float32]
    part: NDArray[np.uint8]
    npcs: NDArray[np.float32]
    T_camera_part: Array
    box_center: Array
    box_size: Array
    visible_fraction: Array
    joint_type: tuple[str, ...]
    joint_parent: NDArray[np.int64]
    joint_axis: Array
    joint_origin: Array
    joint_axis_camera: Array
    joint_origin_camera: Array
    joint_state: Array
    joint_rest: Array
    joint_limits: Array
    K: Array
    T_world_camera: Array
    width: int
    height: int
    part_names: tuple[str, ...]
    category: str
    object_id: str
    object_sha256: str
    scale: float
    diagonal: float
    seed: int
    index: int
    renderer: str
    artsim_version: str
    noise: str = "none"
    depth: NDArray[np.float32] | None = None
    part_mask: NDArray[np.uint8] | None = None
    rgb: NDArray[np.uint8] | None = None
    details: tuple[DetailFrame, ...] = ()
    detail: NDArray[np.uint8] | None = None

    def __str__(self) -> str:
        origin = f"sample {self.index} of seed {self.seed}" if self.index >= 0 else "a view that was asked for"
        images = [image for image in ("depth", "part_mask", "rgb") if getattr(self, image) is not None]
        distance = norm(self.T_camera_part[0, :3, 3])  # of the middle of the object at rest
        inside = f"{len(self.points):,} points, {plural(len(self.joint_type), 'part')}"
        made = f"renderer {label_of(self.renderer)}, noise {label_of(self.noise)}, images {', '.join(images) or 'none'}"
        return "\n".join(
            [
                cut(f"{label_of(self.category)} {label_of(self.object_id)}   {origin}"),
                f"{inside}, diagonal {three_digits(100 * self.diagonal)} cm, {distance:.2f} m from the camera",
                cut(f"camera {self.width} x {self.height}, {made}"),
                "",
                *table(part_rows(self), left=3),
            ]
        )

    def __repr__(self) -> str:
        who = f"{type(self).__name__} {label_of(self.category)} {label_of(self.object_id)}"
        return f"<{who}: {len(self.points):,} points, {plural(len(self.joint_type), 'part')}>"

    def save_ply(self, path: str | Path) -> Path:
        """Write the cloud as PLY, in the camera frame and metres, each point in the colour of its part.

        Parameters
        ----------
        path : path

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ConfigError
            When it cannot be written.
        """
        write_output(Path(path), cloud_ply(self.points, self.part))
        return Path(path)

    @property
    def T_camera_detail(self) -> Array:
        """(D, 4, 4) frames of ``details`` as posed, in the camera frame."""
        frames = [matmul(self.T_camera_part[detail.part], detail.T_rest_detail) for detail in self.details]
        return np.array(frames).reshape(-1, 4, 4)

    @property
    def rest_points(self) -> Array:
        """(N, 3) where in the rest frame, at rest, each place lies that ``npcs`` names, metres; NaN for other things.

        Points of other things are those of :func:`artsim.observing.interference.interfere`.
        """
        diagonal, part = norm(self.box_size), np.where(np.isnan(self.npcs[:, 0]), 0, self.part)
        rest: Array = (self.npcs - 0.5) * diagonal[part, None] + self.box_center[part]
        return rest


def part_rows(sample: Sample) -> list[tuple[str, ...]]:
    """A heading, and a row for each part: number, name, joint, points, how much is seen, state, limits and size."""
    rows: list[tuple[str, ...]] = [("part", "name", "joint", "points", "visible", "state", "from", "to", "size, cm")]
    counts = np.bincount(sample.part, minlength=len(sample.joint_type))
    for k, kind in enumerate(sample.joint_type):
        values = (sample.joint_state[k], *sample.joint_limits[k]) if k else ()
        state, low, high = (joint_value(float(value), kind) for value in values) if k else ("", "", "")
        visible = f"{100 * sample.visible_fraction[k]:.0f} %"
        shown = (str(k), label_of(sample.part_names[k]), kind, f"{counts[k]:,}", visible, state, low, high)
        rows.append((*shown, centimetres(sample.box_size[k])))
    return rows
