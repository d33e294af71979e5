"""Point clouds of files: which reader a file needs, and which of an array's numbers are coordinates."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import read_npy, read_npz
from artperl.inputs.meshes import read_obj, read_off, read_ply, read_stl
from artperl.inputs.pcd import read_pcd
from artperl.inputs.text import read_text
from artsim.errors import ConfigError

Array = NDArray[np.float64]
Read = tuple[Array, tuple[str, ...]]
"""(N, 3) numbers as they stand in the file, and what was assumed or left out."""

NAMES = ("points", "xyz", "pcd", "point_cloud", "pointcloud", "coord", "coords", "pc", "cloud", "vertices")
"""Of the array in an .npz file that is the cloud, most telling first."""
_MOST_COLUMNS = 64
"""Coordinates, colours, normals, labels: an array with more of them has its points in columns."""
_FIX = "save (N, 3) points as .npy or .ply"


def read_cloud_file(path: Path) -> Read:
    """Points of a file, in the file's unit and axes.

    Parameters
    ----------
    path : Path
        Of one of the types in :data:`READERS`.

    Raises
    ------
    ConfigError
        When it cannot be read, or holds no cloud.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ConfigError(
            f"a file of type '{path.suffix}' is no cloud", path, f"give one of {' '.join(READERS)}; a depth image"
            " (.png, .tif, .pgm) needs --intrinsics camera.json",
        )  # fmt: skip
    points, notes = reader(path)
    if len(points) == 0:
        raise ConfigError("the cloud is empty", path, "give a cloud of the object")
    return points, notes


def points_of_array(array: NDArray[Any], path: Path) -> Read:
    """Coordinates in an array: (N, 3), (N, 4 or more), (H, W, 3 or more), or records with x, y, z.

    Raises
    ------
    ConfigError
        When it holds none.
    """
    if array.dtype.names is not None:
        return _points_of_records(array, path)
    if array.dtype.kind not in "fiu":
        raise ConfigError(f"an array of type {array.dtype} holds no coordinates", path, _FIX)
    notes: list[str] = []
    shape = array.shape
    if array.ndim == 3 and shape[2] >= 3:
        if array.dtype == np.uint8:
            raise ConfigError(f"{shape} bytes are a picture in colour, not a cloud", path, _FIX)
        notes.append(f"an organised cloud of {shape[0]} x {shape[1]} points")
        array = array.reshape(-1, shape[2])
    if array.ndim != 2 or array.shape[1] < 3:
        fix = f"{_FIX}; a depth image needs --intrinsics camera.json" if len(shape) == 2 else _FIX
        raise ConfigError(f"an array of shape {shape} is no cloud", path, fix)
    if array.shape[1] > _MOST_COLUMNS:
        turned = "its points seem to stand in columns: save array.T" if array.shape[0] <= _MOST_COLUMNS else _FIX
        raise ConfigError(
            f"an array of shape {shape} is no cloud", path, f"{turned}; a depth image needs --intrinsics camera.json"
        )
    if array.shape[1] > 3:
        notes.append(f"the first three of {array.shape[1]} columns are x, y, z; the others are not used")
    return array[:, :3].astype(np.float64), tuple(notes)


def _points_of_records(array: NDArray[Any], path: Path) -> Read:
    by_name = {name.lower(): name for name in array.dtype.names or ()}
    if "xyz" in by_name:
        return points_of_array(array[by_name["xyz"]], path)
    if not all(axis in by_name and array.dtype[by_name[axis]].kind in "fiu" for axis in "xyz"):
        raise ConfigError(f"records of {', '.join(by_name)[:200]} have no x, y, z", path, _FIX)
    columns = [array[by_name[axis]].ravel().astype(np.float64) for axis in "xyz"]
    if any(len(column) != len(columns[0]) for column in columns):
        raise ConfigError("x, y and z are of different lengths", path, _FIX)
    others = [name for name in by_name.values() if name.lower() not in ("x", "y", "z")]
    return np.stack(columns, axis=1), ((f"not used: {', '.join(others)[:200]}",) if others else ())


def _read_npy(path: Path) -> Read:
    return points_of_array(read_npy(path, "cloud", _FIX), path)


def _read_npz(path: Path) -> Read:
    def fits(shape: tuple[int, ...], dtype: np.dtype[Any]) -> bool:
        if dtype.names is not None:
            return True
        colours = len(shape) == 3 and dtype == np.uint8
        return dtype.kind in "fiu" and len(shape) in (2, 3) and 3 <= shape[-1] <= _MOST_COLUMNS and not colours

    choice = read_npz(path, "cloud", _FIX, fits)
    name, array = choice.one_of(NAMES)
    points, notes = points_of_array(array, path)
    said = (f"the array '{name}' is the cloud",) if len(choice.fitting) > 1 or name != NAMES[0] else ()
    return points, said + notes


READERS: dict[str, Callable[[Path], Read]] = {
    ".npy": _read_npy, ".npz": _read_npz, ".ply": read_ply, ".pcd": read_pcd,
    ".xyz": read_text, ".txt": read_text, ".csv": read_text, ".pts": read_text, ".asc": read_text,
    ".obj": read_obj, ".stl": read_stl, ".off": read_off,
}  # fmt: skip
"""By the ending of a file's name."""
