"""Files of shape bases: ``.npz`` without pickle, checked as they are read."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.shapes import Shapes
from artperl.core.trees import Trees
from artperl.retrieval.shape_base import ShapeBase
from artsim.common.array_files import read_npz
from artsim.common.files import atomic_file, parse_json
from artsim.errors import DatasetError, KinematicsError
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import MAX_PARTS

_FORMAT = 2
_CLOUDS = ("box_center", "box_size", "points", "normals", "spacing", "diagonal")
_MAX_PAIRS = 30_000_000
"""Bytes of the pairs of parts of all objects, of which one carries the other: 460 objects of 254 parts."""
_LARGEST = 1e6
"""Objects have a diagonal of 1, and a half-precision number reaches 65504."""


def write_shape_base(base: ShapeBase, path: str | Path) -> None:
    """Write a base into one ``.npz`` file, without pickle."""
    description = {
        "format": _FORMAT,
        "object_ids": base.object_ids,
        "categories": base.categories,
        "trees": [tree.to_dict() for tree in base.trees],
    }
    arrays = {name: getattr(base.shapes, name).cpu().numpy() for name in _CLOUDS}
    # To 0.02 % of a diagonal and 0.4 deg: small files, and surfaces are not known any better.
    arrays["points"] = arrays["points"].astype(np.float16)
    arrays["normals"] = np.rint(127.0 * arrays["normals"]).astype(np.int8)
    if base.embeddings is not None:
        arrays["embeddings"] = base.embeddings.cpu().numpy()
    text = np.frombuffer(json.dumps(description).encode(), dtype=np.uint8)
    with atomic_file(Path(path)) as file:
        np.savez_compressed(file, description=text, **arrays)


def read_shape_base(path: str | Path) -> ShapeBase:
    """Read a file that :func:`write_shape_base` wrote.

    Raises
    ------
    DatasetError
        When it is missing, damaged or of another format.
    """
    arrays = read_npz(Path(path), "shape base", DatasetError)
    try:
        return _parse(arrays)
    except (ValueError, KinematicsError) as error:
        reason = error.what if isinstance(error, KinematicsError) else error
        raise DatasetError(f"no shape base can be read ({reason})", path, "build it again") from error


def _parse(arrays: Mapping[str, NDArray[Any]]) -> ShapeBase:
    """The base that the arrays of a file describe; a ValueError or KinematicsError says why there is none."""
    lacking = {"description", *_CLOUDS} - arrays.keys()
    if lacking:
        raise ValueError(f"it lacks {', '.join(sorted(lacking))}")
    description = parse_json(arrays["description"].tobytes())
    if not isinstance(description, dict):
        raise ValueError("its description is not a set of named values")
    if description.get("format") != _FORMAT:
        raise ValueError(f"its format is {description.get('format')!r:.20}, not {_FORMAT}")
    ids, categories, trees = (description.get(name) for name in ("object_ids", "categories", "trees"))
    if not (isinstance(ids, list) and isinstance(categories, list) and isinstance(trees, list)):
        raise ValueError("its objects are no lists")
    if not len(ids) == len(categories) == len(trees) > 0 or not all(isinstance(n, str) for n in [*ids, *categories]):
        raise ValueError("its lists of objects do not fit each other")
    tensors = _clouds(arrays, len(ids))
    num_rows = tensors["box_size"].shape[1]
    if num_rows > MAX_PARTS or len(ids) * num_rows**2 > _MAX_PAIRS:
        raise ValueError(f"{len(ids)} objects of {num_rows} parts are too many")
    known = tuple(KinematicTree.from_dict(tree) for tree in trees)
    embeddings = arrays.get("embeddings")
    if embeddings is not None:
        embeddings = _check_array(embeddings, (len(ids), None), "embeddings")
    return ShapeBase(
        tuple(ids),
        tuple(categories),
        known,
        Shapes(trees=Trees.stack(known, num_rows, torch.float32), **tensors),
        None if embeddings is None else torch.from_numpy(embeddings),
    )


def _clouds(arrays: Mapping[str, NDArray[Any]], count: int) -> dict[str, Tensor]:
    """Boxes and clouds of the parts of ``count`` objects, checked."""
    points = arrays["points"]
    if points.ndim != 4 or 0 in points.shape:
        raise ValueError(f"its points are of shape {points.shape}")
    B, P, M, _ = points.shape
    shapes = {
        "box_center": (B, P, 3),
        "box_size": (B, P, 3),
        "points": (B, P, M, 3),
        "normals": (B, P, M, 3),
        "spacing": (B, P),
        "diagonal": (B,),
    }
    if count != B:
        raise ValueError(f"it has points of {B} objects, and names {count}")
    if arrays["spacing"].dtype.kind != "f":
        raise ValueError(f"its spacing is {arrays['spacing'].dtype}")
    # Parts without a surface have no spacing: it is infinite.
    unbounded = arrays["spacing"] == np.inf
    finite = dict(arrays) | {"spacing": np.where(unbounded, 1.0, arrays["spacing"])}
    checked = {name: _check_array(finite[name], shape, name) for name, shape in shapes.items()}
    if not (checked["diagonal"] > 0).all() or not (checked["spacing"] >= 0).all() or (checked["box_size"] < 0).any():
        raise ValueError("a length is negative")
    checked["spacing"][unbounded] = np.inf
    tensors = {name: torch.from_numpy(values) for name, values in checked.items()}
    tensors["normals"] = torch.nn.functional.normalize(tensors["normals"], dim=-1)
    return tensors


def _check_array(values: NDArray[Any], shape: tuple[int | None, ...], name: str) -> NDArray[np.float32]:
    """Finite numbers of that shape (None: any length), in single precision."""
    fits = len(shape) == values.ndim and all(want in (None, has) for want, has in zip(shape, values.shape, strict=True))
    if not fits or values.dtype.kind not in "iuf":
        raise ValueError(f"its {name} are {values.dtype} of shape {values.shape}")
    # The least and the largest take no memory; where a value is not a number, they are none, too.
    if values.size and not -_LARGEST <= float(values.min()) <= float(values.max()) <= _LARGEST:
        raise ValueError(f"its {name} are not finite, or out of range")
    return values.astype(np.float32)
