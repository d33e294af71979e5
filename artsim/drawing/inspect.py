"""A readable description of an object: its tree, joints, limits, boxes and repairs."""

from typing import Any

import numpy as np

from artsim.common.names import printable
from artsim.model.joints import Joint, joint_record
from artsim.model.objects import ArticulatedObject


def describe(obj: ArticulatedObject) -> str:
    """Several lines of text: tree with joints and limits, boxes, and what was mended while loading."""
    size = obj.bounds[1] - obj.bounds[0]
    lines = [
        f"{printable(obj.category)} {printable(obj.object_id)}  ({printable(obj.source, 1000)})",
        f"{len(obj)} parts, {len(obj.tree.free_joints)} free joints, {obj.num_faces} triangles",
        f"box {_lengths(size)} m, diagonal {obj.diagonal:.4g} m, sha256 {obj.sha256[:16]}",
        "",
        "tree",
    ]
    depths = obj.tree.depths
    for k, (part, joint) in enumerate(zip(obj.parts, obj.tree.joints, strict=True)):
        label = printable(part.label)
        if part.label != part.name:
            label += f" ({printable(part.name)})"
        lines.append(f"  {'   ' * int(depths[k])}{'└─ ' if k else ''}{k} {label}{_joint_text(joint)}")
    lines += ["", "boxes in the rest frame: centre / size, m"]
    for k, part in enumerate(obj.parts):
        note = "" if len(part.faces) else "   (no geometry)"
        lines.append(f"  {k} {_lengths(obj.box_center[k])} / {_lengths(obj.box_size[k])}{note}")
    if obj.is_rigid:
        lines += ["", "no joint can move: the object is rigid"]
    lines += ["", f"repairs: {len(obj.repairs) or 'none'}", *(f"  {repair}" for repair in obj.repairs)]
    return "\n".join(lines)


def described(obj: ArticulatedObject) -> dict[str, Any]:
    """The same in JSON's terms: metres and radians, limits that are none as null."""
    parts = [
        {"name": part.name, "label": part.label, "joint": joint_record(joint), "box_center": center, "box_size": size}
        for part, joint, center, size in zip(obj.parts, obj.tree.joints, obj.box_center, obj.box_size, strict=True)
    ]
    return {
        "category": obj.category, "object_id": obj.object_id, "source": obj.source, "sha256": obj.sha256,
        "triangles": obj.num_faces, "free_joints": len(obj.tree.free_joints), "diagonal": obj.diagonal,
        "bounds": obj.bounds, "parts": parts, "repairs": obj.repairs,
    }  # fmt: skip


def _lengths(vector: np.ndarray) -> str:
    return " ".join(f"{v + 0.0:.4g}" for v in np.round(vector, 6))


def _joint_text(joint: Joint) -> str:
    if joint.type == "free":
        return ""
    if joint.type == "prismatic":
        limits = f"{joint.lower:.4g} to {joint.upper:.4g} m"
    elif np.isfinite(joint.lower):
        limits = f"{np.rad2deg(joint.lower):.1f} to {np.rad2deg(joint.upper):.1f} deg"
    else:
        limits = "turns freely"
    text = f"   {joint.type} '{printable(joint.name)}', axis {_lengths(np.array(joint.axis))}, {limits}"
    if joint.rest:
        rest = f"{joint.rest:.4g} m" if joint.type == "prismatic" else f"{np.rad2deg(joint.rest):.1f} deg"
        text += f", rest {rest}"
    if joint.type == "screw":
        text += f", {joint.pitch:.4g} m/rad"
    if joint.mimic is not None:
        text += f", follows {joint.mimic.source} x {joint.mimic.multiplier:g} + {joint.mimic.offset:g}"
    return text
