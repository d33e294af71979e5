"""Objects compiled into one compact file each, and a bounded cache of them."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.array_files import MAX_ARRAY_BYTES, parse_npz
from artsim.common.files import parse_json, read_bounded, write_atomic
from artsim.common.names import printable
from artsim.errors import AssetError, KinematicsError
from artsim.model.details import Detail
from artsim.model.joints import LARGEST
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import MAX_PARTS, ArticulatedObject, Part, Repair

_COMPILED_FORMAT = 1
_AGAIN = "generate it again"


def save_object(obj: ArticulatedObject, path: Path) -> None:
    """Write an object as one compact ``.npz`` that :func:`load_object` reads back without the source folder."""
    write_atomic(path, object_bytes(obj))


def object_bytes(obj: ArticulatedObject) -> bytes:
    """The content of an object's file; always the same for the same object."""
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
        "repairs": [[r.where, r.what] for r in obj.repairs if not r.note],
        "notes": [[r.where, r.what] for r in obj.repairs if r.note],
        "source_joints": {name: list(v) for name, v in obj.source_joints.items()},
    }
    arrays: dict[str, Any] = {}
    if obj.details:
        header["details"] = [[d.label, k, d.T_rest_detail.tolist(), d.size.tolist()]
                             for k, p in enumerate(obj.parts) for d in p.details]  # fmt: skip
        arrays["detail_of_face"] = np.concatenate([p.detail_of_face for p in obj.parts]).astype(np.int16)
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
        **arrays,
    )
    return buffer.getvalue()


def load_object(path: Path) -> ArticulatedObject:
    """Read an object written by :func:`save_object`.

    Raises
    ------
    AssetError
        When the file is missing, damaged or of another format.
    """
    return parse_object(read_bounded(path, MAX_ARRAY_BYTES, "object file", fix=_AGAIN), str(path))


def parse_object(data: bytes, where: str) -> ArticulatedObject:
    """The object of the bytes of a file; ``where`` they come from is for messages. Errors as of :func:`load_object`."""
    try:
        arrays = parse_npz(data)
    except ValueError as error:
        raise AssetError(
            f"object file cannot be read ({error})", where, "restore the file, or make it again"
        ) from error
    try:
        return _object(arrays, where)
    except (ValueError, KinematicsError) as error:
        reason = error.what if isinstance(error, KinematicsError) else error
        raise AssetError(f"not an artsim object file ({reason})", where, _AGAIN) from error


def _object(arrays: Mapping[str, NDArray[Any]], source: str) -> ArticulatedObject:
    """The object that the arrays of a file describe; a ValueError or KinematicsError says why there is none."""
    lacking = {"header", "vertices", "faces", "vertex_counts", "face_counts"} - arrays.keys()
    if lacking:
        raise ValueError(f"lacks {', '.join(sorted(lacking))}")
    header = parse_json(arrays["header"].tobytes())
    if not isinstance(header, dict):
        raise ValueError("its header is not a set of named values")
    if header.get("format") != _COMPILED_FORMAT:
        raise ValueError(f"its format is {header.get('format')!r:.20}, not {_COMPILED_FORMAT}")
    tree = KinematicTree.from_dict(header.get("tree"))
    if not np.isfinite(tree.complete_state(tree.rest)).all():
        raise ValueError("its rest state is not finite")
    names, labels = _texts(header.get("names"), len(tree)), _texts(header.get("labels"), len(tree))
    object_id, category, sha256 = _texts([header.get(key) for key in ("object_id", "category", "sha256")], 3)
    (scale,) = _numbers([header.get("scale")], (1,))
    if not 0.0 < scale <= LARGEST:
        raise ValueError(f"its scale is {scale}")
    repairs, notes = header.get("repairs"), header.get("notes", [])  # older files have no notes
    if not isinstance(repairs, list) or not isinstance(notes, list):
        raise ValueError("its repairs are no list")
    obj = ArticulatedObject(
        object_id=object_id,
        category=category,
        parts=_with_details(_parts(arrays, names, labels), header.get("details", []), arrays),
        native_tree=tree,
        sha256=sha256,
        scale=float(scale),
        T_base_rest=_numbers(header.get("T_base_rest"), (4, 4)),
        repairs=(
            *(Repair(where, what) for where, what in (_texts(repair, 2) for repair in repairs)),
            *(Repair(where, what, note=True) for where, what in (_texts(note, 2) for note in notes)),
        ),
        source=source,
        source_joints=_source_joints(header.get("source_joints"), len(tree)),
    )
    if not obj.diagonal > 0.0:
        raise ValueError("it has no extent")
    return obj


