"""GAPartNet: a URDF file with a link for each part and each handle, and what kind of part it is, and its box.

All joints are at 0 in the rest state, in which the boxes are given. Z is up, the front towards -X.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import orjson
from lxml import etree

from artsim.formats.base import ObjectFormat
from artsim.formats.links import Link, links_of
from artsim.model.joints import ROTATING, Joint
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

CORNERS = np.array(
    [(-1, 1, 1), (1, 1, 1), (1, -1, 1), (-1, -1, 1), (-1, 1, -1), (1, 1, -1), (1, -1, -1), (-1, -1, -1)]
) * 0.5  # fmt: skip
"""Of a box of side 1, in the order of its ``bbox``: x along a handle, z out of the part's front."""
_HINGED = {"door": "hinge_door", "lid": "hinge_lid", "knob": "hinge_knob", "dial": "hinge_knob",
           "handle": "hinge_handle", "lever": "hinge_handle"}  # fmt: skip
_SLIDING = {"drawer": "slider_drawer", "lid": "slider_lid", "button": "slider_button", "key": "slider_button"}
_LONG = 2.0
"""A handle is a line from so many times as long as wide on; else it is round."""
_UP_FRONT = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_UP_TOP = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Axes of boxes, as columns: of parts with a front towards -X, and of lids, whose outside is on top."""


class GapartnetFormat(ObjectFormat):
    """``<key>/``: ``mobility_annotation_gapartnet.urdf``, its meshes, two files of annotations, ``meta.json``."""

    def object_files(self, obj: ArticulatedObject) -> Iterator[tuple[str, bytes]]:
        """The files of an object."""
        import trimesh

        links = links_of(obj)
        names = [f"link_{k}" for k in range(len(links))]
        kinds = [gapart_of(link) for link in links]
        yield "mobility_annotation_gapartnet.urdf", _urdf(obj, links, names)
        told: list[dict[str, Any]] = [
            {"link_name": name, "is_gapart": bool(kind), "category": kind, "bbox": _box(link, kind) if kind else []}
            for name, link, kind in zip(names, links, kinds, strict=True)
        ]
        yield "link_annotation_gapartnet.json", orjson.dumps(told, option=orjson.OPT_SERIALIZE_NUMPY)
        lines = [f"{name} {_semantics(link, kind)}\n" for name, link, kind in zip(names, links, kinds, strict=True)]
        yield "semantics_gapartnet.txt", "".join(lines).encode()
        category = "".join(word.title() for word in obj.category.split("_"))
        yield "meta.json", orjson.dumps({"model_cat": category, "anno_id": obj.object_id})
        for name, link in zip(names, links, strict=True):
            if len(link.faces):
                mesh = trimesh.Trimesh(link.vertices, link.faces, process=False)
                yield (
                    f"textured_objs/{name}.obj",
                    mesh.export(file_type="obj", include_normals=False, header=None).encode(),
                )


def gapart_of(link: Link) -> str:
    """Class of a link among GAPartNet's nine; empty for one that is none of them."""
    if link.joint is None:
        if link.label == "button":
            return ""
        side = np.sort(link.size[1:])
        return "line_fixed_handle" if side[1] >= _LONG * side[0] else "round_fixed_handle"
    known = {"prismatic": _SLIDING, "revolute": _HINGED, "continuous": _HINGED}.get(link.joint.type, {})
    words = [word.rstrip("s") for word in reversed(link.label.split("_"))]
    return next((known[word] for word in words if word in known), "")


def _box(link: Link, kind: str) -> Array:
    """(8, 3) corners in the rest frame."""
    axes = link.axes[:, [2, 1, 0]] * [1.0, -1.0, 1.0] if link.joint is None else _UP_FRONT
    if kind.endswith("_lid"):
        axes = _UP_TOP
    size = link.size[::-1] if link.joint is None else np.abs(axes.T @ link.size)
    corners: Array = link.center + (CORNERS * size) @ axes.T
    return corners


def _semantics(link: Link, kind: str) -> str:
    """How it moves, and what it is."""
    first, _, rest = kind.partition("_")
    moves = {"free": "free", "prismatic": "slider"}.get(link.joint.type, "hinge") if link.joint else "fixed"
    return f"{first} {rest}" if kind else f"{moves} {link.label}"


def _urdf(obj: ArticulatedObject, links: Sequence[Link], names: Sequence[str]) -> bytes:
    """The frame of each link has its origin at its joint and the axes of the rest frame."""
    robot = etree.Element("robot", name=obj.category)
    origins = [np.zeros(3) if link.joint is None else np.array(link.joint.origin) for link in links]
    for link, name, origin in zip(links, names, origins, strict=True):
        element = etree.SubElement(robot, "link", name=name)
        for kind in ("visual", "collision") if len(link.faces) else ():
            shape = etree.SubElement(element, kind)
            etree.SubElement(shape, "origin", xyz=_text(-origin))
            geometry = etree.SubElement(shape, "geometry")
            etree.SubElement(geometry, "mesh", filename=f"textured_objs/{name}.obj")
    for k, link in enumerate(links):
        if link.parent >= 0:
            own = link.joint
            kind = "fixed" if own is None else _urdf_type(own)
            joint = etree.SubElement(robot, "joint", name=f"joint_{k}", type=kind)
            etree.SubElement(joint, "origin", xyz=_text(origins[k] - origins[link.parent]))
            etree.SubElement(joint, "parent", link=names[link.parent])
            etree.SubElement(joint, "child", link=names[k])
            if own is not None:
                etree.SubElement(joint, "axis", xyz=_text(np.array(own.axis)))
                _limits(joint, links, k)
    return bytes(etree.tostring(robot, pretty_print=True))


def _urdf_type(joint: Joint) -> str:
    """URDF has no screws: theirs turn only. What turns without end is continuous."""
    turns = "revolute" if np.isfinite([joint.lower, joint.upper]).all() else "continuous"
    return turns if joint.type in ROTATING else joint.type


def _limits(element: Any, links: Sequence[Link], k: int) -> None:
    """Limits, and what the joint follows, of states that are 0 at rest."""
    own = links[k].joint
    assert own is not None
    if _urdf_type(own) != "continuous":
        ends = {"lower": f"{own.lower - own.rest:.9g}", "upper": f"{own.upper - own.rest:.9g}"}
        etree.SubElement(element, "limit", **ends, effort="100", velocity="1")
    if own.mimic is not None:
        source = links[own.mimic.source].joint
        assert source is not None
        offset = own.mimic.multiplier * source.rest + own.mimic.offset - own.rest
        etree.SubElement(element, "mimic", joint=f"joint_{own.mimic.source}", multiplier=f"{own.mimic.multiplier:.9g}",
                         offset=f"{offset:.9g}")  # fmt: skip


def _text(vector: Array) -> str:
    return " ".join(f"{x:.9g}" for x in vector + 0.0)
