"""Shape2Motion (Wang et al., CVPR 2019): ``motion_attributes.json``, a tree of parts, with a mesh of each.

Each node has ``dof_name``, ``motion_type`` (none, rotation, translation), a point (``center``) and a ``direction`` of
its axis, and ``children``, all in the frame of the meshes, with Z up. The mesh of the root is
``part_objs/none_motion.obj``, that of another node ``part_objs/<dof_name>.obj``. No node says how far it moves.
"""

from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.products import norm
from artsim.errors import AssetError
from artsim.loading.json_values import text, triple
from artsim.loading.meshes import MeshReader
from artsim.loading.scene_objects import WorldJoint, WorldLink
from artsim.loading.urdf_document import MeshFile, Shape, UrdfRobot
from artsim.loading.xml_values import Element
from artsim.loading.zero_pose import as_document
from artsim.model.objects import Repair

_MOVES = {"rotation": "continuous", "translation": "prismatic", "none": "fixed"}
_ROOT_MESH = "none_motion"
_MAX_DEPTH = 100


def is_shape2motion(document: object) -> bool:
    """Whether a JSON value is a node of such a tree."""
    return isinstance(document, dict) and "dof_name" in document and "motion_type" in document


def read_shape2motion(
    document: dict[str, Any], file: Path, reader: MeshReader
) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of a tree, as :func:`artsim.loading.documents.read_document` gives them."""
    repairs: list[Repair] = []
    links: list[WorldLink] = []
    waiting: list[tuple[Any, int]] = [(document, -1)]
    while waiting:
        node, parent = waiting.pop()
        if len(links) >= reader.limits.max_links:
            raise AssetError(f"it has more than {reader.limits.max_links} parts", file, "raise LoadLimits.max_links")
        where = f"{file}: node {len(links)}"
        if not isinstance(node, dict):
            raise AssetError("a child is no node", where, 'write {"dof_name": ..., "motion_type": ..., ...}')
        links.append(_link(node, parent, where, file, repairs))
        children = node.get("children") or []
        if not isinstance(children, list):
            raise AssetError("its children are no list", where, 'write "children": []')
        waiting += [(child, len(links) - 1) for child in reversed(children)]
    # The first link of a document is the world: here it shows nothing, and holds the root.
    held = WorldJoint("root", "fixed", np.zeros(3), np.array([1.0, 0.0, 0.0]))
    for link in links:
        link.parent += 1
    links[0].joint = held
    return as_document([WorldLink("world"), *links], file, repairs), repairs, []


def _link(node: dict[str, Any], parent: int, where: str, file: Path, repairs: list[Repair]) -> WorldLink:
    name = text(node.get("dof_name"), "dof_name", where)
    shape = Shape(MeshFile(f"part_objs/{_ROOT_MESH if parent < 0 else name}.obj"), np.eye(4))
    if parent < 0:
        return WorldLink(name, shapes=[shape])
    kind = str(node.get("motion_type"))
    if kind not in _MOVES:
        raise AssetError(
            f"motion_type {kind[:60]!r} is not supported", f"{where} ({name[:60]})", f"use one of {', '.join(_MOVES)}"
        )
    moves, element = _MOVES[kind], Element(f"joint {name!r}", file, repairs)
    center, direction = (triple(node.get(key), key, where) for key in ("center", "direction"))
    if moves != "fixed" and not np.abs(direction).max() > 0:
        element.say("has no direction, along which nothing moves: read as fixed")
        moves = "fixed"
    axis = direction / norm(direction) if moves != "fixed" else np.array([1.0, 0.0, 0.0])
    if moves == "continuous":
        element.say("does not say how far it turns: read as continuous")
    return WorldLink(name, parent, WorldJoint(name, moves, center, axis), [shape])
