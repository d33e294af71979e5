"""Folders in ReArtMix's layout, read as images with the true poses of all parts.

``annotations/**/<name>.json`` holds ``width``, ``height``, ``color_path``, ``depth_path`` and ``instances``, each with
``category_id`` (1 box, 2 stapler, 3 cutter, 4 drawer, 5 scissor), ``urdf_id``, ``bbox`` and ``links``. A link has a
4 x 4 ``transformation`` from the object's frame, as carried by the part, to the camera, which may hold a scale, and a
``segmentation`` in polygons. ``color/<color_path>`` and ``depth/<depth_path>`` (whole millimetres) are images.
``camera_intrinsic.json`` is Open3D's, for all images or in the folder of a scene. ``urdf_metas.json`` lists boxes of
parts (``corner_pts``: least and largest corner of the whole object, then of each part, in the order of the links).

The object's frame has the axes y, z, x of its URDF file, which is taken to stand as ours do: Z up, front towards -X.
Only the layout is known here, not the images: no figure of ours is on them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from artperl.evaluation.average_precision import PosedObject
from artperl.inputs.depth_images import read_depth
from artperl.inputs.detections import ALIASES, Detection, Detections
from artperl.inputs.images import read_picture
from artperl.inputs.intrinsics import read_intrinsics
from artsim.common.files import read_json
from artsim.common.json_records import Pixels, as_type
from artsim.errors import DatasetError

Array = NDArray[np.float64]

NAMES = {1: "box", 2: "stapler", 3: "cutter", 4: "drawer", 5: "scissor"}
_METAS, _ANNOTATIONS, _CAMERA = "urdf_metas.json", "annotations", "camera_intrinsic.json"
_FROM_URDF = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Takes a point of the URDF file to the frame of the annotations: y, z, x."""
_MOST = 100_000
_FIX = "restore the folder; docs/artperl.md describes its layout"
_SHEAR = 1e-3
"""Of a transformation without its scale from the nearest rotation."""


def is_reartmix(folder: Path) -> bool:
    """Whether a folder has this layout."""
    return (folder / _METAS).is_file() and (folder / _ANNOTATIONS).is_dir()


@dataclass(frozen=True, eq=False)
class AnnotatedImage:
    """An image of the folder: its depth in metres, its camera, its true objects, its colours where known."""

    key: str
    depth: NDArray[Any]
    K: Array
    objects: tuple[PosedObject, ...]
    rgb: NDArray[np.uint8] | None = None


