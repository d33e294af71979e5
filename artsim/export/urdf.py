"""URDF and the annotation of PartNet-Mobility folders."""

from collections.abc import Iterable

import numpy as np
from lxml import etree

from artsim.export.text import number, numbers
from artsim.model.robot import BoxShape, Link, LinkJoint, MeshShape, Robot

_KINDS = {"free": "free", "revolute": "hinge", "continuous": "hinge", "prismatic": "slider", "screw": "screw"}
"""What ``semantics.txt`` calls the joint of each part."""


def urdf_text(robot: Robot) -> str:
    """The object as a URDF document; its meshes lie in ``meshes/``."""
    root = etree.Element("robot", name=robot.name)
    # Read by MuJoCo alone: keep every link, every visual and the folders of the meshes.
    compiler = {"fusestatic": "false", "discardvisual": "false", "strippath": "false", "balanceinertia": "false"}
    etree.SubElement(etree.SubElement(root, "mujoco"), "compiler", compiler)
    for link in robot.links:
        _add_link(root, link)
    for joint in robot.joints:
        _add_joint(root, robot, joint)
    text: str = etree.tostring(root, pretty_print=True, encoding="unicode")
    return f'<?xml version="1.0"?>\n{text}'


def semantics_text(robot: Robot) -> str:
    """One line for each part: link, kind of joint, label."""
    obj = robot.obj
    rows = zip(obj.parts, obj.tree.types, strict=True)
    return "".join(f"{part.name} {_KINDS[kind]} {part.label}\n" for part, kind in rows)


def _add_link(root: etree._Element, link: Link) -> None:
    element = etree.SubElement(root, "link", name=link.name)
    inertia = link.inertia
    inertial = etree.SubElement(element, "inertial")
    _add_origin(inertial, inertia.center - link.origin)
    etree.SubElement(inertial, "mass", value=number(inertia.mass))
    entries = {f"i{a}{b}": number(inertia.tensor[i, j]) for i, j, a, b in _UPPER}
    etree.SubElement(inertial, "inertia", entries)
    if link.visual is not None:
        _add_shape(element, "visual", link, link.visual)
    for shape in link.collision:
        _add_shape(element, "collision", link, shape)


_UPPER = [(i, j, "xyz"[i], "xyz"[j]) for i in range(3) for j in range(i, 3)]


def _add_shape(element: etree._Element, tag: str, link: Link, shape: BoxShape | MeshShape) -> None:
    holder = etree.SubElement(element, tag, {"name": shape.detail} if shape.detail else {})
    _add_origin(holder, (shape.center if isinstance(shape, BoxShape) else np.zeros(3)) - link.origin)
    geometry = etree.SubElement(holder, "geometry")
    if isinstance(shape, BoxShape):
        etree.SubElement(geometry, "box", size=numbers(shape.size))
    else:
        etree.SubElement(geometry, "mesh", filename=f"meshes/{shape.name}.obj")


def _add_joint(root: etree._Element, robot: Robot, joint: LinkJoint) -> None:
    element = etree.SubElement(root, "joint", name=joint.name, type=joint.type)
    parent, child = robot.links[joint.parent], robot.links[joint.child]
    _add_origin(element, child.origin - parent.origin)
    etree.SubElement(element, "parent", link=parent.name)
    etree.SubElement(element, "child", link=child.name)
    etree.SubElement(element, "axis", xyz=numbers(joint.axis))
    limit = {"effort": number(joint.effort), "velocity": number(joint.velocity)}
    if joint.type != "continuous":
        limit = {"lower": number(joint.lower), "upper": number(joint.upper), **limit}
    etree.SubElement(element, "limit", limit)
    etree.SubElement(element, "dynamics", damping=number(joint.damping), friction=number(joint.friction))
    if joint.mimic is not None:
        source, multiplier, offset = joint.mimic
        etree.SubElement(element, "mimic", joint=source, multiplier=number(multiplier), offset=number(offset))


def _add_origin(element: etree._Element, xyz: Iterable[float]) -> None:
    etree.SubElement(element, "origin", xyz=numbers(xyz), rpy="0 0 0")
