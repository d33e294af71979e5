"""Files of the original ArtImage, one by one: joints of URDF files, lists, numbers and pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.images import read_picture
from artsim.common.files import parse_json, read_bounded
from artsim.errors import DatasetError
from artsim.loading.urdf_xml import safe_xml
from artsim.model.kinematics import Array

FIX = "restore the file, or leave the object out of the lists of the split"
_MAX_BYTES = 32_000_000


@dataclass(frozen=True, eq=False)
class FileJoint:
    """A joint that moves, by the numbers of its links, in ArtImage's axes."""

    child: int
    parent: int
    kind: str
    axis: Array
    origin: Array
    limits: Array


def read_joints(path: Path, root: Path) -> list[FileJoint]:
    """Joints of a URDF file that move, in ArtImage's axes: (x, y, z) of the file is (y, z, x)."""
    found = []
    for element in safe_xml(read_bounded(path, _MAX_BYTES, "the URDF file", DatasetError, inside=root), path).iter(
        "joint"
    ):
        kind = str(element.get("type"))
        if kind in ("fixed", "0"):
            continue
        try:
            parent = element.find("parent").get("link")
            axis = _vector(element.find("axis").get("xyz"))
            at = element.find("origin")
            origin = np.zeros(3) if at is None else _vector(at.get("xyz", "0 0 0"))
            limit = element.find("limit")
            limits = [-np.pi, np.pi] if limit is None else [float(limit.get("lower", 0)), float(limit.get("upper", 0))]
            child = int(str(element.get("name")).split("_")[-1])
            above = int(parent) if str(parent).isdigit() else 0
            length = float(np.linalg.norm(axis))
            if kind not in ("revolute", "continuous", "prismatic") or length < 1e-9:
                raise ValueError(f"a joint of type {kind!r:.20} with axis {axis}")
        except (AttributeError, TypeError, ValueError) as error:
            raise DatasetError(f"a joint is not as ArtImage has them ({error!r:.80})", path, FIX) from error
        kind = "revolute" if kind == "continuous" else kind
        found.append(FileJoint(child, above, kind, np.roll(axis, -1) / length, np.roll(origin, -1), np.array(limits)))
    return found


def read_base_joint(path: Path, root: Path) -> tuple[Array, Array]:
    """(3,) angles and (3,) place of the first joint of a URDF file, which holds the root."""
    document = safe_xml(read_bounded(path, _MAX_BYTES, "the URDF file", DatasetError, inside=root), path)
    for element in document.iter("joint"):
        if str(element.get("name")).split("_")[-1] == "0":
            at = element.find("origin")
            if at is None:
                return np.zeros(3), np.zeros(3)
            return _vector(at.get("rpy", "0 0 0")), _vector(at.get("xyz", "0 0 0"))
    raise DatasetError("it has no joint of link 0", path, FIX)


def _vector(text: Any) -> Array:
    values = np.array([float(word) for word in str(text).split()])
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"{text!r:.40} is no vector")
    return values


def require_file(path: Path) -> None:
    """Refuse a folder that lacks a file.

    Raises
    ------
    DatasetError
    """
    if not path.is_file():
        raise DatasetError("this file of ArtImage is missing", path, "name the folder that has it with --root")


def read_json_file(path: Path, root: Path) -> Any:
    """Value of a JSON file within the root."""
    require_file(path)
    try:
        return parse_json(read_bounded(path, _MAX_BYTES, "the annotation", DatasetError, inside=root))
    except ValueError as error:
        raise DatasetError(f"it is damaged ({error})", path, FIX) from error


def read_lines(path: Path) -> list[str]:
    """Lines of a text file that are not empty."""
    require_file(path)
    text = read_bounded(path, _MAX_BYTES, "the list", DatasetError).decode("utf-8", errors="replace")
    return [line.strip() for line in text.splitlines() if line.strip()]


def read_points(path: Path, root: Path) -> Array:
    """(n, 3) points of a text file."""
    require_file(path)
    text = read_bounded(path, _MAX_BYTES, "the points", DatasetError, inside=root).decode("ascii", errors="replace")
    try:
        values = np.array([[float(word) for word in line.split()[:3]] for line in text.splitlines() if line.strip()])
        if values.ndim != 2 or values.shape[1] != 3 or not np.isfinite(values).all():
            raise ValueError("it has no rows of three numbers")
    except ValueError as error:
        raise DatasetError(f"it is no list of points ({error})", path, FIX) from error
    return values


def read_values(path: Path, root: Path, what: str) -> NDArray[Any]:
    """Values of a picture within the root."""
    require_file(path)
    if not path.resolve().is_relative_to(root.resolve()):
        raise DatasetError(f"its {what} lies outside the folder", path, FIX)
    return read_picture(path, what).values
