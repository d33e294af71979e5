"""SINGAPO: ``object.json``, the tree of an object's parts with boxes and joints, and their meshes as PLY.

Its frame is that of PartNet-Mobility's files: Y up, the front towards +Z, the box's diagonal 2. Handles and knobs are
parts that are fixed.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import orjson

from artsim.common.palette import PALETTE
from artsim.formats.base import ObjectFormat
from artsim.formats.links import Link, links_of
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.ply import mesh_ply

R_SINGAPO_REST = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
"""Rotates the rest frame, Z up and the front towards -X, into that of the files."""
NAMES = ("door", "drawer", "base", "handle", "wheel", "knob", "shelf", "tray")
"""What its loader knows parts by."""
_OTHERS = {"caster": "wheel", "dial": "knob", "button": "knob", "latch": "handle", "lever": "handle"}
_BY_JOINT = {"prismatic": "drawer"}


class SingapoFormat(ObjectFormat):
    """``<key>/object.json`` and ``<key>/plys/part_<id>.ply``."""

    def object_files(self, obj: ArticulatedObject) -> Iterator[tuple[str, bytes]]:
        """The tree of an object, and the meshes of its parts."""
        links, scale = links_of(obj), 2.0 / obj.diagonal
        nodes = [_node(links, k, scale) for k in range(len(links))]
        category = "".join(word.title() for word in obj.category.split("_"))
        meta = {"obj_cat": category, "object_id": obj.object_id, "scale": scale}
        document = {"meta": meta, "diffuse_tree": nodes}
        yield "object.json", orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY)
        for k, link in enumerate(links):
            if len(link.faces):
                vertices = _turned(link.vertices) * scale
                yield f"plys/part_{k}.ply", mesh_ply(vertices, link.faces, PALETTE[k % len(PALETTE)])


def _turned(vectors: Array) -> Array:
    return vectors @ R_SINGAPO_REST.T


def _node(links: list[Link], k: int, scale: float) -> dict[str, Any]:
    link = links[k]
    points = link.vertices if len(link.vertices) else link.center[None]
    low, high = points.min(axis=0) * scale, points.max(axis=0) * scale
    return {
        "id": k,
        "parent": link.parent,
        "name": _name(link),
        "children": [n for n, other in enumerate(links) if other.parent == k],
        "aabb": {"center": _turned(0.5 * (low + high)), "size": np.abs(_turned(high - low))},
        "joint": _joint(link, scale),
        "plys": [f"plys/part_{k}.ply"] if len(link.faces) else [],
        "objs": [],
    }


def _joint(link: Link, scale: float) -> dict[str, Any]:
    """The joint; a range begins at rest and is positive about the axis. Degrees, or lengths."""
    joint = link.joint
    if joint is None or joint.type == "free":
        return {"type": "fixed", "range": [0.0, 0.0], "axis": {"origin": [0.0] * 3, "direction": [0.0] * 3}}
    low, high = joint.lower - joint.rest, joint.upper - joint.rest
    way, sign = (high, 1.0) if high >= -low else (-low, -1.0)  # whichever end is farther from rest
    if joint.type == "continuous":
        way = 360.0
    elif joint.type == "revolute":
        way = float(np.rad2deg(way))
    else:
        way *= scale * (joint.pitch if joint.type == "screw" else 1.0)
    axis, origin = _turned(np.array(joint.axis)), _turned(np.array(joint.origin)) * scale
    finite = way if np.isfinite(way) else 360.0
    return {"type": joint.type, "range": [0.0, finite], "axis": {"origin": origin, "direction": sign * axis}}


def _name(link: Link) -> str:
    """The name that its loader knows which is the nearest to the label."""
    if link.joint is not None and link.joint.type == "free":
        return "base"
    words = link.label.split("_")
    known = [_OTHERS.get(word, word) for word in reversed(words) if _OTHERS.get(word, word) in NAMES]
    kind = "" if link.joint is None else link.joint.type
    return known[0] if known else _BY_JOINT.get(kind, "door")
