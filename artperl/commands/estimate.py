"""``artperl estimate``: the poses of objects in users' files, one by one or a folder of them."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import tee
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import tyro

from artperl.commands.estimate_record import arrays_of, record_of
from artperl.commands.resumed_lines import line_name
from artperl.methods import StoredMethod
from artsim.common.outputs import check_output, output_file, write_output
from artsim.common.progress import track
from artsim.errors import ConfigError

if TYPE_CHECKING:
    from artperl.inputs import InputOptions
    from artperl.methods.protocol import Method

STDOUT = Path("-")


@dataclass(frozen=True)
class Estimate:
    """Estimate the poses of the parts of an object, and list them: by name, with states, limits and boxes.

    From a cloud: artperl estimate cloud.ply --category laptop --view out.html

    From a depth image: artperl estimate depth.png --mask mask.png --intrinsics camera.json --category laptop

    All objects of an image: artperl estimate image.png depth.png --intrinsics camera.json --picture boxes.png

    From a folder, or several files, one line of JSON each: artperl estimate FOLDER --category laptop --out poses.jsonl

    From a dataset or its shards, in four processes: artperl estimate DATASET --category laptop --out poses.jsonl
    --workers 4, or on a cluster, --ray auto. A line names the shard and the sample.

    Clouds: .npy and .npz (N, 3), (N, 4 or more) of which the first three columns count, (H, W, 3), or records with
    x, y, z; .ply; .pcd; .xyz .txt .csv .pts .asc with any separator; vertices of .obj .stl .off. Camera frame (x right,
    y down, z forward), metres: see --unit and --camera. Points at exactly 0 0 0, or not finite, are left out.

    Depth images, with --intrinsics: 16-bit .png, .tif, .pgm, .pfm; .npy and .npz (H, W). Whole numbers are millimetres,
    floats metres: see --unit and --depth-scale. 0, NaN and 65535 are no measurement. Depth is taken along the camera's
    axis: see --depth-kind.

    Masks: .png .bmp .gif .tif .pgm .jpg .webp in any mode, .npy, .npz. The object is what is not black, whatever alpha
    says; of a JPEG, or a soft mask, what is over half; of artsim's own part_mask.png what is not 255.

    Intrinsics: .json of artsim (fx, fy, cx, cy, or K), BOP (camera.json, scene_camera.json), Open3D, RealSense, ROS
    CameraInfo, NeRF (transforms.json); .yaml of ROS and OpenCV; a 3 x 3 matrix as .txt, .npy or .npz. The centre of the
    first pixel is at 0.5 in artsim's and NeRF's files, and at 0 in all others: see --pixel-center.

    Detections: COCO's results, a list of image_id, category (or category_id beside categories), score, segmentation
    (run lengths or polygons) or bbox (left, top, width, height). The file may hold those of other images, too:
    --image-id.

    Results are in metres and radians: part_names, joint_type, state and joint_limits (K, 2; those of the reference;
    null where there is none) with state_unit, rotation, translation and size of each box, T_camera_part, confidence,
    warnings.
    """

    clouds: tyro.conf.Positional[tuple[Path, ...]]
    """Files, or folders of them; datasets of artsim, and shards (.tar)."""
    category: str = "laptop"
    """An estimator that comes with the package, by its name; or its folder; or the folder of a training run."""
    out: Path | None = None
    """Write all of it here, as .json or as .npz with the part of every point too; - prints JSON instead of the list. Of
    several files: .jsonl, a line each; the same command goes on where it stopped."""
    view: Path | None = None
    """Write a page for a browser here: the cloud by part, boxes, joint axes, and the way to them."""
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
    """Depth along the camera's axis, or distance along each ray, as some simulators write it. An image does not tell
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
    """Of an image of several objects: CATEGORY=NAME, such as drawer=any box=out/train/box-full, or a folder with one
    for each category. By default those that come with the package, by their names."""
    picture: Path | None = None
    """Of an image of several objects: write the image with boxes and joint axes drawn over it here, as PNG."""
    apart: bool = False
    """Of an image of several objects: move those whose boxes overlap apart, by 3 cm at most, as a simulator needs them.
    It makes estimates less exact."""
    skip_bad: bool = False
    """Leave out detections that cannot be used, and list them, instead of refusing the file."""
    seen_from: tuple[float, float] | None = None
    """Azimuths that the camera is known to be within, degrees about the object's vertical, 0 for its front: -75 75 for
    a robot that stands before a cabinet. It is not below the object then. By default it may be anywhere."""
    method: StoredMethod = "full"
    """Method of the estimator: full, which comes with the package; artperl, the paper's, with weights for laptop,
    eyeglasses, dishwasher, scissors and drawer; or a baseline that you trained."""
    workers: int = 1
    """Processes, each of which takes a core. Lines are the same, in the same order, whatever their number."""
    ray: str | None = None
    """Instead of processes here, those of a Ray cluster: auto for the one that this machine belongs to, local to start
    one here, or HOST:PORT of its head. Every node must see the files, under the same names. Extra: ray."""

    def run(self) -> None:
        from artperl.commands.estimate_scene import estimate_scene, is_image_pair
        from artperl.estimator import load_estimator

        inputs = (*self.clouds, self.intrinsics, self.mask, self.detections)
        for path in (self.out, self.view, self.picture):
            if path not in (None, STDOUT):
                check_output(path, inputs)
        if self.detections is not None or self.detector is not None or is_image_pair(self.clouds):
            estimate_scene(self)
            return
        if self.picture is not None or self.estimators or self.skip_bad or self.apart:
            raise ConfigError(
                "these are of an image of several objects", "picture, estimators, skip_bad, apart",
                "name the image in colour, then the depth image, and add --intrinsics camera.json",
            )  # fmt: skip
        several = len(self.clouds) != 1 or self.clouds[0].is_dir() or self.clouds[0].suffix == ".tar"
        self._check(several)
        told: dict[str, Any] = {} if self.seen_from is None else {"seen_from": self.seen_from}
        load = partial(load_estimator, estimator_folder(self.category).absolute(), method=self.method, **told)
        if several:
            self._estimate_all(load)
        else:
            self._estimate_one(self.clouds[0], load())

    def _check(self, several: bool) -> None:
        kinds = (".jsonl",) if several else (".json", ".npz")
        if self.out is not None and self.out != STDOUT and self.out.suffix not in kinds:
            raise ConfigError(
                f"{self.out} is no {' or '.join(kinds)} file", "out",
                f"name one for {'several files' if several else 'one file'}, or - for JSON",
            )  # fmt: skip
        if not several and (self.workers != 1 or self.ray is not None):
            raise ConfigError("one cloud takes one process", "workers, ray", "leave them out")
        if self.workers != 1 and self.ray is not None:
            raise ConfigError("a cluster has its own processes", "workers, ray", "leave one of them out")
        if several and self.view is not None:
            raise ConfigError("a page shows one object", "view", "give one file, or leave it out")

    def input_options(self) -> InputOptions:
        """How the files are to be read."""
        from artperl.inputs import InputOptions

        return InputOptions(
            unit=self.unit, camera=self.camera, intrinsics=self.intrinsics, mask=self.mask, mask_id=self.mask_id,
            mask_kind=self.mask_kind, depth_scale=self.depth_scale, depth_kind=self.depth_kind,
            pixel_center=self.pixel_center, image_id=self.image_id,
        )  # fmt: skip

    def _estimate_one(self, file: Path, estimator: Method) -> None:
        from artperl.inputs import read_cloud
        from artperl.viewer import page

        cloud = read_cloud(file, self.input_options())
        for text in cloud.notes:
            print(f"note: {text}", file=sys.stderr)
        result = estimator(cloud.points)
        record = record_of(result, cloud)
        if self.view is not None:
            write_output(self.view, page(result, cloud.points, f"{file.name}: {self.category}").encode())
        if self.out == STDOUT:
            _warn(record["warnings"])
            print(json.dumps(record, indent=1))
            return
        _warn(cloud.warnings)
        print(result)
        if self.out is not None and self.out.suffix == ".npz":
            with output_file(self.out) as out:
                np.savez(out, allow_pickle=False, **arrays_of(result, cloud))
        elif self.out is not None:
            write_output(self.out, (json.dumps(record, indent=1) + "\n").encode())

    def _estimate_all(self, load: Callable[[], Method]) -> None:
        """A line of JSON for each cloud, written as soon as it is known, so that Ctrl-C loses nothing."""
        from artperl.commands.estimate_many import Clouds, Estimating
        from artperl.commands.on_ray import each_on_ray
        from artperl.commands.resumed_lines import Lines
        from artperl.core.processes import each

        options = self.input_options()
        clouds = Clouds.of(self.clouds, options, (self.intrinsics, self.mask, self.out))
        setup = {"estimator": self.category, "seen_from": self.seen_from, **vars(options)}
        with Lines(None if self.out in (None, STDOUT) else self.out, setup) as lines:
            failed, done, total = 0, lines.done(), len(clouds)
            if done:
                print(f"note: {len(done)} lines are in {self.out} already", file=sys.stderr)
            asked, told = tee(entry for entry in clouds if line_name(entry.file, entry.sample) not in done)
            if self.ray is None:
                records = each(Estimating(load, options), asked, self.workers)
            else:  # processes of nodes run in folders of their own
                there = (replace(entry, file=entry.file.absolute()) for entry in asked)
                records = each_on_ray(Estimating(load, options.absolute()), there, self.ray)
            with closing(records), track("estimate", total=total, initial=len(done), unit="cloud") as progress:
                for entry, record in zip(told, records, strict=True):
                    failed += "error" in record
                    lines.write(entry.file, record, entry.sample)
                    progress.update()
        if failed:
            kind = "clouds" if clouds.shards else "files"
            print(f"error: {failed} of {total} {kind} failed; each line with an 'error' says why", file=sys.stderr)
            sys.exit(1)


def estimator_folder(name: str) -> Path:
    """Folder of an estimator: one of the package's by its name, a folder of one, or that of a training run.

    Raises
    ------
    ConfigError
        When there is none.
    """
    from artperl.estimator import WEIGHTS, folder_of

    settings = "estimator.json"
    for folder in (folder_of(name), Path(name) / "best"):
        if (folder / settings).is_file():
            return folder
    shipped = ", ".join(sorted(path.parent.name for path in WEIGHTS.glob(f"*/{settings}")))
    what = "holds no estimator" if Path(name).is_dir() else "is no estimator"
    raise ConfigError(
        f"{name!r} {what}",
        "category",
        f"use one that comes with the package ({shipped}), or a folder that train.py wrote",
    )


def _warn(texts: Iterable[str]) -> None:
    for text in texts:
        print(f"warning: {text}", file=sys.stderr)
