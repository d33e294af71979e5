"""Options of ``artperl estimate``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from artperl.methods import StoredMethod

if TYPE_CHECKING:
    from artperl.inputs import InputOptions


@dataclass(frozen=True)
class EstimateOptions:
    """Which files, how they are to be read, by which estimator, and what is written."""

    clouds: tyro.conf.Positional[tuple[Path, ...]]
    """Files, or folders of them; datasets of artsim, and shards (.tar)."""
    category: str = "laptop"
    """An estimator that comes with the package, by its name; or its folder; or the folder of a training run."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=("--json",))] = None
    """Write all of it here, as .json or as .npz with the part of every point too; - prints JSON instead of the list,
    and so does --json alone. Of several files: .jsonl, a line each; rerun the command to resume."""
    view: Path | None = None
    """Write a page for a browser here: the cloud by part, boxes, joint axes, and the way to them."""
    urdf: Path | None = None
    """Write the estimate as an object of boxes and joints into this folder, as URDF; its pose and states are in
    meta.json. Of an image of several objects: all of them where they are, as scene.xml, scene.usda and scene.json."""
    mjcf: Path | None = None
    """The same as MJCF, for MuJoCo; it may be the same folder."""
    usd: Path | None = None
    """The same as USD."""
    poses: Path | None = None
    """Of an object that stands still, seen from several sides: T_world_camera of each file, in their order, as .json, a
    list of 4 x 4 matrices. All files make one estimate then, in the first camera's frame."""
    unit: Literal["m", "mm", "cm"] | None = None
    """Unit of the numbers in the file. By default m, and mm for depth images of whole numbers."""
    camera: Literal["opencv", "opengl"] = "opencv"
    """Axes of the camera frame of a cloud: x right, y down, z forward; or, in OpenGL and Blender, y up and z back."""
    intrinsics: Path | None = None
    """Camera of a depth image, which the file is then taken for."""
    mask: Path | None = None
    """Image that is not black where the object is in the depth image; or a folder of them, named as the images."""
    mask_id: str | None = None
    """Which object of the mask: its number, its index in a palette, its colour as R,G,B, or the number of a mask in a
    stack."""
    mask_kind: Literal["auto", "binary", "parts"] = "auto"
    """parts: the object is what is not 255, as in artsim's masks; binary: what is not 0; auto: as the mask looks."""
    depth_scale: float | None = None
    """Number of units (metres, or what --unit says) in one step of the depth image. By default what the intrinsics
    state, for whole numbers; else 0.001 for whole numbers, and 1 for floats."""
    depth_kind: Literal["z", "distance"] = "z"
    """Depth along the camera's axis, or distance along each ray, as some simulators write it. An image does not say
    which."""
    pixel_center: Literal["0", "0.5"] | None = None
    """Where the intrinsics have the centre of the first pixel. By default as their format has it."""
    image_id: str | None = None
    """Which image of a scene_camera.json; by default that in the depth image's name."""
    detector: str | None = None
    """Finds the objects of an image: name the image in colour and the depth image, and no category. tabletop, which
    comes with the package, or a folder that artperl train-detector wrote. The default where the first of two files is a
    picture in colour."""
    detections: Path | None = None
    """Instead of a detector, the objects that another one has found."""
    estimators: tuple[str, ...] = ()
    """For an image of several objects: CATEGORY=NAME, such as drawer=generic box=out/train/box-long, or a folder with
    one for each category. By default those that come with the package, by their names."""
    picture: Path | None = None
    """For an image of several objects: write the image with boxes and joint axes drawn over it here, as PNG."""
    skip_bad: bool = False
    """Leave out detections that cannot be used, and list them, instead of refusing the file."""
    seen_from: tuple[float, float] | None = None
    """Range of the camera's azimuth, degrees about the object's vertical, 0 for its front: -75 75 for
    a robot that stands before a cabinet. It is not below the object then. By default it may be anywhere."""
    method: StoredMethod = "full"
    """Method of the estimator: full, which comes with the package; artperl, the paper's, with weights for laptop,
    eyeglasses, dishwasher, scissors and drawer; or a baseline that you trained."""
    workers: int = 1
    """Processes, each of which takes a core. Lines are the same, in the same order, whatever their number."""
    ray: str | None = None
    """Instead of processes here, those of a Ray cluster: auto for the one that this machine belongs to, local to start
    one here, or HOST:PORT of its head. Every node must see the files, under the same names. Extra: ray."""

    def input_options(self) -> InputOptions:
        """How the files are to be read."""
        from artperl.inputs import InputOptions

        return InputOptions(
            unit=self.unit, camera=self.camera, intrinsics=self.intrinsics, mask=self.mask, mask_id=self.mask_id,
            mask_kind=self.mask_kind, depth_scale=self.depth_scale, depth_kind=self.depth_kind,
            pixel_center=self.pixel_center, image_id=self.image_id,
        )  # fmt: skip
