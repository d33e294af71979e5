"""BOP, scene by scene: each part of each object is a model of its own, in millimetres.

A scene is a folder of images that need not show the same objects. The frame of a model is the rest frame of its
object, so that poses of parts are comparable, and joint axes hold in every pose through the parent.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from artsim.common.palette import PALETTE
from artsim.datasets.dataset import Dataset
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import ConfigError
from artsim.formats.base import Format, Piece, require_images
from artsim.formats.images import depth_png, integer_centre_K, mask_box, mask_png, png_bytes
from artsim.model.camera import Camera
from artsim.model.draws import sample_scale
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.ply import mesh_ply
from artsim.model.transforms import invert_transform, transform_points
from artsim.observing.sample import Sample
from artsim.renderers.raycast import pose, render_posed
from artsim.runs.tasks import Output

_MM = 1000.0
_TARGET_VISIBLE = 0.1
"""BOP asks for estimates of objects of which at least a tenth is visible."""


class BopFormat(Format):
    """``models/``, ``<split>/<scene>/`` and ``camera.json``."""

    converts_objects = True

    def check(self, options: SampleOptions, folder: Path) -> None:
        """There must be depth and masks, and each object must have one size."""
        require_images(options, folder, "bop", ("depth", "part_mask"))
        if not isinstance(options.scale, str):
            raise ConfigError(
                "a model in BOP has one size, and the objects of the dataset change theirs",
                folder,
                "generate it into another folder with --scale native or --scale unit",
            )

    def write_objects(self, dataset: Dataset, piece: Piece, output: Output) -> Any:
        """Write the models of some objects; the answer is their share of ``models_info.json``."""
        first, info = _first_ids(dataset), {}
        for number in piece.members:
            planned = dataset.plan.objects[number]
            size = dataset.plan.sample.scale
            obj = sample_scale(dataset.objects[planned.file], size, np.random.default_rng(0))
            for k in np.flatnonzero(obj.has_surface).tolist():
                model = first[planned.key] + k
                output.write(*model_file(obj, k, model))
                info[str(model)] = model_info(obj, k)
        return info

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one scene; the answer is its first camera, and the targets in it."""
        scene, first = BopScene(output, piece.split, piece.number), _first_ids(dataset)
        for image, sample in enumerate(samples):
            assert sample.depth is not None
            obj, first_id = dataset.object_of(sample), first[dataset.planned(sample.index).key]
            (told,) = scene.write_image(image, sample.depth, sample.rgb, [(obj, sample, first_id, None)])
            scene.articulations[str(image)] = told
        return scene.finish()

    def finish(self, dataset: Dataset, answers: Sequence[tuple[Piece, Any]], output: Output) -> None:
        """Write ``models_info.json``, ``camera.json``, and the targets of the test split."""
        models: dict[str, Any] = {}
        for piece, answer in answers:
            if not piece.split:
                models |= answer
        output.write("models/models_info.json", json_bytes(models))
        scenes = [(piece, answer) for piece, answer in answers if piece.split]
        if scenes:
            output.write("camera.json", json_bytes(scenes[0][1]["camera"]))
        targets = [target for piece, answer in scenes if piece.split == "test" for target in answer["targets"]]
        if targets:
            output.write("test_targets_bop19.json", json_bytes(targets))