def _parts(arrays: Mapping[str, NDArray[Any]], names: Sequence[str], labels: Sequence[str]) -> tuple[Part, ...]:
    """Names, labels and meshes of the parts, of which at least one has triangles."""
    if len(names) > MAX_PARTS:
        raise ValueError(f"it has {len(names)} parts; part ids fit {MAX_PARTS}")
    vertices, faces = arrays["vertices"], arrays["faces"]
    for array, kinds, what in ((vertices, "f", "vertices"), (faces, "iu", "faces")):
        if array.dtype.kind not in kinds or array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"its {what} are {array.dtype} of shape {array.shape}")
    if not (np.abs(vertices) <= LARGEST).all():
        raise ValueError("a vertex is not finite, or out of range")
    if len(faces) == 0 or not np.ptp(vertices, axis=0).any():
        raise ValueError("it has no triangle, or no extent")
    ends = []
    for name, total in (("vertex_counts", len(vertices)), ("face_counts", len(faces))):
        counts = arrays[name]
        if counts.dtype.kind not in "iu" or counts.shape != (len(names),) or (counts < 0).any():
            raise ValueError(f"its {name} do not fit {len(names)} parts")
        if sum(counts.tolist()) != total:
            raise ValueError(f"its {name} add up to {sum(counts.tolist())}, not {total}")
        ends.append(np.cumsum(counts.astype(np.int64))[:-1])
    parts = []
    for name, label, v, f in zip(names, labels, np.split(vertices, ends[0]), np.split(faces, ends[1]), strict=True):
        if len(f) and not 0 <= int(f.min()) <= int(f.max()) < len(v):
            raise ValueError(f"a triangle of part {printable(name)} has a corner that does not exist")
        parts.append(Part(name, label, v.astype(np.float64, copy=False), f.astype(np.int32, copy=False)))
    return tuple(parts)


def _with_details(parts: tuple[Part, ...], listed: object, arrays: Mapping[str, NDArray[Any]]) -> tuple[Part, ...]:
    """The parts with the details that the header lists: label, part, frame and size."""
    if listed == []:
        return parts
    owner, count = arrays.get("detail_of_face"), sum(len(part.faces) for part in parts)
    if not isinstance(listed, list) or owner is None or owner.dtype.kind not in "iu" or owner.shape != (count,):
        raise ValueError("its details do not fit its faces")
    ends = np.cumsum([0, *(len(part.faces) for part in parts)])
    details: list[list[Detail]] = [[] for _ in parts]
    for entry in listed:
        k = entry[1] if isinstance(entry, list) and len(entry) == 4 else None
        if type(k) is not int or not 0 <= k < len(parts):
            raise ValueError(f"a detail is {entry!r:.60}")
        (label,) = _texts(entry[:1], 1)
        T, size = _numbers(entry[2], (4, 4)), _numbers(entry[3], (3,))
        faces = np.flatnonzero(owner[ends[k] : ends[k + 1]] == len(details[k]))
        details[k].append(Detail(label, T, size, faces=faces))
    return tuple(replace(part, details=tuple(own)) for part, own in zip(parts, details, strict=True))


def _texts(values: object, count: int) -> tuple[str, ...]:
    if not isinstance(values, list) or len(values) != count or not all(isinstance(value, str) for value in values):
        raise ValueError(f"{values!r:.60} is not {count} texts")
    return tuple(values)


def _numbers(values: object, shape: tuple[int, ...]) -> Array:
    """Nested lists of finite numbers as an array of that shape."""
    try:
        array = np.array(values)
    except ValueError:  # lists of different lengths
        array = np.empty(0)
    if array.dtype.kind not in "iuf" or array.shape != shape or not (np.abs(array) <= LARGEST).all():
        raise ValueError(f"{values!r:.60} is not numbers of shape {shape}")
    return array.astype(np.float64)


def _source_joints(joints: object, count: int) -> dict[str, tuple[int, float]]:
    if not isinstance(joints, dict):
        raise ValueError("its source joints are not a set of named values")
    found = {}
    for name, joint in joints.items():
        if not isinstance(joint, list) or len(joint) != 2 or type(joint[0]) is not int or not 0 <= joint[0] < count:
            raise ValueError(f"source joint {printable(name)} is {joint!r:.60}")
        found[name] = joint[0], float(_numbers(joint[1:], (1,))[0])
    return found