class ReArtMixFolder:
    """Images of a folder.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    DatasetError
        When a file is missing or damaged.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self.files = sorted((folder / _ANNOTATIONS).rglob("*.json"))
        if not self.files:
            raise DatasetError("there is no annotation", folder / _ANNOTATIONS, _FIX)
        self._boxes = _boxes(folder / _METAS)
        self.keys = [path.relative_to(folder / _ANNOTATIONS).with_suffix("").as_posix() for path in self.files]
        self.sizes: dict[int | str, tuple[int, int]] = {
            key: _size(_document(path), path) for key, path in zip(self.keys, self.files, strict=True)
        }

    def __len__(self) -> int:
        return len(self.files)

    def __iter__(self) -> Iterator[tuple[str, AnnotatedImage]]:
        for key, path in zip(self.keys, self.files, strict=True):
            yield key, self._image(key, path)

    def names(self) -> dict[int, str]:
        """Categories by their numbers."""
        return NAMES

    def own_detections(self, seed: int) -> Detections:
        """The boxes of the annotations, since these folders come without masks of whole objects."""
        found = []
        for key, path in zip(self.keys, self.files, strict=True):
            for own in _instances(_document(path), path):
                left, top, right, bottom = (float(v) for v in own["bbox"])
                category = ALIASES.get(NAMES[own["category_id"]], NAMES[own["category_id"]])
                parts = [link["segmentation"] for link in own["links"] if link.get("segmentation")]
                outline = [polygon for polygons in parts for polygon in polygons] or None
                box = (left, top, right - left, bottom - top)
                found.append(Detection(key, category, 1.0, outline, box, self.sizes[key]))
        return Detections(
            tuple(found), notes=("detections are the annotated objects themselves: give --detections FILE",)
        )

    def _image(self, key: str, path: Path) -> AnnotatedImage:
        document = _document(path)
        depth_file = _inside(self.folder / "depth", document.get("depth_path"), path)
        image = read_depth(depth_file)
        width, height = _size(document, path)
        if image.values.shape != (height, width):
            raise DatasetError(f"is no image of {width} x {height}", depth_file, _FIX)
        places = [self.folder / "camera_intrinsic" / key.split("/")[0], path.parent, self.folder]
        camera = next((p / _CAMERA for p in places if (p / _CAMERA).is_file()), self.folder / _CAMERA)
        objects = tuple(self._object(key, own, path) for own in _instances(document, path))
        depth = image.values * (0.001 if image.whole else 1.0)
        return AnnotatedImage(key, depth, read_intrinsics(camera), objects, self._colour(document, path))

    def _colour(self, document: dict[str, Any], path: Path) -> NDArray[np.uint8] | None:
        """(H, W, 3) colours; None where the folder comes without any."""
        folder = self.folder / "color"
        if not folder.is_dir():
            return None
        file = _inside(folder, document.get("color_path"), path)
        values = read_picture(file, "colour image").values
        width, height = _size(document, path)
        if values.dtype != np.uint8 or values.ndim != 3 or values.shape[:2] != (height, width) or values.shape[2] < 3:
            raise DatasetError(f"is no image in colour of {width} x {height}", file, _FIX)
        return np.ascontiguousarray(values[..., :3])

    def _object(self, key: str, own: dict[str, Any], path: Path) -> PosedObject:
        boxes = self._boxes.get(own["urdf_id"])
        links = own["links"]
        if boxes is None or len(boxes) < len(links):
            raise DatasetError(f"{_METAS} has no boxes of the parts of object {own['urdf_id']!r:.40}", path, _FIX)
        rotation, center, size = [], [], []
        for link, (low, high) in zip(links, boxes, strict=False):
            T = np.array(link["transformation"], dtype=np.float64)
            scale, R = _similarity(T, path)
            rotation.append(R @ _FROM_URDF)
            center.append(T[:3, :3] @ (0.5 * (low + high)) + T[:3, 3])
            size.append(scale * _FROM_URDF.T @ (high - low))  # the same box, its sides named by our axes
        category = NAMES[own["category_id"]]
        return PosedObject(key, ALIASES.get(category, category), np.array(rotation), np.array(center), np.array(size))


def _document(path: Path) -> dict[str, Any]:
    document = read_json(path, "annotation", DatasetError)
    if not isinstance(document, dict):
        raise DatasetError("is no annotation", path, _FIX)
    return document


def _size(document: dict[str, Any], path: Path) -> tuple[int, int]:
    try:
        width, height = (as_type(Pixels, document.get(name), name) for name in ("width", "height"))
    except ValueError as error:
        raise DatasetError(f"is damaged ({error})", path, _FIX) from error
    return width, height


def _instances(document: dict[str, Any], path: Path) -> list[dict[str, Any]]:
    """The objects of an annotation, each with what is needed of it."""
    try:
        instances = as_type(Annotated[list, range(1001)], document.get("instances"), "instances")
        for own in instances:
            as_type(Annotated[int, range(1, len(NAMES) + 1)], own["category_id"], "category_id")
            as_type(tuple[float, float, float, float], own["bbox"], "bbox")
            for link in as_type(Annotated[list, range(101)], own["links"], "links"):
                as_type(Annotated[int, range(101)], link["link_category_id"], "link_category_id")
                if np.shape(link["transformation"]) != (4, 4) or not np.isfinite(link["transformation"]).all():
                    raise ValueError("a transformation is no 4 x 4 matrix")
            if not own["links"]:
                raise ValueError("an instance has no links")
            own["urdf_id"]
    except (ValueError, KeyError, TypeError) as error:
        raise DatasetError(f"is damaged ({type(error).__name__}: {error})", path, _FIX) from error
    return instances


def _boxes(path: Path) -> dict[Any, list[tuple[Array, Array]]]:
    """Least and largest corner of each part of each object, by its number."""
    document = read_json(path, _METAS, DatasetError)
    try:
        found = {}
        for meta in as_type(Annotated[list, range(_MOST + 1)], document["urdf_metas"], "urdf_metas"):
            if meta:  # numbers that no object has are empty
                corners = np.array(meta["corner_pts"], dtype=np.float64)
                if corners.ndim < 3 or corners[0].size != 6 or not np.isfinite(corners).all():
                    raise ValueError(f"corner_pts of object {meta['id']!r:.40} are no corners of parts")
                found[meta["id"]] = [(low, high) for low, high in corners.reshape(-1, 2, 3)[1:]]
    except (ValueError, KeyError, TypeError) as error:
        raise DatasetError(f"is damaged ({type(error).__name__}: {error})", path, _FIX) from error
    return found


def _similarity(T: Array, path: Path) -> tuple[float, Array]:
    """Scale and rotation of a transformation."""
    scale = float(np.cbrt(np.linalg.det(T[:3, :3])))
    if scale <= 0:
        raise DatasetError("a transformation turns its object inside out", path, _FIX)
    U, _, V = np.linalg.svd(T[:3, :3] / scale)
    if np.abs(U @ V - T[:3, :3] / scale).max() > _SHEAR:
        raise DatasetError("a transformation is no rotation, scale and translation", path, _FIX)
    return scale, U @ V


def _inside(folder: Path, name: object, path: Path) -> Path:
    """A file of the folder by its name in an annotation."""
    if not isinstance(name, str) or not (folder / name).resolve().is_relative_to(folder.resolve()):
        raise DatasetError(f"names a file outside of its folder ({name!r:.60})", path, _FIX)
    return folder / name