class BopScene:
    """A scene, written image by image.

    Attributes
    ----------
    articulations : dict
        Of the objects in each image, by its number.
    """

    def __init__(self, output: Output, split: str, number: int):
        self.output, self.number, self.folder = output, number, f"{split}/{number:06d}"
        self.articulations, self._targets = dict[str, Any](), list[dict[str, int]]()
        self._cameras, self._truths, self._infos = dict[str, Any](), dict[str, Any](), dict[str, Any]()
        self._camera: dict[str, Any] | None = None

    def write_image(
        self, image: int, depth: NDArray[np.float32], rgb: NDArray[np.uint8] | None,
        seen: Iterable[tuple[ArticulatedObject, Sample, int, Array | None]],
    ) -> list[dict[str, Any]]:  # fmt: skip
        """Write an image and the masks in it; the articulation of each object that is seen.

        Parameters
        ----------
        image : int
        depth : (H, W) float32
        rgb : (H, W, 3) uint8, optional
        seen : iterable of (object, sample, model number of its first part, T_world_object)
        """
        data, unit = depth_png(depth)
        self.output.write(f"{self.folder}/depth/{image:06d}.png", data)
        if rgb is not None:
            self.output.write(f"{self.folder}/rgb/{image:06d}.png", png_bytes(rgb))
        truths, infos, told = list[Any](), list[Any](), list[dict[str, Any]]()
        for obj, sample, first, T_world_object in seen:
            sample = replace(sample, depth=depth)
            whole = whole_masks(obj, sample, T_world_object)
            assert sample.part_mask is not None
            for k in np.flatnonzero(obj.has_surface).tolist():
                name = f"{image:06d}_{len(truths):06d}.png"
                self.output.write(f"{self.folder}/mask/{name}", mask_png(whole[k]))
                self.output.write(f"{self.folder}/mask_visib/{name}", mask_png(sample.part_mask == k))
                truths.append({**model_pose(sample.T_camera_part[k]), "obj_id": first + k})
                infos.append(truth_info(obj, sample, k, whole[k]))
                if infos[-1]["visib_fract"] >= _TARGET_VISIBLE:
                    target = {"im_id": image, "inst_count": 1, "obj_id": first + k, "scene_id": self.number}
                    self._targets.append(target)
            told.append(articulation(obj, sample, first))
            self._cameras[str(image)] = camera_record(sample, unit)
            self._camera = self._camera or shared_camera(sample, unit)
        self._truths[str(image)], self._infos[str(image)] = truths, infos
        return told

    def finish(self) -> dict[str, Any]:
        """Write what is said of the images; the first camera, and the targets."""
        for name, content in (
            ("camera", self._cameras), ("gt", self._truths), ("gt_info", self._infos),
            ("articulation", self.articulations),
        ):  # fmt: skip
            self.output.write(f"{self.folder}/scene_{name}.json", json_bytes(content))
        return {"camera": self._camera, "targets": self._targets}


def _first_ids(dataset: Dataset) -> dict[str, int]:
    """Model number of the first part of each object, by the object's key; the first of all is 1."""
    following = accumulate((planned.num_parts for planned in dataset.plan.objects), initial=1)
    return {planned.key: first for planned, first in zip(dataset.plan.objects, following, strict=False)}


def model_file(obj: ArticulatedObject, k: int, model: int) -> tuple[str, bytes]:
    """Name and content of the mesh of part k, as a model of a number; millimetres, rest frame."""
    vertices = obj.parts[k].vertices * (obj.scale * _MM)
    return f"models/obj_{model:06d}.ply", mesh_ply(vertices, obj.parts[k].faces, PALETTE[k % len(PALETTE)])


def model_info(obj: ArticulatedObject, k: int) -> dict[str, Any]:
    """What ``models_info.json`` says of part k."""
    vertices = obj.parts[k].vertices * (obj.scale * _MM)
    low, extent = (obj.box_center[k] - obj.box_size[k] / 2) * _MM, obj.box_size[k] * _MM
    entry: dict[str, Any] = {"diameter": _diameter(vertices[np.unique(obj.parts[k].faces)])}
    entry |= {f"min_{axis}": low[i] for i, axis in enumerate("xyz")}
    entry |= {f"size_{axis}": extent[i] for i, axis in enumerate("xyz")}
    return {**entry, "category": obj.category, "object_id": obj.object_id, "part": k, "name": obj.parts[k].label}


def json_bytes(content: Any) -> bytes:
    """Readable JSON; numbers of NumPy are written as numbers, infinite ones as null."""
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2)


def _diameter(points: Array) -> float:
    """Largest distance between two of (N, 3) points."""
    from scipy.spatial import ConvexHull, QhullError
    from scipy.spatial.distance import cdist

    try:
        points = points[ConvexHull(points).vertices]
    except QhullError:  # flat: all points it is
        points = np.unique(points, axis=0)
    step = 1000  # rows of distances at once
    return max(float(cdist(points[i : i + step], points).max()) for i in range(0, len(points), step))


def model_pose(T_camera_part: Array) -> dict[str, Any]:
    """Pose of a model in the camera frame, millimetres."""
    return {"cam_R_m2c": T_camera_part[:3, :3].ravel().tolist(), "cam_t_m2c": (T_camera_part[:3, 3] * _MM).tolist()}


def camera_record(sample: Sample, unit: float) -> dict[str, Any]:
    """Intrinsics, pose in the world, and millimetres that 1 stands for in the depth image."""
    T_camera_world = invert_transform(sample.T_world_camera)
    return {
        "cam_K": integer_centre_K(sample.K).ravel().tolist(),
        "depth_scale": _depth_scale(unit),
        "cam_R_w2c": T_camera_world[:3, :3].ravel().tolist(),
        "cam_t_w2c": (T_camera_world[:3, 3] * _MM).tolist(),
    }


