"""From the bytes of a URDF file to a checked ``yourdfpy`` robot.

The file is untrusted: no document type, no entities, bounded size, every number finite. What can be mended
is mended in the XML tree and recorded; what cannot raises an error that names the element.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree

from artsim.errors import AssetError
from artsim.objects import Repair

if TYPE_CHECKING:
    import yourdfpy

MOVING_TYPES = ("revolute", "continuous", "prismatic")
KNOWN_TYPES = (*MOVING_TYPES, "fixed", "floating")
SHAPES = {"box": ("size", 3), "cylinder": ("radius", 1), "sphere": ("radius", 1), "mesh": ("filename", 0)}


def safe_xml(data: bytes, where: Path) -> etree._Element:
    """Parse XML without entities, document types, network or huge nodes.

    Raises
    ------
    AssetError
        When the file is empty, not well formed, or declares a document type.
    """
    if not data.strip():
        raise AssetError("the file is empty", where, "write or download it again")
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise AssetError(f"not well-formed XML ({error})", where, "mend the element at that line") from error
    if root.getroottree().docinfo.doctype:
        raise AssetError("declares a document type, which could hide entities", where, "remove the <!DOCTYPE ...>")
    return root


def parse_robot(
    data: bytes, where: Path, max_links: int, shapeless: Collection[str] = ()
) -> tuple[yourdfpy.Robot, list[Repair]]:
    """Check and mend a URDF document, then let yourdfpy read it.

    Parameters
    ----------
    data : bytes
        Content of the URDF file.
    where : Path
        Its path, for messages.
    max_links : int
        Limit on the number of links.
    shapeless : collection of str
        Links that are known to have no geometry.

    Returns
    -------
    robot : yourdfpy.Robot
    repairs : list of Repair

    Raises
    ------
    AssetError
        Naming the file and the element that cannot be used.
    """
    import yourdfpy  # takes most of a second, which only loading should pay for

    root = safe_xml(data, where)
    if root.tag != "robot":
        raise AssetError(f"the top element is <{root.tag}>, not <robot>", where, "pass a URDF file")
    repairs: list[Repair] = []
    if not root.get("name"):
        root.set("name", where.stem)
        repairs.append(Repair("<robot>", f"has no name: called {where.stem!r}"))
    links, joints = root.findall("link"), root.findall("joint")
    if not links:
        raise AssetError("has no <link>", where, "pass a URDF file that describes an object")
    if len(links) > max_links:
        raise AssetError(f"{len(links)} links are over the limit of {max_links}", where, "raise LoadLimits.max_links")
    _check_names(links, "link", where)
    _check_names(joints, "joint", where)
    for link in links:
        _check_link(link, where, repairs)
    names = {link.get("name") for link in links}
    for joint in joints:
        _check_joint(joint, names, where, repairs)
    _summarise_missing(links, shapeless, repairs)
    robot = yourdfpy.URDF.load(
        io.BytesIO(etree.tostring(root)), build_scene_graph=False, load_meshes=False, filename_handler=lambda f: f
    ).robot
    return robot, repairs


def _check_names(elements: list[etree._Element], tag: str, where: Path) -> None:
    counts = Counter(e.get("name") for e in elements)
    for name, count in counts.items():
        if not name:
            raise AssetError(f"a <{tag}> has no name", where, "name it")
        if count > 1:
            raise AssetError(f"{count} {tag}s are called {name!r}", where, "give each its own name")


def _numbers(element: etree._Element, attribute: str, count: int, where: str, default: str | None = None) -> np.ndarray:
    """The finite numbers of an attribute; ``where`` names the file and the element in errors."""
    text = element.get(attribute, default)
    if text is None:
        raise AssetError(f"<{element.tag}> has no {attribute!r}", where, f"write {count} numbers")
    try:
        values = np.array([float(v) for v in text.split()])
    except ValueError:
        raise AssetError(f"{attribute}={text!r} of <{element.tag}> is not numbers", where, "write numbers") from None
    if len(values) != count:
        raise AssetError(f"{attribute}={text!r} of <{element.tag}> is not {count} numbers", where, "mend the attribute")
    if not np.isfinite(values).all():
        raise AssetError(f"{attribute}={text!r} of <{element.tag}> is not finite", where, "mend the attribute")
    return values


def _check_origin(parent: etree._Element, where: str) -> None:
    origin = parent.find("origin")
    if origin is not None:
        _numbers(origin, "xyz", 3, where, "0 0 0")
        _numbers(origin, "rpy", 3, where, "0 0 0")


def _check_link(link: etree._Element, file: Path, repairs: list[Repair]) -> None:
    name = f"link {link.get('name')!r}"
    where = f"{file}: {name}"
    for inertial in link.findall("inertial"):
        link.remove(inertial)  # not used for geometry or kinematics, and a broken one must not stop the loader
    for visual in [*link.findall("visual"), *link.findall("collision")]:
        _check_origin(visual, where)
        geometry = visual.find("geometry")
        shape = next((s for s in geometry if s.tag in SHAPES), None) if geometry is not None else None
        if shape is None:
            kinds = [s.tag for s in geometry] if geometry is not None else []
            link.remove(visual)
            repairs.append(Repair(name, f"<{visual.tag}> left out: geometry {kinds} is not one of {list(SHAPES)}"))
            continue
        for material in visual.findall("material"):
            visual.remove(material)
        attribute, count = SHAPES[shape.tag]
        if shape.tag == "mesh":
            if not shape.get("filename"):
                link.remove(visual)
                repairs.append(Repair(name, f"<{visual.tag}> left out: its mesh has no filename"))
            elif shape.get("scale") is not None:
                size = len(shape.get("scale").split())
                _numbers(shape, "scale", 1 if size == 1 else 3, where)
            continue
        sizes = _numbers(shape, attribute, count, where)
        if shape.tag == "cylinder":
            sizes = np.append(sizes, _numbers(shape, "length", 1, where))
        if not (sizes > 0).all():
            link.remove(visual)
            repairs.append(Repair(name, f"<{visual.tag}> left out: <{shape.tag}> has a size of {sizes.min():g}"))


def _check_joint(joint: etree._Element, links: set[str | None], file: Path, repairs: list[Repair]) -> None:
    name = f"joint {joint.get('name')!r}"
    where = f"{file}: {name}"
    kind = joint.get("type")
    if kind not in KNOWN_TYPES:
        raise AssetError(f"joint type {kind!r} is not supported", where, f"use one of {', '.join(KNOWN_TYPES)}")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            raise AssetError(f"its {end} link {link!r} does not exist", where, "name a link of the file")
    _check_origin(joint, where)
    mimic = joint.find("mimic")
    if mimic is not None:
        _numbers(mimic, "multiplier", 1, where, "1")
        _numbers(mimic, "offset", 1, where, "0")
    if kind not in MOVING_TYPES:
        return
    axis = joint.find("axis")
    direction = _numbers(axis, "xyz", 3, where, "1 0 0") if axis is not None else np.array([1.0, 0.0, 0.0])
    length = np.linalg.norm(direction)
    if length < 1e-9:
        joint.set("type", "fixed")
        repairs.append(Repair(name, "has a zero axis, along which nothing moves: read as fixed"))
        return
    if abs(length - 1.0) > 1e-6:
        stretched = ", its travel and limits multiplied by it as simulators do" if kind == "prismatic" else ""
        repairs.append(Repair(name, f"axis of length {length:.6g} normalised{stretched}"))
    _check_limit(joint, kind, name, where, repairs)


def _check_limit(joint: etree._Element, kind: str, name: str, where: str, repairs: list[Repair]) -> None:
    limit = joint.find("limit")
    if kind == "continuous":
        if limit is not None:
            if limit.get("lower") is not None or limit.get("upper") is not None:
                repairs.append(Repair(name, "is continuous: its limits are ignored"))
            joint.remove(limit)
        return
    if limit is None:
        if kind == "revolute":
            joint.set("type", "continuous")
            repairs.append(Repair(name, "is revolute without a limit: read as continuous"))
            return
        limit = etree.SubElement(joint, "limit")
        repairs.append(Repair(name, "is prismatic without a limit: held at 0"))
    for attribute in ("effort", "velocity"):
        if limit.get(attribute) is not None:
            limit.attrib.pop(attribute)  # not kinematics; some files carry text here
    lower = float(_numbers(limit, "lower", 1, where, "0")[0])
    upper = float(_numbers(limit, "upper", 1, where, "0")[0])
    if any(
        text.strip().startswith("-0") and float(text) == 0 for text in (limit.get("lower", ""), limit.get("upper", ""))
    ):
        repairs.append(Repair(name, "limit -0 read as 0"))
    if lower > upper:
        repairs.append(Repair(name, f"limits {lower:g} and {upper:g} swapped"))
        lower, upper = upper, lower
    limit.set("lower", repr(lower + 0.0))
    limit.set("upper", repr(upper + 0.0))


def _summarise_missing(links: list[etree._Element], shapeless: Collection[str], repairs: list[Repair]) -> None:
    empty = [link.get("name") for link in links if link.find("visual") is None and link.find("collision") is None]
    empty = [name for name in empty if name not in shapeless]
    if empty:
        repairs.append(Repair("links", f"without geometry: {', '.join(map(str, empty))}"))
