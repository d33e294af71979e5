"""Objects compiled into one compact file each, and a bounded cache of them."""

from __future__ import annotations

import io
import json
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np

from artsim.errors import AssetError
from artsim.files import read_npz, write_atomic
from artsim.kinematics import KinematicTree
from artsim.objects import ArticulatedObject, Part, Repair

_CACHE_BYTES = 250_000_000
_COMPILED_FORMAT = 1


def save_object(obj: ArticulatedObject, path: Path) -> None:
    """Write an object as one compact ``.npz`` that :func:`load_object` reads back without the source folder."""
    header = {
        "format": _COMPILED_FORMAT,
        "object_id": obj.object_id,
        "category": obj.category,
        "names": [p.name for p in obj.parts],
        "labels": [p.label for p in obj.parts],
        "tree": obj.native_tree.to_dict(),
        "sha256": obj.sha256,
        "scale": obj.scale,
        "T_base_rest": obj.T_base_rest.tolist(),
        "repairs": [[r.where, r.what] for r in obj.repairs],
        "source_joints": {name: list(v) for name, v in obj.source_joints.items()},
    }
    vertices = np.concatenate([p.vertices for p in obj.parts])
    faces = np.concatenate([p.faces for p in obj.parts])
    buffer = io.BytesIO()
    np.savez(
        buffer,
        header=np.frombuffer(json.dumps(header).encode(), dtype=np.uint8),
        vertices=vertices,
        faces=faces,
        vertex_counts=np.array([len(p.vertices) for p in obj.parts]),
        face_counts=np.array([len(p.faces) for p in obj.parts]),
    )
    write_atomic(path, buffer.getvalue())


def load_object(path: Path) -> ArticulatedObject:
    """Read an object written by :func:`save_object`.

    Raises
    ------
    AssetError
        When the file is missing, damaged or of another format.
    """
    arrays = read_npz(path)
    try:
        header: dict[str, Any] = json.loads(arrays["header"].tobytes())
        if header["format"] != _COMPILED_FORMAT:
            raise AssetError(f"format {header['format']} is not {_COMPILED_FORMAT}", path, "generate it again")
        vertices = np.split(arrays["vertices"], np.cumsum(arrays["vertex_counts"])[:-1])
        faces = np.split(arrays["faces"], np.cumsum(arrays["face_counts"])[:-1])
        parts = tuple(
            Part(name, label, v, f)
            for name, label, v, f in zip(header["names"], header["labels"], vertices, faces, strict=True)
        )
        return ArticulatedObject(
            object_id=header["object_id"],
            category=header["category"],
            parts=parts,
            native_tree=KinematicTree.from_dict(header["tree"]),
            sha256=header["sha256"],
            scale=header["scale"],
            T_base_rest=np.array(header["T_base_rest"]),
            repairs=tuple(Repair(*r) for r in header["repairs"]),
            source=str(path),
            source_joints={name: (int(k), float(m)) for name, (k, m) in header["source_joints"].items()},
        )
    except (KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
        raise AssetError(f"not an artsim object file ({error})", path, "generate it again") from error


class ObjectCache:
    """Compiled objects of a dataset folder, the least recently used dropped once they take too much memory."""

    def __init__(self, folder: Path, max_bytes: int = _CACHE_BYTES):
        self.folder = folder
        self.max_bytes = max_bytes
        self._objects: OrderedDict[str, ArticulatedObject] = OrderedDict()

    def __getitem__(self, key: str) -> ArticulatedObject:
        obj = self._objects.get(key)
        if obj is None:
            obj = self._objects[key] = load_object(self.folder / f"{key}.npz")
            while len(self._objects) > 1 and sum(map(_memory, self._objects.values())) > self.max_bytes:
                self._objects.popitem(last=False)
        self._objects.move_to_end(key)
        return obj


def _memory(obj: ArticulatedObject) -> int:
    """Bytes that an object takes with its acceleration structures (measured: about 180 for each triangle)."""
    return 40_000 + 180 * obj.num_faces