def shared_camera(sample: Sample, unit: float) -> dict[str, Any]:
    """What ``camera.json`` says; scenes have the camera of each image."""
    K = integer_centre_K(sample.K)
    focal = {"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
    size = {"width": sample.width, "height": sample.height, "depth_scale": _depth_scale(unit)}
    return {**{name: float(value) for name, value in focal.items()}, **size}


def _depth_scale(unit: float) -> float:
    """Millimetres in a unit of so many metres, a power of ten, without the error of a product."""
    return float(f"1e{round(float(np.log10(unit))) + 3}")


def whole_masks(obj: ArticulatedObject, sample: Sample, T_world_object: Array | None = None) -> list[NDArray[np.bool_]]:
    """(H, W) mask of each part as if nothing hid it."""
    camera = Camera(sample.K, sample.width, sample.height, sample.T_world_camera)
    posed = pose(obj, sample.joint_state, camera, T_world_object)
    assert sample.part_mask is not None
    # A rasteriser may cover a pixel more than rays do at an outline: what is seen belongs to the whole.
    return [(render_posed(posed, only=k).part_ids == k) | (sample.part_mask == k) for k in range(len(obj))]


def truth_info(obj: ArticulatedObject, sample: Sample, k: int, whole: NDArray[np.bool_]) -> dict[str, Any]:
    """Boxes, pixel counts and visible fraction of part k, whose mask is ``whole`` where nothing hides it."""
    assert sample.depth is not None
    assert sample.part_mask is not None
    seen = sample.part_mask == k
    count_all, count_seen = int(whole.sum()), int(seen.sum())
    return {
        "bbox_obj": _outline_box(obj, sample, k),
        "bbox_visib": _sides(*(mask_box(seen) or (0, 0, 0, 0))),
        "px_count_all": count_all,
        "px_count_valid": int((whole & (sample.depth > 0)).sum()),
        "px_count_visib": count_seen,
        "visib_fract": count_seen / count_all if count_all else 0.0,
    }


def _sides(left: int, top: int, right: int, bottom: int) -> list[int]:
    """Left, top, width and height; -1 for an empty box, as BOP has it."""
    return [left, top, right - left, bottom - top] if right > left and bottom > top else [-1, -1, -1, -1]


def _outline_box(obj: ArticulatedObject, sample: Sample, k: int) -> list[int]:
    """Box of the pixels that the whole part covers, within the image or not."""
    part = obj.parts[k]
    camera = Camera(sample.K, sample.width, sample.height, sample.T_world_camera)
    corners = transform_points(sample.T_camera_part[k], part.vertices[np.unique(part.faces)] * obj.scale)
    if (corners[:, 2] <= 0).any():  # it reaches behind the camera, and has no outline
        return [-1, -1, -1, -1]
    image = camera.project(corners) - 0.5  # pixel centres, which rays pass through, at whole numbers
    left, top = np.ceil(image.min(axis=0)).astype(int).tolist()
    right, bottom = np.floor(image.max(axis=0)).astype(int).tolist()
    return _sides(left, top, right + 1, bottom + 1)  # empty where it passes between the centres


def articulation(obj: ArticulatedObject, sample: Sample, first_id: int) -> dict[str, Any]:
    """Joints of an object, whose axes and origins are in the frame of the models; lengths in millimetres."""
    parts = []
    for k, kind in enumerate(sample.joint_type):
        unit = _MM if kind == "prismatic" else 1.0
        joint = obj.tree.joints[k]
        more = {"pitch": joint.pitch * _MM} if kind == "screw" else {}
        parts.append(
            {
                **more,
                "obj_id": first_id + k if obj.has_surface[k] else None,
                "name": sample.part_names[k],
                "parent": int(sample.joint_parent[k]),
                "joint_type": kind,
                "axis": sample.joint_axis[k],
                "origin": sample.joint_origin[k] * _MM,
                "axis_camera": sample.joint_axis_camera[k],
                "origin_camera": sample.joint_origin_camera[k] * _MM,
                "state": float(sample.joint_state[k] * unit),
                "rest": float(sample.joint_rest[k] * unit),
                "limits": sample.joint_limits[k] * unit,
            }
        )
    identity = {"category": sample.category, "object_id": sample.object_id, "index": sample.index}
    return {**identity, "scale": sample.scale, "parts": parts}
